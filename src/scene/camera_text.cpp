#include "raypager/camera_text.hpp"

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

struct Interval {
    double low = -1e-6, high = 1e-6;  // far more than single precision rounds, in radians
    bool empty() const { return !(low <= high); }
    double at(double share) const { return low + share * (high - low); }
};

// Leaves the angles by which value + slope * angle is rounded to these floats.
void narrow(Interval& angles, const Float3& rounded_to, const Vector& value, const Vector& slope) {
    const float floats[3] = {rounded_to.x, rounded_to.y, rounded_to.z};
    for (size_t i = 0; i < 3; i++) {
        if (std::abs(slope[i]) < 1e-9) continue;  // says nothing
        const double low = 0.5 * (double(floats[i]) + std::nextafter(floats[i], -INFINITY));
        const double high = 0.5 * (double(floats[i]) + std::nextafter(floats[i], INFINITY));
        const double first = (low - value[i]) / slope[i], last = (high - value[i]) / slope[i];
        angles.low = std::max(angles.low, std::min(first, last));
        angles.high = std::min(angles.high, std::max(first, last));
    }
}

// Searches the numbers from which make_camera comes to a camera again. Its axes are floats, which do not tell exactly where they point; but all of
// them together leave only so much room, and what lies in it is rounded to them.
class CameraSearch {
public:
    CameraSearch(const Camera& camera, uint32_t width, uint32_t height, double distance)
        : camera_(camera), width_(width), height_(height), distance_(distance), upright_(upright_axis(camera)) {
        mirrored_ = dot(cross(vector(camera.forward), vector(camera.up)), vector(camera.right)) < 0;
    }

    CameraText run() const {
        const double half = length(vector(camera_.up)) / length(vector(camera_.forward)) * std::min(width_, height_) / height_;
        const double fov = std::atan(half) / half_degree;
        for (const double angle : {rounded(fov, 5), rounded(fov, 7), rounded(fov, 10)})
            if (const auto found = search(angle)) return *found;
        return text(unit(vector(camera_.forward)), rounded(fov, 10), 12);
    }

private:
    // Turned about the upright axis first, which is all that the right axis depends on, then up or down.
    std::optional<CameraText> search(double fov) const {
        const double half = std::tan(fov * half_degree), shorter = std::min(width_, height_);
        const double across = (mirrored_ ? -1 : 1) * half * width_ / shorter, along = half * height_ / shorter;
        const Vector forward = unit(vector(camera_.forward)), ahead = unit(forward - dot(forward, upright_) * upright_);
        const Vector aside = cross(ahead, upright_);
        Interval turns;
        narrow(turns, camera_.right, across * aside, -across * ahead);
        for (const double share : {0.5, 0.25, 0.75, 0.1, 0.9, 0.4, 0.6}) {
            const double turn = turns.at(share);
            const Vector level = unit(ahead + turn * aside);
            const double elevation = std::asin(std::clamp(dot(forward, upright_), -1.0, 1.0));
            const Vector towards = std::cos(elevation) * level + std::sin(elevation) * upright_;
            const Vector above = std::cos(elevation) * upright_ - std::sin(elevation) * level;
            Interval lifts;
            narrow(lifts, camera_.forward, towards, above);
            narrow(lifts, camera_.up, along * above, -along * towards);
            if (turns.empty() || lifts.empty()) continue;
            for (const double part : {0.5, 0.25, 0.75, 0.1, 0.9})
                for (const int digits : {9, 11, 13, 15, 17})
                    if (const CameraText found = text(unit(towards + lifts.at(part) * above), fov, digits); makes_it(found)) return found;
        }
        return std::nullopt;
    }
    CameraText text(const Vector& forward, double fov, int digits) const {
        CameraText result{camera_.eye, rounded(vector(camera_.eye) + distance_ * forward, digits), rounded(upright_, 9), fov, mirrored_};
        if (camera_.lens_radius > 0) {
            result.lens_radius = camera_.lens_radius;
            // The axes of most cameras are unit vectors but for rounding.
            const double unit_length = length(vector(camera_.forward));
            result.focal_distance =
                std::abs(unit_length - 1) < 1e-6 ? camera_.focal_distance : static_cast<float>(camera_.focal_distance * unit_length);
        }
        return result;
    }
    bool makes_it(const CameraText& found) const {
        const auto made = make_camera(found, width_, height_);
        Camera wanted = camera_;
        if (made && wanted.lens_radius == 0) wanted.focal_distance = made->focal_distance;  // says nothing
        return made && *made == wanted;
    }

