#include "scene/clean_mesh.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "base/huge_pages.hpp"
#include "base/parallel.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

// Differences of floats are exact in double unless their exponents lie 29 or more apart, and products of differences of 26 bits are as
// well: what comes out as zero has no area, or so little that it vanishes beside the coordinates' last bits.
bool has_area(const Float3& a, const Float3& b, const Float3& c) {
    const double ux = double{b.x} - a.x, uy = double{b.y} - a.y, uz = double{b.z} - a.z;
    const double vx = double{c.x} - a.x, vy = double{c.y} - a.y, vz = double{c.z} - a.z;
    return uy * vz != uz * vy || uz * vx != ux * vz || ux * vy != uy * vx;
}

constexpr size_t piece = size_t{1} << 16;

// Triangles that follow each other, and the range of their vertices but for the largest of each.
struct Piece {
    size_t begin = 0, end = 0;
    uint32_t least = UINT32_MAX, most = 0;
    MeshIssues issues;

    void cover(const Triangle& t) {
        least = std::min({least, t[0], t[1], t[2]});
        most = std::max(most, std::max(std::min(t[0], t[1]), std::min(std::max(t[0], t[1]), t[2])));
    }
};

std::vector<Piece> drop_unhittable(TriangleMesh& mesh, MeshIssues& issues) {
    const std::vector<Float3>& p = mesh.positions;
    std::vector<Piece> pieces((mesh.triangles.size() + piece - 1) / piece);
    parallel_for(mesh.triangles.size(), piece, [&](size_t begin, size_t end) {
        Piece result;
        result.begin = result.end = begin;
        const auto useless = [&](const Triangle& t) {
            if (t[0] >= p.size() || t[1] >= p.size() || t[2] >= p.size()) return ++result.issues.bad_index, true;
            if (!finite(p[t[0]]) || !finite(p[t[1]]) || !finite(p[t[2]])) return ++result.issues.not_finite, true;
            if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0] || !has_area(p[t[0]], p[t[1]], p[t[2]])) return ++result.issues.degenerate, true;
            return false;
        };
        for (size_t i = begin; i < end; i++) {
            const Triangle t = mesh.triangles[i];
            if (useless(t)) continue;
            result.cover(t);
            mesh.triangles[result.end++] = t;
        }
        pieces[begin / piece] = result;
    });
    size_t place = 0;
    for (Piece& kept : pieces) {
        const auto begin = mesh.triangles.begin();
        if (place != kept.begin)
            std::copy(begin + static_cast<ptrdiff_t>(kept.begin), begin + static_cast<ptrdiff_t>(kept.end), begin + static_cast<ptrdiff_t>(place));
        kept.end = place + (kept.end - kept.begin);
        kept.begin = place;
        place = kept.end;
        issues.add(kept.issues);
    }
    mesh.triangles.resize(place);
    return pieces;
}

// A range of vertices, and the triangles that may have their smallest, or an edge whose smaller one, in it.
struct Share {
    const TriangleMesh& mesh;
    const std::vector<Piece>& pieces;
    uint32_t first, count;

    template <class Visit>
    void for_each_triangle(const Visit& visit) const {
        for (const Piece& part : pieces) {
            if (part.begin == part.end || part.least >= uint64_t{first} + count || part.most < first) continue;
            for (size_t i = part.begin; i < part.end; i++) visit(mesh.triangles[i]);
        }
    }
};

// Items filed under their smallest vertex: bucket v holds items[first[v]] .. items[first[v + 1] - 1]. Buckets hold a handful each, so
// sorting inside them is linear over all, unlike one big sort or a hash map of every edge.
template <class Item>
struct Buckets {
    std::vector<size_t> first;
    UnwrittenVector<Item> items;
};

// each_item(emit) calls emit(vertex, item) for every item, in the same order each time. Those of a share are filed, under its vertices from 0 on.
template <class Item, class EachItem>
Buckets<Item> file_by_vertex(const Share& share, const EachItem& each_item) {
    Buckets<Item> result;
    result.first.assign(size_t{share.count} + 2, 0);
    const auto each_of_share = [&](const auto& emit) {
        each_item([&](uint32_t vertex, const Item& item) {
            if (const uint32_t v = vertex - share.first; v < share.count) emit(v, item);
        });
    };
    each_of_share([&](uint32_t vertex, const Item&) { ++result.first[vertex + 2]; });
    for (size_t v = 2; v < result.first.size(); ++v) result.first[v] += result.first[v - 1];
    result.items.resize(result.first.back());
    // first[v + 1] runs from the start of bucket v to its end, where bucket v + 1 starts.
    each_of_share([&](uint32_t vertex, const Item& item) { result.items[result.first[vertex + 1]++] = item; });
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

uint64_t count_duplicates(const Share& share) {
    auto buckets = file_by_vertex<uint64_t>(share, [&](const auto& emit) {
        share.for_each_triangle([&](const Triangle& t) {
            const auto [low, high] = std::minmax(t[0], t[1]);
            const uint32_t least = std::min(low, t[2]), most = std::max(high, t[2]), middle = std::max(low, std::min(high, t[2]));
            emit(least, uint64_t{middle} << 32 | most);
        });
    });
    uint64_t duplicates = 0;
    for_each_run(buckets, [&](uint64_t length) { duplicates += length - 1; });
    return duplicates;
}

uint64_t count_non_manifold_edges(const Share& share) {
    auto buckets = file_by_vertex<uint32_t>(share, [&](const auto& emit) {
        share.for_each_triangle([&](const Triangle& t) {
            for (size_t k = 0; k < 3; ++k) {
                const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
                emit(low, high);
            }
        });
    });
    uint64_t edges = 0;
    for_each_run(buckets, [&](uint64_t length) { edges += length > 2; });
    return edges;
}

}  // namespace

void clean_mesh(TriangleMesh& mesh, MeshIssues& issues) {
    if (mesh.normals.size() != mesh.positions.size()) mesh.normals.clear();
    if (mesh.colors.size() != mesh.positions.size()) mesh.colors.clear();
    for (Float3& n : mesh.normals)
        if (!finite(n)) n = {};
    if (mesh.uvs.size() != mesh.positions.size()) mesh.uvs.clear();
    for (Float2& uv : mesh.uvs) uv = usable_uv(uv, issues);
    const std::vector<Piece> pieces = drop_unhittable(mesh, issues);
    const size_t vertices = std::min<size_t>(mesh.positions.size(), UINT32_MAX),
                 share = std::max(piece, (vertices + helping_workers() - 1) / helping_workers());
    std::atomic<uint64_t> duplicates{0}, edges{0};
    parallel_for(vertices, share, [&](size_t begin, size_t end) {
        const Share part = {mesh, pieces, static_cast<uint32_t>(begin), static_cast<uint32_t>(end - begin)};
        duplicates += count_duplicates(part);
        edges += count_non_manifold_edges(part);
    });
    issues.duplicate += duplicates;
    issues.non_manifold_edges += edges;
}

}  // namespace raypager
