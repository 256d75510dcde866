#include "reference/hit_comparison.hpp"

#include <fmt/format.h>

namespace raypager::reference {
namespace {

constexpr size_t max_listed = 40;

Vec3 at(const Ray& ray, double t) { return Vec3(ray.origin) + t * Vec3(ray.direction); }

double distance_to_segment(const Vec3& point, const Vec3& a, const Vec3& b) {
    const Vec3 edge = b - a;
    const double size2 = dot(edge, edge);
    const double s = size2 > 0 ? std::clamp(dot(point - a, edge) / size2, 0.0, 1.0) : 0;
    return length(point - (a + s * edge));
}

double distance_to_triangle(const Vec3& point, const Corners& p) {
    double distance = infinity;
    for (int i = 0; i < 3; i++) distance = std::min(distance, distance_to_segment(point, p[i], p[(i + 1) % 3]));
    const Vec3 normal = cross(p[1] - p[0], p[2] - p[0]);
    bool above_interior = true;
    for (int i = 0; i < 3; i++) above_interior &= dot(cross(p[(i + 1) % 3] - p[i], point - p[i]), normal) >= 0;
    return above_interior ? std::min(distance, std::abs(dot(point - p[0], normal)) / length(normal)) : distance;
}

// Between the points a + s (b - a), 0 <= s <= 1, and those of the ray, 0 <= t <= tmax (Ericson, Real-Time Collision Detection, 5.1.9).
double distance_to_segment(const Ray& ray, const Vec3& a, const Vec3& b) {
    const Vec3 o(ray.origin), d(ray.direction), edge = b - a, r = o - a;
    const double dd = dot(d, d), ee = dot(edge, edge), de = dot(d, edge), dr = dot(d, r), er = dot(edge, r);
    const double tmax{ray.tmax}, denominator = dd * ee - de * de;
    double t = denominator > 0 ? std::clamp((de * er - dr * ee) / denominator, 0.0, tmax) : 0;
    const double s = ee > 0 ? std::clamp((de * t + er) / ee, 0.0, 1.0) : 0;
    t = std::clamp((de * s - dr) / dd, 0.0, tmax);
    return length(o + t * d - (a + s * edge));
}

std::string describe(const Ray& ray) {
    return fmt::format("origin ({:.9g}, {:.9g}, {:.9g}) direction ({:.9g}, {:.9g}, {:.9g}) tmax {:.9g}", ray.origin.x, ray.origin.y, ray.origin.z,
                       ray.direction.x, ray.direction.y, ray.direction.z, ray.tmax);
}

std::string describe(const Hit& hit) { return hit.found() ? fmt::format("primitive {} at t = {:.9g}", hit.primitive, hit.t) : "no hit"; }

}  // namespace

const char* name(Agreement agreement) {
    constexpr const char* names[] = {"same", "tie", "rounding", "flat", "wrong"};
    return names[static_cast<size_t>(agreement)];
}

double distance_to_primitive(const ReferenceGeometry& geometry, uint32_t primitive, const Vec3& point) {
    if (!geometry.is_sphere(primitive)) return distance_to_triangle(point, geometry.corners(primitive));
    const WorldSphere& sphere = geometry.sphere(primitive);
    return std::abs(length(point - Vec3(sphere.center)) - double{sphere.radius});
}

double distance_to_primitive(const ReferenceGeometry& geometry, uint32_t primitive, const Ray& ray) {
    if (geometry.intersect(primitive, ray).found()) return 0;
    double distance = distance_to_primitive(geometry, primitive, Vec3(ray.origin));
    if (std::isfinite(ray.tmax)) distance = std::min(distance, distance_to_primitive(geometry, primitive, at(ray, double{ray.tmax})));
    if (geometry.is_sphere(primitive)) {
        const WorldSphere& sphere = geometry.sphere(primitive);
        const Vec3 center(sphere.center);
        return std::min(distance, std::abs(distance_to_segment(ray, center, center) - double{sphere.radius}));
    }
    const Corners p = geometry.corners(primitive);
    for (int i = 0; i < 3; i++) distance = std::min(distance, distance_to_segment(ray, p[i], p[(i + 1) % 3]));
    return distance;
}

HitAudit::HitAudit(const ReferenceGeometry& geometry, double tolerance) : geometry_(geometry), tolerance_(tolerance) {
    balls_.resize(geometry.primitive_count());
    for (uint32_t id = 0; id < geometry.primitive_count(); id++) {
        if (geometry.is_degenerate(id)) continue;
        if (geometry.is_sphere(id)) {
            balls_[id] = {Vec3(geometry.sphere(id).center), double{geometry.sphere(id).radius}};
            continue;
        }
        const Corners p = geometry.corners(id);
        const Vec3 center = (p[0] + p[1] + p[2]) / 3;
        balls_[id] = {center, std::max({length(p[0] - center), length(p[1] - center), length(p[2] - center)})};
    }
}

Agreement HitAudit::closest(const Ray& ray, const Hit& expected, const Hit& claimed) {
    if (!expected.found() && !claimed.found()) return count_as(Agreement::same);
    if (agrees(ray, expected, claimed)) return count_as(expected.primitive == claimed.primitive ? Agreement::same : Agreement::tie);
    const std::vector<uint32_t> close = near(ray);
    const Hit exact = exact_closest(ray, close);
    const Agreement agreement = judge_closest(ray, close, exact, claimed);
    if (agreement == Agreement::same || agreement == Agreement::tie) return count_as(agreement);
    return note(agreement, ray, fmt::format("exact: {}, claimed: {}", describe(exact), describe(claimed)));
}

Agreement HitAudit::occluded(const Ray& ray, bool expected, bool claimed) {
    if (expected == claimed) return count_as(Agreement::same);
    const std::vector<uint32_t> close = near(ray);
    const Hit exact = exact_closest(ray, close);
    if (exact.found() == claimed) return count_as(Agreement::same);
    return note(judge_occluded(ray, close, exact, claimed), ray, claimed ? "exact: free, claimed: occluded" : "exact: occluded, claimed: free");
}

// All primitives that the ray, or one moved by the tolerance, may hit: a coarse test of all of them.
std::vector<uint32_t> HitAudit::near(const Ray& ray) const {
    const Vec3 origin(ray.origin), direction = normalized(Vec3(ray.direction));
    const double scale = std::max({max_magnitude(origin), max_magnitude(geometry_.lower()), max_magnitude(geometry_.upper())});
    std::vector<uint32_t> found;
    for (uint32_t id = 0; id < balls_.size(); id++) {
        const Vec3 off_axis = cross(balls_[id].center - origin, direction);
        const double reach = balls_[id].radius + 4 * tolerance_ * scale;
        if (balls_[id].radius >= 0 && dot(off_axis, off_axis) <= reach * reach) found.push_back(id);
    }
    return found;
}

Hit HitAudit::exact_closest(const Ray& ray, const std::vector<uint32_t>& near) const {
    Hit best;
    for (const uint32_t id : near) {
        const Hit hit = geometry_.intersect(id, ray);
        if (hit.t < best.t) best = hit;
    }
    return best;
}

// At the same distance, as well as float can tell it, and where the claimed primitive is.
bool HitAudit::agrees(const Ray& ray, const Hit& exact, const Hit& claimed) const {
    if (!exact.found() || !claimed.found() || !lies_on_primitive(ray, claimed)) return false;
    const double along_normal = std::abs(dot(exact.normal, Vec3(ray.direction)));
    return std::abs(claimed.t - exact.t) * along_normal <= margin(ray, exact.primitive);
}

Agreement HitAudit::judge_closest(const Ray& ray, const std::vector<uint32_t>& near, const Hit& exact, const Hit& claimed) const {
    if (!exact.found() && !claimed.found()) return Agreement::same;
    if (agrees(ray, exact, claimed)) return exact.primitive == claimed.primitive ? Agreement::same : Agreement::tie;
    Agreement excuse = Agreement::rounding;
    if (claimed.found() && !lies_on_primitive(ray, claimed)) {
        if (!meets_flatly(ray, claimed)) return Agreement::wrong;
        excuse = Agreement::flat;
    }
    if (exact.t >= claimed.t || exact.primitive == claimed.primitive) return excuse;
    const double beyond = (exact.t + claimed.t) / 2;
    return passes_when_moved(ray, near, margin(ray, exact.primitive), beyond) ? excuse : Agreement::wrong;
}

// REQUIRES: exact and claim differ.
Agreement HitAudit::judge_occluded(const Ray& ray, const std::vector<uint32_t>& near, const Hit& exact, bool claimed) const {
    if (!claimed) {
        const bool passes = passes_when_moved(ray, near, margin(ray, exact.primitive), double{ray.tmax});
        return passes ? Agreement::rounding : Agreement::wrong;
    }
    for (const uint32_t id : near) {
        if (distance_to_primitive(geometry_, id, ray) <= margin(ray, id)) return Agreement::rounding;
    }
    return Agreement::wrong;
}

// How far rounding may move things when the primitive is tested, in world units.
double HitAudit::margin(const Ray& ray, uint32_t primitive) const {
    double scale = max_magnitude(Vec3(ray.origin));
    if (geometry_.is_sphere(primitive)) {
        const WorldSphere& sphere = geometry_.sphere(primitive);
        scale = std::max(scale, max_magnitude(Vec3(sphere.center)) + double{sphere.radius});
    } else {
        for (const Vec3& corner : geometry_.corners(primitive)) scale = std::max(scale, max_magnitude(corner));
    }
    return tolerance_ * scale;
}

bool HitAudit::lies_on_primitive(const Ray& ray, const Hit& hit) const {
    if (!(hit.t > 0 && hit.t <= double{ray.tmax}) || geometry_.is_degenerate(hit.primitive)) return false;
    return distance_to_primitive(geometry_, hit.primitive, at(ray, hit.t)) <= margin(ray, hit.primitive);
}

// Whether the ray passes within the margin of the triangle, and the claimed point lies in its plane, as well as float can know that
// plane: moving the corners by the margin turns it the more the narrower the triangle is. Along the ray, the point may be far off.
bool HitAudit::meets_flatly(const Ray& ray, const Hit& hit) const {
    if (!(hit.t > 0 && hit.t <= double{ray.tmax}) || geometry_.is_sphere(hit.primitive) || geometry_.is_degenerate(hit.primitive)) return false;
    const Corners p = geometry_.corners(hit.primitive);
    const Vec3 normal = cross(p[1] - p[0], p[2] - p[0]);
    double longest = 0;
    for (int i = 0; i < 3; i++) longest = std::max(longest, length(p[(i + 1) % 3] - p[i]));
    const double width = length(normal) / longest, allowed = margin(ray, hit.primitive);
    const double from_plane = std::abs(dot(at(ray, hit.t) - p[0], normal)) / length(normal);
    return from_plane <= allowed * (1 + longest / width) && distance_to_primitive(geometry_, hit.primitive, ray) <= allowed;
}

// Whether a ray moved by at most margin meets nothing before t = beyond.
bool HitAudit::passes_when_moved(const Ray& ray, const std::vector<uint32_t>& near, double margin, double beyond) const {
    const double speed = length(Vec3(ray.direction));
    const Frame frame(Vec3(ray.direction) / speed);
    constexpr int angles = 16;
    for (const double radius : {1.0, 0.5, 0.0}) {
        for (int i = 0; i < (radius > 0 ? angles : 1); i++) {
            for (const double along : {0.0, 1.0, -1.0}) {
                const double angle = 2 * pi * i / angles;
                const Vec3 shift = margin * (radius * (std::cos(angle) * frame.x + std::sin(angle) * frame.y) + along * frame.z);
                Ray moved = ray;
                moved.origin = (Vec3(ray.origin) + shift).to_float();
                const Hit hit = exact_closest(moved, near);
                // The end of the ray moves with its origin.
                if (!hit.found() || hit.t + std::abs(along) * margin / speed > beyond) return true;
            }
        }
    }
    return false;
}

Agreement HitAudit::count_as(Agreement agreement) {
    counts_[static_cast<size_t>(agreement)]++;
    return agreement;
}

Agreement HitAudit::note(Agreement agreement, const Ray& ray, const std::string& what) {
    std::vector<std::string>& list = agreement == Agreement::wrong ? wrong_ : excused_;
    if (list.size() < max_listed) list.push_back(fmt::format("{}: {}; {}", name(agreement), describe(ray), what));
    return count_as(agreement);
}

std::string HitAudit::report() const {
    std::string text;
    for (const Agreement agreement : all_agreements) text += fmt::format("{} {}  ", count(agreement), name(agreement));
    for (const std::string& line : wrong_) text += "\n  " + line;
    for (const std::string& line : excused_) text += "\n  " + line;
    return text;
}

}  // namespace raypager::reference
