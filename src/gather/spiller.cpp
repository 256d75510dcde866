#include "gather/spiller.hpp"

#include <algorithm>

#include "base/parallel.hpp"
#include "gather/lights.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

constexpr size_t piece_triangles = size_t{1} << 14;

template <class Record>
void set_attributes(Record& record, size_t corner, const VertexBits& vertex) {
    if constexpr (requires { record.normals; }) record.normals[corner] = vertex.normal;
    if constexpr (requires { record.colors; }) record.colors[corner] = vertex.color;
    if constexpr (requires { record.uvs; }) record.uvs[corner] = vertex.uv;
}

// Whether any of these triangles has coordinates of textures.
bool has_uvs(const World& world, uint32_t first, uint32_t last) {
    for (uint32_t i = first; i < last && !world.uvs.empty(); i++)
        for (const uint32_t v : world.primitives[i])
            if (world.uv(v) != Float2{}) return true;
    return false;
}

}  // namespace

// What became of a run of triangles: those that are kept lie at the front of the run's place among the records.
struct Spiller::Piece {
    size_t kept = 0;
    MeshIssues issues;
    Box bounds;
    Status status;
};

template <class Record>
class Spiller::PiecePlacer {
public:
    PiecePlacer(const Triangles& triangles, std::span<Record> records) : triangles_(triangles), records_(records) {}

    Piece place(size_t begin, size_t end) const {
        Piece piece;
        for (size_t i = begin; i < end; i++) {
            Record& record = records_[begin + piece.kept];
            if (!place_one(i, record, piece)) continue;
            for (const Float3& v : record.vertices) piece.bounds.grow(v);
            piece.kept++;
        }
        return piece;
    }

private:
    bool place_one(size_t i, Record& record, Piece& piece) const {
        const VertexBits* c = &triangles_.corners[3 * i];
        if (!finite(c[0].position) || !finite(c[1].position) || !finite(c[2].position)) return piece.issues.not_finite++, false;
        const Triangle& t = triangles_.indices[i];
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0] || has_no_area(c[0].position, c[1].position, c[2].position))
            return piece.issues.degenerate++, false;
        const bool flip = triangles_.placement.flips();
        for (int k = 0; k < 3; k++) {
            const int from = flip ? (3 - k) % 3 : k;
            record.vertices[k] = triangles_.placement.point(c[from].position);
            set_attributes(record, static_cast<size_t>(k), c[from]);
            if (!in_range(record.vertices[k])) piece.status = out_of_range(triangles_.shape, t[from], record.vertices[k]);
        }
        if (has_no_area(record.vertices[0], record.vertices[1], record.vertices[2])) return piece.issues.degenerate++, false;
        return true;
    }

    const Triangles& triangles_;
    const std::span<Record> records_;
};

Result<std::unique_ptr<Spiller>> Spiller::create(const std::filesystem::path& beside, size_t buffer_bytes) {
    auto file = SpillFile::create(beside, SpillFile::for_all_threads);
    if (!file) return file.status();
    return std::unique_ptr<Spiller>(new Spiller(std::move(*file), buffer_bytes));
}

Status Spiller::add(const Triangles& triangles, const AreaLight* light, std::vector<rp_light>& lights, MeshIssues& issues) {
    if (triangles.attributes.uvs) return add_as<TexturedTriangleRecord>(textured_records, triangles, light, lights, issues);
    if (triangles.attributes.colors) return add_as<ColoredTriangleRecord>(colored_records, triangles, light, lights, issues);
    if (triangles.attributes.normals) return add_as<ShadedTriangleRecord>(shaded_records, triangles, light, lights, issues);
    return add_as<TriangleRecord>(triangle_records, triangles, light, lights, issues);
}

template <class Record>
Status Spiller::add_as(RecordKind kind, const Triangles& triangles, const AreaLight* light, std::vector<rp_light>& lights, MeshIssues& issues) {
    const size_t given = triangles.indices.size();
    records_.resize(given * sizeof(Record));
    const std::span records(reinterpret_cast<Record*>(records_.data()), given);
    std::vector<Piece> pieces((given + piece_triangles - 1) / piece_triangles);
    const PiecePlacer<Record> placer(triangles, records);
    parallel_for(given, piece_triangles, [&](size_t begin, size_t end) { pieces[begin / piece_triangles] = placer.place(begin, end); });
    std::vector<uint64_t> first_id(pieces.size());
    for (size_t p = 0; p < pieces.size(); p++) {
        RAYPAGER_TRY(pieces[p].status);
        issues.add(pieces[p].issues);
        bounds_.grow(pieces[p].bounds);
        first_id[p] = count();
        triangles_ += pieces[p].kept;
    }
    const auto kept = [&](size_t p) { return records.subspan(p * piece_triangles, pieces[p].kept); };
    parallel_for(pieces.size(), 1, [&](size_t p, size_t) {
        uint64_t id = first_id[p];
        for (Record& record : kept(p)) record.id = static_cast<uint32_t>(id++);
    });
    for (size_t p = 0; p < pieces.size(); p++) {
        if (light)
            for (const Record& r : kept(p)) lights.push_back(triangle_light(r.vertices[0], r.vertices[1], r.vertices[2], *light));
        RAYPAGER_TRY(writer_.add(kind, std::as_bytes(kept(p))));
    }
    return {};
}

Status Spiller::add(std::span<const SphereRecord> spheres, const Box& bounds) {
    bounds_.grow(bounds);
    spheres_ += spheres.size();
    return writer_.add(sphere_records, std::as_bytes(spheres));
}

template <class Record>
Status Spiller::add_run(RecordKind kind, const World& world, uint32_t first, uint32_t last) {
    records_.resize((last - first) * sizeof(Record));
    const std::span records(reinterpret_cast<Record*>(records_.data()), last - first);
    const uint64_t first_id = count();
    parallel_for(records.size(), piece_triangles, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            for (int k = 0; k < 3; k++) {
                const VertexBits vertex = world.vertex(world.primitives[first + i][k]);
                records[i].vertices[k] = vertex.position;
                set_attributes(records[i], static_cast<size_t>(k), vertex);
            }
            records[i].id = static_cast<uint32_t>(first_id + i);
        }
    });
    triangles_ += records.size();
    return writer_.add(kind, std::as_bytes(records));
}

Status Spiller::add(const World& world, size_t at_once) {
    bounds_.grow(world.bounds);
    const auto all = static_cast<uint32_t>(world.primitives.size());
    for (uint32_t i = 0; i < all;) {
        if (world.is_sphere(i)) {
            std::vector<SphereRecord> run;
            for (; i < all && run.size() < at_once && world.is_sphere(i); i++)
                run.push_back({world.sphere(i), static_cast<uint32_t>(count() + run.size())});
            RAYPAGER_TRY(add(run, bounds_of(run)));
            continue;
        }
        uint32_t end = i + 1;
        while (end < all && end - i < at_once && !world.is_sphere(end)) end++;
        RAYPAGER_TRY(has_uvs(world, i, end)   ? add_run<TexturedTriangleRecord>(textured_records, world, i, end)
                     : !world.colors.empty()  ? add_run<ColoredTriangleRecord>(colored_records, world, i, end)
                     : !world.normals.empty() ? add_run<ShadedTriangleRecord>(shaded_records, world, i, end)
                                              : add_run<TriangleRecord>(triangle_records, world, i, end));
        i = end;
    }
    return {};
}

}  // namespace raypager
