#include "import/loop_subdivision.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_map>

#include "scene/vector.hpp"

namespace raypager {
namespace {

constexpr uint32_t nothing = UINT32_MAX;

struct LoopMesh {
    std::vector<Vector> positions;
    std::vector<Float2> uvs;  // or none
    std::vector<Triangle> triangles;
};

// The neighbours of a vertex in the order of the triangles around it; of one on the border from end to end.
struct Ring {
    enum class Kind { inside, border, fixed };
    Kind kind = Kind::fixed;
    std::vector<uint32_t> vertices;
};

uint64_t edge_key(uint32_t a, uint32_t b) { return uint64_t{std::min(a, b)} << 32 | std::max(a, b); }

// What lies around the edges and vertices of a mesh.
class Neighbourhood {
public:
    explicit Neighbourhood(const LoopMesh& mesh) : mesh_(mesh), first_(mesh.positions.size() + 1) {
        for (const Triangle& t : mesh.triangles)
            for (const uint32_t v : t) first_[v + 1]++;
        for (size_t v = 0; v + 1 < first_.size(); ++v) first_[v + 1] += first_[v];
        around_.resize(first_.back());
        std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
        for (uint32_t t = 0; t < mesh.triangles.size(); ++t)
            for (const uint32_t v : mesh.triangles[t]) around_[next[v]++] = t;
        edges_.reserve(mesh.triangles.size() * 2);
        for (const Triangle& t : mesh.triangles)
            for (size_t k = 0; k < 3; ++k) {
                Edge& edge = edges_[edge_key(t[k], t[(k + 1) % 3])];
                if (edge.triangles < 2) edge.opposite[edge.triangles] = t[(k + 2) % 3];
                edge.triangles++;
            }
    }

    struct Edge {
        uint32_t triangles = 0;
        uint32_t opposite[2] = {nothing, nothing};
        uint32_t middle = nothing;  // the vertex that it gets
    };
    std::unordered_map<uint64_t, Edge>& edges() { return edges_; }

    Ring ring(uint32_t v) const {
        Ring ring;
        const size_t count = first_[v + 1] - first_[v];
        if (count == 0) return ring;
        // From neighbour to neighbour, by the triangles between them. A border begins where nothing leads to.
        std::vector<std::pair<uint32_t, uint32_t>> steps;
        for (uint32_t i = first_[v]; i < first_[v + 1]; ++i) {
            const Triangle& t = mesh_.triangles[around_[i]];
            const size_t at = t[0] == v ? 0 : t[1] == v ? 1 : 2;
            steps.emplace_back(t[(at + 1) % 3], t[(at + 2) % 3]);
        }
        std::sort(steps.begin(), steps.end());
        const auto is_led_to = [&](uint32_t n) { return std::any_of(steps.begin(), steps.end(), [&](const auto& s) { return s.second == n; }); };
        uint32_t begin = steps[0].first;
        bool border = false;
        if (count <= most_looked_through)
            for (const auto& step : steps)
                if (!is_led_to(step.first)) {
                    begin = step.first;
                    border = true;
                    break;
                }
        uint32_t n = begin;
        for (size_t i = 0; i < count; ++i) {
            ring.vertices.push_back(n);
            const auto step = std::lower_bound(steps.begin(), steps.end(), std::pair(n, 0u));
            if (step == steps.end() || step->first != n || (step + 1 != steps.end() && (step + 1)->first == n)) return ring;
            n = step->second;
        }
        if (border) ring.vertices.push_back(n);
        if (border == (n == begin)) return ring;
        std::vector<uint32_t> sorted = ring.vertices;
        std::sort(sorted.begin(), sorted.end());
        if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) return ring;  // several fans
        ring.kind = border ? Ring::Kind::border : Ring::Kind::inside;
        return ring;
    }

