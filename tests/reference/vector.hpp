// Three doubles: the reference tracer computes in double precision wherever Embree does not decide.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "raypager/scene.hpp"

namespace raypager::reference {

using std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();

struct Vec3 {
    double x = 0, y = 0, z = 0;
    Vec3() = default;
    Vec3(double x_, double y_, double z_) : x(x_), y(y_), z(z_) {}
    explicit Vec3(double all) : x(all), y(all), z(all) {}
    explicit Vec3(const Float3& v) : x(v.x), y(v.y), z(v.z) {}
    explicit Vec3(const std::array<double, 3>& v) : x(v[0]), y(v[1]), z(v[2]) {}
    explicit Vec3(const float* v) : x(v[0]), y(v[1]), z(v[2]) {}

    double operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
    Vec3 operator-() const { return {-x, -y, -z}; }
    Vec3& operator+=(const Vec3& b) { return *this = {x + b.x, y + b.y, z + b.z}; }
    Vec3& operator*=(const Vec3& b) { return *this = {x * b.x, y * b.y, z * b.z}; }
    Vec3& operator*=(double s) { return *this = {x * s, y * s, z * s}; }
    // Rounds each component once.
    Float3 to_float() const { return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)}; }
};

inline Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator*(const Vec3& a, const Vec3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
inline Vec3 operator*(const Vec3& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline Vec3 operator*(double s, const Vec3& a) { return a * s; }
inline Vec3 operator/(const Vec3& a, double s) { return {a.x / s, a.y / s, a.z / s}; }
inline double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(const Vec3& a, const Vec3& b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline double length(const Vec3& a) { return std::sqrt(dot(a, a)); }
inline Vec3 normalized(const Vec3& a) { return a / length(a); }
inline double max_component(const Vec3& a) { return std::max({a.x, a.y, a.z}); }
inline double max_magnitude(const Vec3& a) { return std::max({std::abs(a.x), std::abs(a.y), std::abs(a.z)}); }
inline bool is_black(const Vec3& a) { return a.x == 0 && a.y == 0 && a.z == 0; }

// Two unit vectors that form a right-handed frame with the unit vector z.
struct Frame {
    Vec3 x, y, z;
    explicit Frame(const Vec3& axis) : z(axis) {
        x = normalized(cross(std::abs(z.x) < 0.6 ? Vec3(1, 0, 0) : Vec3(0, 1, 0), z));
        y = cross(z, x);
    }
    // x as near to `along` as it can be. REQUIRES: that is no multiple of the axis.
    Frame(const Vec3& axis, const Vec3& along) : x(normalized(along - dot(along, axis) * axis)), y(cross(axis, x)), z(axis) {}
    Vec3 to_world(const Vec3& v) const { return v.x * x + v.y * y + v.z * z; }
    Vec3 to_local(const Vec3& v) const { return {dot(v, x), dot(v, y), dot(v, z)}; }
};

}  // namespace raypager::reference
