#include "scene/clean_mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace raypager {
namespace {

bool finite(const Float3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

// Differences of floats are exact in double unless their exponents lie 29 or more apart, and products of differences of 26 bits are as
// well: what comes out as zero has no area, or so little that it vanishes beside the coordinates' last bits.
bool has_area(const Float3& a, const Float3& b, const Float3& c) {
    const double ux = double{b.x} - a.x, uy = double{b.y} - a.y, uz = double{b.z} - a.z;
    const double vx = double{c.x} - a.x, vy = double{c.y} - a.y, vz = double{c.z} - a.z;
    return uy * vz != uz * vy || uz * vx != ux * vz || ux * vy != uy * vx;
}

void drop_unhittable(TriangleMesh& mesh, MeshIssues& issues) {
    const std::vector<Float3>& p = mesh.positions;
    const auto useless = [&](const Triangle& t) {
        if (t[0] >= p.size() || t[1] >= p.size() || t[2] >= p.size()) return ++issues.bad_index, true;
        if (!finite(p[t[0]]) || !finite(p[t[1]]) || !finite(p[t[2]])) return ++issues.not_finite, true;
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0] || !has_area(p[t[0]], p[t[1]], p[t[2]])) return ++issues.degenerate, true;
        return false;
    };
    mesh.triangles.erase(std::remove_if(mesh.triangles.begin(), mesh.triangles.end(), useless), mesh.triangles.end());
}

// Items filed under their smallest vertex: bucket v holds items[first[v]] .. items[first[v + 1] - 1]. Buckets hold a handful each, so
// sorting inside them is linear over all, unlike one big sort or a hash map of every edge.
template <class Item>
struct Buckets {
    std::vector<size_t> first;
    std::vector<Item> items;
};

// each_item(emit) calls emit(vertex, item) for every item, in the same order each time.
template <class Item, class EachItem>
Buckets<Item> file_by_vertex(size_t vertices, const EachItem& each_item) {
    Buckets<Item> result;
    result.first.assign(vertices + 2, 0);
    each_item([&](uint32_t vertex, const Item&) { ++result.first[vertex + 2]; });
    for (size_t v = 2; v < result.first.size(); ++v) result.first[v] += result.first[v - 1];
    result.items.resize(result.first.back());
    // first[v + 1] runs from the start of bucket v to its end, where bucket v + 1 starts.
    each_item([&](uint32_t vertex, const Item& item) { result.items[result.first[vertex + 1]++] = item; });
    result.first.pop_back();
    return result;
}

// Calls run(length) for every run of equal items in a bucket.
template <class Item, class Run>
void for_each_run(Buckets<Item>& buckets, const Run& run) {
    for (size_t v = 0; v + 1 < buckets.first.size(); ++v) {
        const auto end = buckets.items.begin() + static_cast<ptrdiff_t>(buckets.first[v + 1]);
        auto begin = buckets.items.begin() + static_cast<ptrdiff_t>(buckets.first[v]);
        std::sort(begin, end);
        while (begin != end) {
            const auto next = std::find_if(begin, end, [&](const Item& item) { return item != *begin; });
            run(static_cast<uint64_t>(next - begin));
            begin = next;
        }
    }
}

uint64_t count_duplicates(const TriangleMesh& mesh) {
    auto buckets = file_by_vertex<std::array<uint32_t, 2>>(mesh.positions.size(), [&](const auto& emit) {
        for (Triangle t : mesh.triangles) {
            std::sort(t.begin(), t.end());
            emit(t[0], std::array<uint32_t, 2>{t[1], t[2]});
        }
    });
    uint64_t duplicates = 0;
    for_each_run(buckets, [&](uint64_t length) { duplicates += length - 1; });
    return duplicates;
}

uint64_t count_non_manifold_edges(const TriangleMesh& mesh) {
    auto buckets = file_by_vertex<uint32_t>(mesh.positions.size(), [&](const auto& emit) {
        for (const Triangle& t : mesh.triangles)
            for (size_t k = 0; k < 3; ++k) {
                const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
                emit(low, high);
            }
    });
    uint64_t edges = 0;
    for_each_run(buckets, [&](uint64_t length) { edges += length > 2; });
    return edges;
}

}  // namespace

void clean_mesh(TriangleMesh& mesh, MeshIssues& issues) {
    if (mesh.normals.size() != mesh.positions.size()) mesh.normals.clear();
    for (Float3& n : mesh.normals)
        if (!finite(n)) n = {};
    drop_unhittable(mesh, issues);
    issues.duplicate += count_duplicates(mesh);
    issues.non_manifold_edges += count_non_manifold_edges(mesh);
}

}  // namespace raypager