    // Of the triangles at a vertex, by area.
    Vector face_normal(uint32_t v) const {
        Vector sum = {0, 0, 0};
        for (uint32_t i = first_[v]; i < first_[v + 1]; ++i) {
            const Triangle& t = mesh_.triangles[around_[i]];
            sum = sum + cross(mesh_.positions[t[1]] - mesh_.positions[t[0]], mesh_.positions[t[2]] - mesh_.positions[t[0]]);
        }
        return sum;
    }

private:
    static constexpr size_t most_looked_through = 4096;  // vertices with more triangles than that are not looked at for a border
    const LoopMesh& mesh_;
    std::vector<uint32_t> first_, around_;  // triangles of each vertex
    std::unordered_map<uint64_t, Edge> edges_;
};

double beta(size_t valence) { return valence == 3 ? 3.0 / 16 : 3.0 / (8.0 * double(valence)); }

// A vertex between its neighbours: each of them counts by `weight`.
Vector mixed(const LoopMesh& mesh, uint32_t v, const Ring& ring, double inside_weight, double border_weight) {
    const Vector& p = mesh.positions[v];
    if (ring.kind == Ring::Kind::fixed) return p;
    Vector sum = {0, 0, 0};
    if (ring.kind == Ring::Kind::border)
        return (1 - 2 * border_weight) * p + border_weight * (mesh.positions[ring.vertices.front()] + mesh.positions[ring.vertices.back()]);
    for (const uint32_t n : ring.vertices) sum = sum + mesh.positions[n];
    return (1 - double(ring.vertices.size()) * inside_weight) * p + inside_weight * sum;
}

LoopMesh subdivided(const LoopMesh& mesh) {
    Neighbourhood around(mesh);
    LoopMesh result;
    result.uvs = mesh.uvs;
    for (uint32_t v = 0; v < mesh.positions.size(); ++v) {
        const Ring ring = around.ring(v);
        result.positions.push_back(mixed(mesh, v, ring, beta(ring.vertices.size()), 1.0 / 8));
    }
    const auto middle_of = [&](uint32_t a, uint32_t b) {
        Neighbourhood::Edge& edge = around.edges()[edge_key(a, b)];
        if (edge.middle != nothing) return edge.middle;
        edge.middle = static_cast<uint32_t>(result.positions.size());
        const Vector ends = mesh.positions[a] + mesh.positions[b];
        result.positions.push_back(
            edge.triangles == 2 ? 3.0 / 8 * ends + 1.0 / 8 * (mesh.positions[edge.opposite[0]] + mesh.positions[edge.opposite[1]]) : 0.5 * ends);
        if (!mesh.uvs.empty()) result.uvs.push_back({(mesh.uvs[a].x + mesh.uvs[b].x) / 2, (mesh.uvs[a].y + mesh.uvs[b].y) / 2});
        return edge.middle;
    };
    for (const Triangle& t : mesh.triangles) {
        const uint32_t a = middle_of(t[0], t[1]), b = middle_of(t[1], t[2]), c = middle_of(t[2], t[0]);
        for (const Triangle& part : {Triangle{t[0], a, c}, Triangle{a, t[1], b}, Triangle{c, b, t[2]}, Triangle{a, b, c}})
            result.triangles.push_back(part);
    }
    return result;
}

// Tangents across and along the border, as in pbrt (its section on subdivision surfaces; after Hoppe et al. 1994).
Vector border_normal(const LoopMesh& mesh, uint32_t v, const std::vector<uint32_t>& ring) {
    const auto p = [&](size_t i) { return mesh.positions[ring[i]]; };
    const size_t n = ring.size();
    const Vector along = p(n - 1) - p(0);
    Vector across;
    if (n == 2) {
        across = p(0) + p(1) - 2 * mesh.positions[v];
    } else if (n == 3) {
        across = p(1) - mesh.positions[v];
    } else if (n == 4) {
        across = 2 * p(1) + 2 * p(2) - p(0) - p(3) - 2 * mesh.positions[v];
    } else {
        const double theta = std::numbers::pi / double(n - 1);
        across = std::sin(theta) * (p(0) + p(n - 1));
        for (size_t k = 1; k + 1 < n; ++k) across = across + (2 * std::cos(theta) - 2) * std::sin(double(k) * theta) * p(k);
        across = -1 * across;
    }
    return cross(along, across);
}

Vector inside_normal(const LoopMesh& mesh, const std::vector<uint32_t>& ring) {
    Vector s = {0, 0, 0}, t = {0, 0, 0};
    for (size_t i = 0; i < ring.size(); ++i) {
        const double angle = 2 * std::numbers::pi * double(i) / double(ring.size());
        s = s + std::cos(angle) * mesh.positions[ring[i]];
        t = t + std::sin(angle) * mesh.positions[ring[i]];
    }
    return cross(s, t);
}

Vector limit_normal(const LoopMesh& mesh, uint32_t v, const Ring& ring, const Neighbourhood& around) {
    const Vector faces = around.face_normal(v);
    Vector normal = ring.kind == Ring::Kind::inside   ? inside_normal(mesh, ring.vertices)
                    : ring.kind == Ring::Kind::border ? border_normal(mesh, v, ring.vertices)
                                                      : faces;
    if (!(length(normal) > 0) || !std::isfinite(length(normal))) normal = faces;
    if (!(length(normal) > 0) || !std::isfinite(length(normal))) return {0, 0, 1};
    return unit(dot(normal, faces) < 0 ? -1 * normal : normal);
}

}  // namespace

TriangleMesh subdivide_loop(const std::vector<Float3>& positions, const std::vector<Float2>& uvs, const std::vector<Triangle>& triangles,
                            uint32_t levels) {
    LoopMesh mesh;
    mesh.uvs = uvs;
    for (const Float3& p : positions) mesh.positions.push_back(finite(p) ? vector(p) : Vector{0, 0, 0});
    for (const Triangle& t : triangles) {
        const bool sound = std::all_of(t.begin(), t.end(), [&](uint32_t v) { return v < positions.size() && finite(positions[v]); });
        if (sound && t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh.triangles.push_back(t);
    }
    for (uint32_t i = 0; i < levels; ++i) mesh = subdivided(mesh);
    // Of a border, which is a cubic B-spline, a sixth of each neighbour; pbrt takes a fifth, which is off by less than its triangles are.
    const Neighbourhood around(mesh);
    std::vector<Ring> rings;
    LoopMesh limit;
    for (uint32_t v = 0; v < mesh.positions.size(); ++v) {
        rings.push_back(around.ring(v));
        const double valence = double(std::max<size_t>(rings.back().vertices.size(), 1));
        limit.positions.push_back(mixed(mesh, v, rings.back(), 1 / (valence + 3 / (8 * beta(size_t(valence)))), 1.0 / 6));
    }
    mesh.positions = std::move(limit.positions);
    TriangleMesh result;
    for (uint32_t v = 0; v < mesh.positions.size(); ++v) {
        result.positions.push_back(float3(mesh.positions[v]));
        result.normals.push_back(float3(limit_normal(mesh, v, rings[v], around)));
    }
    result.triangles = std::move(mesh.triangles);
    result.uvs = std::move(mesh.uvs);
    return result;
}

}  // namespace raypager