    const Camera& camera_;
    const uint32_t width_, height_;
    const double distance_;
    const Vector upright_;
    bool mirrored_ = false;
};

}  // namespace

Result<CameraText> parse_camera(std::string_view text) {
    const auto wrong = [&](std::string_view reason) {
        return Status::usage(
            fmt::format("'{}' {}; give ten numbers: eye x,y,z, target x,y,z, up x,y,z, field of view in degrees; and ,mirrored "
                        "behind them for a picture whose left and right are exchanged; and ,lens,RADIUS,DISTANCE for a lens",
                        text, reason));
    };
    constexpr size_t count = 10;
    constexpr size_t lens_words = 3;
    const auto words = words_between_commas(text, count + 1 + lens_words + 1);
    if (words.size() < count) return wrong("is not a camera");
    std::array<double, count> numbers = {};
    for (size_t i = 0; i < count; ++i) {
        const auto number = camera_number(words[i]);
        if (!number) return wrong("is not a camera");
        numbers[i] = *number;
    }
    const auto& n = numbers;
    CameraText camera{float3({n[0], n[1], n[2]}), {n[3], n[4], n[5]}, {n[6], n[7], n[8]}, n[9]};
    size_t next = count;
    camera.mirrored = next < words.size() && words[next] == "mirrored";
    if (camera.mirrored) next++;
    if (next + lens_words <= words.size() && words[next] == "lens") {
        const auto radius = camera_number(words[next + 1]), distance = camera_number(words[next + 2]);
        if (!radius || !distance || !(static_cast<float>(*radius) > 0) || !(static_cast<float>(*distance) > 0))
            return wrong("has a lens whose radius and distance are not both more than 0");
        camera.lens_radius = static_cast<float>(*radius);
        camera.focal_distance = static_cast<float>(*distance);
        next += lens_words;
    }
    if (next < words.size()) return wrong("is not a camera");
    if (!(camera.fov_degrees > 0 && camera.fov_degrees < 180)) return wrong("has a field of view that is not between 0 and 180 degrees");
    if (!has_direction(camera)) return wrong("has no direction: eye and target are the same, or up lies along the line of sight");
    return camera;
}

std::string format_camera(const CameraText& camera) {
    const auto [eye, target, up, fov, mirrored, radius, distance] = camera;
    return fmt::format("{},{},{},{},{},{},{},{},{},{}{}{}", eye.x, eye.y, eye.z, target[0], target[1], target[2], up[0], up[1], up[2], fov,
                       mirrored ? ",mirrored" : "", radius > 0 ? fmt::format(",lens,{},{}", radius, distance) : "");
}

std::optional<Camera> make_camera(const CameraText& text, uint32_t width, uint32_t height) {
    auto camera = make_exact_camera(text.eye, text.target, text.up, text.fov_degrees, width, height, !text.mirrored);
    if (camera && text.lens_radius > 0) {
        camera->lens_radius = text.lens_radius;
        camera->focal_distance = text.focal_distance;
    }
    return camera;
}

std::optional<CameraText> describe_camera(const Camera& camera, uint32_t width, uint32_t height, double distance) {
    const Vector forward = vector(camera.forward), right = vector(camera.right), up = vector(camera.up);
    const double f = length(forward), r = length(right), u = length(up);
    constexpr double tolerance = 1e-4;
    if (camera.projection != Projection::perspective || !(f > 0 && r > 0 && u > 0) || width == 0 || height == 0) return std::nullopt;
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

std::string camera_string(const Camera& camera, uint32_t width, uint32_t height, const std::array<double, 3>& center) {
    const double distance = dot(center - vector(camera.eye), unit(vector(camera.forward)));
    const auto text = describe_camera(camera, width, height, distance);
    return text ? format_camera(*text) : "";
}

}  // namespace raypager
