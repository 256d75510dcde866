#include "import/polygons.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "base/parallel.hpp"
#include "import/index_table.hpp"
#include "import/polygon_glu.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

using Outline = std::vector<std::array<double, 2>>;

// As seen from where it goes counter-clockwise. Empty if it has no area.
Outline project(const std::vector<Vector>& corners) {
    Vector normal = {0, 0, 0};  // by Newell's method: also of a polygon that is not quite plane
    for (size_t i = 1; i + 1 < corners.size(); ++i) normal = normal + cross(corners[i] - corners[0], corners[i + 1] - corners[0]);
    const double size = length(normal);
    if (!(size > 0) || !std::isfinite(size)) return {};
    normal = (1 / size) * normal;
    const size_t least = static_cast<size_t>(
        std::min_element(normal.begin(), normal.end(), [](double a, double b) { return std::abs(a) < std::abs(b); }) - normal.begin());
    Vector axis = {0, 0, 0};
    axis[least] = 1;
    const Vector x = unit(cross(axis, normal)), y = cross(normal, x);
    Outline outline(corners.size());
    for (size_t i = 0; i < corners.size(); ++i) outline[i] = {dot(corners[i] - corners[0], x), dot(corners[i] - corners[0], y)};
    return outline;
}

// It turns left at every corner, but for what rounding of the coordinates may do, and goes around once.
bool is_convex(const Outline& outline) {
    const size_t n = outline.size();
    int turns = 0, last = 0, first = 0;  // how often it changes between going up and down
    for (size_t i = 0; i < n; ++i) {
        const auto &a = outline[i], &b = outline[(i + 1) % n], &c = outline[(i + 2) % n];
        const double ux = b[0] - a[0], uy = b[1] - a[1], vx = c[0] - b[0], vy = c[1] - b[1];
        const double turn = ux * vy - uy * vx;
        if (turn < -1e-6 * std::sqrt((ux * ux + uy * uy) * (vx * vx + vy * vy))) return false;
        const int direction = uy > 0 ? 1 : uy < 0 ? -1 : last;
        turns += last != 0 && direction != last;
        last = direction;
        if (first == 0) first = direction;
    }
    return turns + (first != last) <= 2;
}

double turn_at(const std::array<double, 2>& a, const std::array<double, 2>& b, const std::array<double, 2>& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// Whether two edges cross other than by touching. What does so often would make the tessellator take memory without bound, and so edges are compared
// here first, in time that has a bound: where that is passed, the outline is so intricate that it counts as crossing itself.
bool crosses_itself(const Outline& outline) {
    struct Edge {
        std::array<double, 2> a, b;
        double left() const { return std::min(a[0], b[0]); }
        double right() const { return std::max(a[0], b[0]); }
    };
    const size_t n = outline.size();
    std::vector<Edge> edges(n);
    for (size_t i = 0; i < n; ++i) edges[i] = {outline[i], outline[(i + 1) % n]};
    std::sort(edges.begin(), edges.end(), [](const Edge& e, const Edge& f) { return e.left() < f.left(); });
    std::vector<Edge> active;  // those that reach as far right as where we are
    uint64_t left = std::min<uint64_t>(1000 * n, uint64_t{1} << 30) + (uint64_t{1} << 20);
    const auto differ = [](double x, double y) { return (x < 0 && y > 0) || (x > 0 && y < 0); };
    for (const Edge& e : edges) {
        if (active.size() >= left) return true;
        left -= active.size();
        std::erase_if(active, [&](const Edge& f) { return f.right() < e.left(); });
        for (const Edge& f : active)
            if (differ(turn_at(e.a, e.b, f.a), turn_at(e.a, e.b, f.b)) && differ(turn_at(f.a, f.b, e.a), turn_at(f.a, f.b, e.b))) return true;
        active.push_back(e);
    }
    return false;
}

}  // namespace

void PolygonBuilder::add(std::span<const uint32_t> corners, std::span<const uint32_t> attributes) {
    if (corners.size() < 3) {
        ++issues_.few_corners;
        return;
    }
    const size_t first = mesh_.triangles.size();
    for (size_t i = 2; i < corners.size(); ++i) mesh_.triangles.push_back({corners[0], corners[i - 1], corners[i]});
    if (!attributes.empty() || !attributes_.empty()) {
        attributes_.resize(first, {RP_NONE, RP_NONE, RP_NONE});
        for (size_t i = 2; i < corners.size() && !attributes.empty(); ++i) attributes_.push_back({attributes[0], attributes[i - 1], attributes[i]});
        attributes_.resize(mesh_.triangles.size(), {RP_NONE, RP_NONE, RP_NONE});
    }
    if (corners.size() > 3 && mesh_.triangles.size() <= UINT32_MAX)
        polygons_.push_back({static_cast<uint32_t>(first), static_cast<uint32_t>(corners.size())});
}

