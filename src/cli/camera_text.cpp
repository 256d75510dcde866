#include "cli/camera_text.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <numbers>
#include <vector>

#include "scene/vector.hpp"

namespace raypager {
namespace {

constexpr double half_degree = std::numbers::pi / 360;

std::optional<double> camera_number(std::string_view text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(static_cast<float>(value))) return std::nullopt;
    return value;
}

// The first words of text, between commas.
std::vector<std::string_view> words_between_commas(std::string_view text, size_t most) {
    std::vector<std::string_view> words;
    while (words.size() < most) {
        const size_t comma = text.find(',');
        words.push_back(text.substr(0, comma));
        if (comma == std::string_view::npos) break;
        text.remove_prefix(comma + 1);
    }
    return words;
}

bool has_direction(const CameraText& camera) {
    const Vector forward = camera.target - vector(camera.eye), across = cross(forward, camera.up);
    return dot(across, across) > 1e-12 * dot(forward, forward) * dot(camera.up, camera.up);
}

double rounded(double value, int digits) { return std::strtod(fmt::format("{:.{}g}", value, digits).c_str(), nullptr); }

Vector rounded(const Vector& v, int digits) { return {rounded(v[0], digits), rounded(v[1], digits), rounded(v[2], digits)}; }

bool same_bits(const Camera& a, const Camera& b) { return a.eye == b.eye && a.right == b.right && a.up == b.up && a.forward == b.forward; }

// Searches the numbers from which make_camera comes to a camera again. Its axes are rounded to floats, so that they do not tell exactly where they
// point: directions around are tried, fewer digits first.
class CameraSearch {
public:
    CameraSearch(const Camera& camera, uint32_t width, uint32_t height, double distance)
        : camera_(camera), width_(width), height_(height), distance_(distance) {}

    CameraText run() {
        const Vector forward = unit(vector(camera_.forward)), right = unit(vector(camera_.right)), up = unit(vector(camera_.up));
        const double half = length(vector(camera_.up)) / length(vector(camera_.forward)) * std::min(width_, height_) / height_;
        const double fov = std::atan(half) / half_degree;
        const bool mirrored = dot(cross(forward, up), right) < 0;
        const CameraText nearest = text(forward, upright_axis(camera_), fov, mirrored, 12);
        for (const int digits : {7, 9, 12, 15})
            for (const double angle : {rounded(fov, 5), rounded(fov, 7), rounded(fov, 10)})
                for (const Vector& direction : directions(forward, right, up, digits))
                    if (const CameraText found = text(direction, upright_axis(camera_), angle, mirrored, digits); makes_it(found)) return found;
        return nearest;
    }

private:
    // A grid within the rounding of floats, from its middle outwards; of few digits only the middle, for those round more than that.
    static std::vector<Vector> directions(const Vector& forward, const Vector& right, const Vector& up, int digits) {
        constexpr double step = 1.2e-8;
        std::vector<Vector> all = {forward};
        for (int ring = 1; digits > 9 && ring <= 8; ring++)
            for (int i = -ring; i <= ring; i++)
                for (int j = -ring; j <= ring; j++)
                    if (std::max(std::abs(i), std::abs(j)) == ring) all.push_back(forward + i * step * right + j * step * up);
        return all;
    }
    CameraText text(const Vector& forward, const Vector& up, double fov, bool mirrored, int digits) const {
        return {camera_.eye, rounded(vector(camera_.eye) + distance_ * forward, digits), rounded(up, 9), fov, mirrored};
    }
    bool makes_it(const CameraText& found) const {
        const auto made = make_camera(found, width_, height_);
        return made && same_bits(*made, camera_);
    }

    const Camera& camera_;
    const uint32_t width_, height_;
    const double distance_;
};

}  // namespace

Result<CameraText> parse_camera(std::string_view text) {
    const auto wrong = [&](std::string_view reason) {
        return Status::usage(fmt::format("'{}' {}; give ten numbers: eye x,y,z, target x,y,z, up x,y,z, field of view in degrees; and ,mirrored "
                                         "behind them for a picture whose left and right are exchanged",
                                         text, reason));
    };
    constexpr size_t count = 10;
    const auto words = words_between_commas(text, count + 2);
    if (words.size() < count || words.size() > count + 1) return wrong("is not a camera");
    std::array<double, count> numbers = {};
    for (size_t i = 0; i < count; ++i) {
        const auto number = camera_number(words[i]);
        if (!number) return wrong("is not a camera");
        numbers[i] = *number;
    }
    if (words.size() > count && words[count] != "mirrored") return wrong("is not a camera");
    const auto& n = numbers;
    const CameraText camera{float3({n[0], n[1], n[2]}), {n[3], n[4], n[5]}, {n[6], n[7], n[8]}, n[9], words.size() > count};
    if (!(camera.fov_degrees > 0 && camera.fov_degrees < 180)) return wrong("has a field of view that is not between 0 and 180 degrees");
    if (!has_direction(camera)) return wrong("has no direction: eye and target are the same, or up lies along the line of sight");
    return camera;
}

std::string format_camera(const CameraText& camera) {
    const auto [eye, target, up, fov, mirrored] = camera;
    return fmt::format("{},{},{},{},{},{},{},{},{},{}{}", eye.x, eye.y, eye.z, target[0], target[1], target[2], up[0], up[1], up[2], fov,
                       mirrored ? ",mirrored" : "");
}

std::optional<Camera> make_camera(const CameraText& text, uint32_t width, uint32_t height) {
    return make_exact_camera(text.eye, text.target, text.up, text.fov_degrees, width, height, !text.mirrored);
}

std::optional<CameraText> describe_camera(const Camera& camera, uint32_t width, uint32_t height, double distance) {
    const Vector forward = vector(camera.forward), right = vector(camera.right), up = vector(camera.up);
    const double f = length(forward), r = length(right), u = length(up);
    constexpr double tolerance = 1e-4;
    if (!(f > 0 && r > 0 && u > 0) || width == 0 || height == 0) return std::nullopt;
    if (std::abs(dot(forward, right)) > tolerance * f * r || std::abs(dot(forward, up)) > tolerance * f * u ||
        std::abs(dot(right, up)) > tolerance * r * u || std::abs(r / u * height / width - 1) > tolerance)
        return std::nullopt;
    return CameraSearch(camera, width, height, distance > 0 && std::isfinite(distance) ? distance : 1).run();
}

std::array<double, 3> upright_axis(const Camera& camera) {
    const Vector right = unit(vector(camera.right)), up = unit(vector(camera.up));
    Vector best = up;
    double most = 0.05;  // what is nearly along the line of sight is not upright
    for (const Vector& axis : {Vector{0, 1, 0}, Vector{0, 0, 1}, Vector{1, 0, 0}, Vector{0, -1, 0}, Vector{0, 0, -1}, Vector{-1, 0, 0}}) {
        if (std::abs(dot(axis, right)) > 1e-6 || dot(axis, up) <= most) continue;
        best = axis;
        most = dot(axis, up);
    }
    return best;
}

}  // namespace raypager
