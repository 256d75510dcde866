#include "python/sources.hpp"

#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "base/hash.hpp"
#include "python/errors.hpp"

namespace raypager::python {
namespace {

constexpr size_t piece = 4096;  // rows that are handed on at a time

bool finite(const CloudPoint& p) {
    return std::isfinite(p.position.x) && std::isfinite(p.position.y) && std::isfinite(p.position.z) && std::isfinite(p.radius);
}

Status hand_on(const PointRows& rows, const std::function<Status(std::span<const CloudPoint>)>& take, MeshIssues& issues) {
    std::vector<CloudPoint> points;
    const size_t count = rows.positions.values.size();
    for (size_t begin = 0; begin < count; begin += piece) {
        points.clear();
        for (size_t i = begin; i < std::min(count, begin + piece); i++) {
            CloudPoint p;
            p.position = rows.positions.values[i];
            if (!rows.radii.values.empty()) p.radius = rows.radii.values[i];
            if (!rows.colors.values.empty()) p.color = rows.colors.values[i];
            if (finite(p))
                points.push_back(p);
            else
                issues.not_finite++;
        }
        RAYPAGER_TRY(take(points));
    }
    return {};
}

template <class T>
void add(Hash64Stream& hash, const Rows<T>& rows) {
    const uint64_t size = rows.values.size();
    hash.add(std::as_bytes(std::span(&size, 1)));
    hash.add(std::as_bytes(rows.values));
}

}  // namespace

Status ArrayMesh::load(TriangleMesh& mesh, MeshIssues& issues) const {
    const auto copy = [](const auto& rows) { return std::vector(rows.values.begin(), rows.values.end()); };
    TriangleMesh whole{copy(rows_.positions), copy(rows_.triangles), copy(rows_.normals), copy(rows_.colors), copy(rows_.uvs)};
    return MeshInMemory(name_, std::move(whole)).load(mesh, issues);
}

Status ArrayMesh::stream(MeshSink& sink, MeshIssues&) const {
    RAYPAGER_TRY(sink.expect(rows_.positions.values.size(), rows_.triangles.values.size()));
    RAYPAGER_TRY(sink.vertices({rows_.positions.values, rows_.normals.values, rows_.colors.values, rows_.uvs.values}));
    return sink.triangles(rows_.triangles.values);
}

uint64_t ArrayMesh::bytes_to_read() const {
    return rows_.positions.values.size_bytes() + rows_.triangles.values.size_bytes() + rows_.normals.values.size_bytes() +
           rows_.uvs.values.size_bytes() + rows_.colors.values.size_bytes();
}

Status ArrayPoints::stream(const std::function<Status(std::span<const CloudPoint>)>& take, MeshIssues& issues) const {
    return hand_on(rows_, take, issues);
}

Status ChunkedPoints::stream(const std::function<Status(std::span<const CloudPoint>)>& take, MeshIssues& issues) const {
    std::shared_ptr<const nb::object> iterator;
    // The next chunk, or none at the end. What Python raises becomes an error of the bake.
    const auto next = [&]() -> Result<std::optional<PointRows>> {
        const nb::gil_scoped_acquire gil;
        try {
            if (!iterator) iterator = keep(nb::object((*chunks_)()));
            const auto chunk = nb::steal(PyIter_Next(iterator->ptr()));
            if (!chunk.is_valid()) {
                if (PyErr_Occurred()) throw nb::python_error();
                return std::optional<PointRows>();
            }
            const auto columns = nb::cast<nb::tuple>(chunk);
            return std::optional(PointRows{rows_of<Float3>(nb::cast<Table<float, 3>>(columns[0])),
                                           rows_of<float>(nb::cast<std::optional<Column<float>>>(columns[1])),
                                           rows_of<uint32_t>(nb::cast<std::optional<Column<uint32_t>>>(columns[2]))});
        } catch (const nb::python_error& error) {
            return Status::failed(fmt::format("{}: its chunks cannot be read: {}", name_, text_of(error)));
        } catch (const nb::cast_error&) {
            return Status::failed(fmt::format("{}: a chunk is not what was expected", name_));
        }
    };
    uint64_t seen = 0;
    for (;;) {
        const auto rows = next();
        if (!rows) return rows.status();
        if (!*rows) break;
        seen += (*rows)->positions.values.size();
        if (seen > count_) break;
        RAYPAGER_TRY(hand_on(**rows, take, issues));
    }
    if (seen == count_) return {};
    return Status::failed(
        fmt::format("{}: its chunks have {} points, where there were {} before; they must be the same each time that they are asked for", name_,
                    seen > count_ ? "more" : fmt::format("{}", seen), count_));
}

ArrayInstances::ArrayInstances(std::string name, InstanceRows rows) : name_(std::move(name)), rows_(std::move(rows)) {
    std::set<uint32_t> found(rows_.materials.values.begin(), rows_.materials.values.end());
    found.erase(RP_NONE);
    for (const uint32_t material : found) materials_.push_back({rows_.object, material});
}

Status ArrayInstances::stream(const std::function<Status(std::span<const Placement>)>& take) const {
    std::vector<Placement> placements;
    const auto& materials = rows_.materials.values;
    for (size_t begin = 0; begin < count(); begin += piece) {
        placements.clear();
        for (size_t i = begin; i < std::min<size_t>(count(), begin + piece); i++) {
            Placement p;
            p.object = rows_.object;
            p.to_world = rows_.transforms.values[i];
            if (!materials.empty()) p.material = materials[materials.size() == 1 ? 0 : i];
            if (!rows_.colors.values.empty()) p.color = rows_.colors.values[i];
            placements.push_back(p);
        }
        RAYPAGER_TRY(take(placements));
    }
    return {};
}

uint64_t ArrayInstances::fingerprint() const {
    Hash64Stream hash(rows_.object);
    add(hash, rows_.transforms);
    add(hash, rows_.materials);
    add(hash, rows_.colors);
    return hash.value();
}

Result<uint64_t> ArrayImage::fingerprint() const {
    return hash64(texels_.values,
                  hash64(fmt::format("{} {} {} {} {}", shape_.width, shape_.height, shape_.channels, static_cast<int>(shape_.kind), shape_.srgb)));
}

}  // namespace raypager::python
