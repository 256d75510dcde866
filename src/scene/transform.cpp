#include <algorithm>
#include <cmath>
#include <utility>

#include "raypager/scene.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

// The unit vector, or nothing if the length is zero or not finite. Scaled first, so that squares neither overflow nor vanish.
std::optional<Vector> normalized(Vector v) {
    const double largest = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
    if (!(largest > 0) || !std::isfinite(largest)) return std::nullopt;
    for (double& x : v) x /= largest;
    const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (double& x : v) x /= length;
    return v;
}

// Sine of the angle between "up" and the view below which no stable image axis can be made of the two.
constexpr double smallest_sine = 1e-7;

Float3 with_length(const Float3& v, double wanted) {
    const double old = length(vector(v)), factor = old > 0 ? wanted / old : 0;
    return {static_cast<float>(v.x * factor), static_cast<float>(v.y * factor), static_cast<float>(v.z * factor)};
}

}  // namespace

Transform Transform::translate(double x, double y, double z) {
    Transform result;
    result.m[0][3] = x;
    result.m[1][3] = y;
    result.m[2][3] = z;
    return result;
}

Transform Transform::scale(double x, double y, double z) {
    Transform result;
    result.m[0][0] = x;
    result.m[1][1] = y;
    result.m[2][2] = z;
    return result;
}

// Rodrigues' formula. An axis without direction rotates nothing.
Transform Transform::rotate(double degrees, double x, double y, double z) {
    const auto axis = normalized({x, y, z});
    Transform result;
    if (!axis) return result;
    const double angle = degrees * (3.14159265358979323846 / 180.0);
    const double c = std::cos(angle), s = std::sin(angle);
    const Vector& a = *axis;
    const double skew[3][3] = {{0, -a[2], a[1]}, {a[2], 0, -a[0]}, {-a[1], a[0], 0}};
    for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j) result.m[i][j] = a[i] * a[j] * (1 - c) + skew[i][j] * s + (i == j ? c : 0.0);
    return result;
}

std::optional<Transform> Transform::look_at(const Vector& eye, const Vector& target, const Vector& up) {
    const auto forward = normalized({target[0] - eye[0], target[1] - eye[1], target[2] - eye[2]});
    const auto up_direction = normalized(up);
    if (!forward || !up_direction) return std::nullopt;
    const Vector side = cross(*up_direction, *forward);
    if (std::hypot(side[0], side[1], side[2]) < smallest_sine) return std::nullopt;
    const Vector right = *normalized(side);
    const Vector true_up = cross(*forward, right);
    Transform camera_to_world;
    for (size_t i = 0; i < 3; ++i) {
        camera_to_world.m[i][0] = right[i];
        camera_to_world.m[i][1] = true_up[i];
        camera_to_world.m[i][2] = (*forward)[i];
        camera_to_world.m[i][3] = eye[i];
    }
    return camera_to_world.inverse();
}

Transform Transform::operator*(const Transform& other) const {
    Transform result;
    for (size_t i = 0; i < 4; ++i)
        for (size_t j = 0; j < 4; ++j) {
            result.m[i][j] = 0;
            for (size_t k = 0; k < 4; ++k) result.m[i][j] += m[i][k] * other.m[k][j];
        }
    return result;
}

// Gauss-Jordan elimination with partial pivoting.
std::optional<Transform> Transform::inverse() const {
    auto a = m;
    Transform result;
    auto& b = result.m;
    for (size_t column = 0; column < 4; ++column) {
        size_t pivot = column;
        for (size_t row = column + 1; row < 4; ++row)
            if (std::abs(a[row][column]) > std::abs(a[pivot][column])) pivot = row;
        std::swap(a[column], a[pivot]);
        std::swap(b[column], b[pivot]);
        const double divisor = a[column][column];
        if (divisor == 0 || !std::isfinite(divisor)) return std::nullopt;
        for (size_t j = 0; j < 4; ++j) {
            a[column][j] /= divisor;
            b[column][j] /= divisor;
        }
        for (size_t row = 0; row < 4; ++row) {
            const double factor = a[row][column];
            if (row == column || factor == 0) continue;
            for (size_t j = 0; j < 4; ++j) {
                a[row][j] -= factor * a[column][j];
                b[row][j] -= factor * b[column][j];
            }
        }
    }
    for (const auto& row : b)
        for (const double x : row)
            if (!std::isfinite(x)) return std::nullopt;
    return result;
}

