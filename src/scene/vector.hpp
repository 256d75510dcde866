// Vectors of three numbers. All of it comes out the same on every machine: operations are not fused, and square roots are exactly rounded.
#pragma once

#include <array>
#include <cmath>

#include "raypager/scene.hpp"

namespace raypager {

inline bool finite(const Float3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

using Vector = std::array<double, 3>;

inline Vector operator+(const Vector& a, const Vector& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Vector operator-(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vector operator*(double s, const Vector& v) { return {s * v[0], s * v[1], s * v[2]}; }
inline Vector operator*(const Vector& v, double s) { return s * v; }
inline double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vector cross(const Vector& a, const Vector& b) { return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }
inline double length(const Vector& v) { return std::sqrt(dot(v, v)); }
inline Vector unit(const Vector& v) { return (1 / length(v)) * v; }  // REQUIRES: v is not the null vector
inline Vector vector(const Float3& p) { return {p.x, p.y, p.z}; }
inline Float3 float3(const Vector& v) { return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])}; }

}  // namespace raypager