std::vector<uint32_t> PolygonBuilder::corners_of(const Polygon& polygon, const std::vector<Triangle>& triangles) {
    std::vector<uint32_t> corners;
    corners.reserve(polygon.corners);
    corners = {triangles[polygon.first][0], triangles[polygon.first][1]};
    for (size_t i = 0; i + 2 < polygon.corners; ++i) corners.push_back(triangles[polygon.first + i][2]);
    return corners;
}

std::vector<uint32_t> PolygonBuilder::vertices_to_cut() const {
    std::vector<uint32_t> vertices;
    for (const Polygon& polygon : polygons_) {
        const auto corners = corners_of(polygon, mesh_.triangles);
        vertices.insert(vertices.end(), corners.begin(), corners.end());
    }
    return vertices;
}

bool PolygonBuilder::cut(const Polygon& polygon, const PositionOf& position) {
    const size_t count = polygon.corners - 2;
    const std::vector<uint32_t> vertices = corners_of(polygon, mesh_.triangles);
    std::vector<Vector> places(vertices.size());
    for (size_t i = 0; i < vertices.size(); ++i)
        if (!position(vertices[i], places[i])) return true;  // its triangles are dropped
    const Outline whole = project(places);
    if (whole.empty()) {
        // Without area on the whole: either each of its triangles is, or it crosses itself.
        for (size_t i = 2; i < places.size(); ++i)
            if (length(cross(places[i - 1] - places[0], places[i] - places[0])) > 0) return false;
        return true;
    }
    if (is_convex(whole)) return true;
    // A corner that is there twice in a row is one.
    Outline outline;
    std::vector<uint32_t> numbers;
    for (size_t i = 0; i < whole.size(); ++i) {
        if (places[i] == places[(i + 1) % places.size()]) continue;
        outline.push_back(whole[i]);
        numbers.push_back(static_cast<uint32_t>(i));
    }
    std::vector<Triangle> triangles;
    if (outline.size() < 3 || crosses_itself(outline) || !cut_polygon(outline, triangles)) return false;
    const auto put = [&](std::vector<Triangle>& into) {
        const std::vector<uint32_t> corners = corners_of(polygon, into);
        for (size_t i = 0; i < count; ++i) {
            Triangle& t = into[polygon.first + i];
            if (i >= triangles.size())  // for corners that were left out: dropped later
                t = {corners[0], corners[0], corners[0]};
            else
                for (size_t k = 0; k < 3; ++k) t[k] = corners[numbers[triangles[i][k]]];
        }
    };
    if (!attributes_.empty()) put(attributes_);
    put(mesh_.triangles);
    return true;
}

void PolygonBuilder::cut_concave(const PositionOf& position) {
    std::atomic<uint64_t> crossed{0};
    attributes_.resize(attributes_.empty() ? 0 : mesh_.triangles.size(), {RP_NONE, RP_NONE, RP_NONE});
    parallel_for(polygons_.size(), 4096, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) crossed += !cut(polygons_[i], position);
    });
    issues_.crossed += crossed;
    polygons_.clear();
}

void PolygonBuilder::cut_concave() {
    cut_concave([this](uint32_t vertex, std::array<double, 3>& position) {
        if (vertex >= mesh_.positions.size()) return false;
        position = vector(mesh_.positions[vertex]);
        return std::isfinite(position[0]) && std::isfinite(position[1]) && std::isfinite(position[2]);
    });
}

SplitVertices split_vertices(std::vector<Triangle>& triangles, const std::vector<Triangle>& attributes, size_t vertices) {
    SplitVertices split;
    split.attribute.assign(vertices, RP_NONE);
    IndexTable copies;
    const auto hash = [](uint32_t vertex, uint32_t attribute) { return uint64_t{vertex} << 32 | attribute; };
    const auto copy_with = [&](uint32_t vertex, uint32_t attribute) {
        const auto next = static_cast<uint32_t>(split.attribute.size());
        const uint32_t copy = copies.find_or_add(
            hash(vertex, attribute), next, [&](uint32_t i) { return hash(split.source[i - vertices], split.attribute[i]); },
            [&](uint32_t i) { return split.source[i - vertices] == vertex && split.attribute[i] == attribute; });
        if (copy == next) {
            split.attribute.push_back(attribute);
            split.source.push_back(vertex);
        }
        return copy;
    };
    for (size_t i = 0; i < std::min(triangles.size(), attributes.size()); ++i)
        for (size_t k = 0; k < 3; ++k) {
            uint32_t& vertex = triangles[i][k];
            const uint32_t attribute = attributes[i][k];
            if (vertex >= vertices || attribute == RP_NONE) continue;
            uint32_t& present = split.attribute[vertex];
            if (present == RP_NONE) present = attribute;
            if (present != attribute) vertex = copy_with(vertex, attribute);
        }
    return split;
}

}  // namespace raypager