Transform Transform::transpose() const {
    Transform result;
    for (size_t i = 0; i < 4; ++i)
        for (size_t j = 0; j < 4; ++j) result.m[i][j] = m[j][i];
    return result;
}

std::array<double, 3> Transform::point(double x, double y, double z) const {
    Vector result;
    for (size_t i = 0; i < 3; ++i) result[i] = m[i][0] * x + m[i][1] * y + m[i][2] * z + m[i][3];
    const double w = m[3][0] * x + m[3][1] * y + m[3][2] * z + m[3][3];
    if (w != 1)
        for (double& value : result) value /= w;
    return result;
}

std::array<double, 3> Transform::vector(double x, double y, double z) const {
    Vector result;
    for (size_t i = 0; i < 3; ++i) result[i] = m[i][0] * x + m[i][1] * y + m[i][2] * z;
    return result;
}

bool Transform::swaps_handedness() const {
    const Vector x = vector(1, 0, 0), y = vector(0, 1, 0), z = vector(0, 0, 1);
    const Vector n = cross(x, y);
    return n[0] * z[0] + n[1] * z[1] + n[2] * z[2] < 0;
}

bool Transform::is_identity() const { return m == Transform().m; }

std::optional<Camera> make_camera(const Float3& eye, const Float3& target, const Float3& up, double fov_degrees, uint32_t width, uint32_t height,
                                  bool right_handed) {
    return make_exact_camera(eye, {target.x, target.y, target.z}, {up.x, up.y, up.z}, fov_degrees, width, height, right_handed);
}

std::optional<Camera> make_exact_camera(const Float3& eye, const std::array<double, 3>& target, const std::array<double, 3>& up, double fov_degrees,
                                        uint32_t width, uint32_t height, bool right_handed) {
    if (!(fov_degrees > 0 && fov_degrees < 180) || width == 0 || height == 0) return std::nullopt;
    const auto to_camera = Transform::look_at({eye.x, eye.y, eye.z}, target, up);
    if (!to_camera) return std::nullopt;
    const double half = std::tan(fov_degrees * (3.14159265358979323846 / 360.0));
    const double shorter = std::min(width, height);
    const double half_width = half * width / shorter, half_height = half * height / shorter;
    // The rows of a rigid world-to-camera matrix are the camera's axes in the world; its x axis is up x forward.
    const auto axis = [&](size_t row, double scale) {
        const auto& r = to_camera->m[row];
        return Float3{static_cast<float>(r[0] * scale), static_cast<float>(r[1] * scale), static_cast<float>(r[2] * scale)};
    };
    Camera camera;
    camera.eye = eye;
    camera.right = axis(0, right_handed ? -half_width : half_width);
    camera.up = axis(1, half_height);
    camera.forward = axis(2, 1);
    return camera;
}

Camera fit_camera(Camera camera, uint32_t old_width, uint32_t old_height, uint32_t width, uint32_t height) {
    if (uint64_t(width) * old_height == uint64_t(height) * old_width || camera.sees_all_around()) return camera;
    const double shorter = old_width <= old_height ? length(vector(camera.right)) : length(vector(camera.up));
    const double sides = double(width) / height;
    camera.right = with_length(camera.right, shorter * std::max(1.0, sides));
    camera.up = with_length(camera.up, shorter * std::max(1.0, 1 / sides));
    return camera;
}

bool Transform::is_similarity(double tolerance) const {
    double gram[3][3], largest = 0;
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j < 3; j++) {
            gram[i][j] = m[0][i] * m[0][j] + m[1][i] * m[1][j] + m[2][i] * m[2][j];
            largest = std::max(largest, std::abs(gram[i][j]));
        }
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j < 3; j++)
            if (std::abs(gram[i][j] - (i == j ? gram[0][0] : 0.0)) > tolerance * largest) return false;
    return true;
}

}  // namespace raypager
