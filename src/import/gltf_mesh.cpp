#include "import/gltf_mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <new>

#include "import/gltf_arrays.hpp"
#include "import/mesh_colors.hpp"
#include "import/text.hpp"
#include "scene/clean_mesh.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

double srgb_of(double linear) { return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055; }

uint32_t packed_color(const Float3& color, const Float3& factor) {
    return pack_color(srgb_of(double{color.x} * factor.x), srgb_of(double{color.y} * factor.y), srgb_of(double{color.z} * factor.z));
}

bool is_mirrored(const std::vector<Float2>& uvs, const Triangle& t) {
    for (const uint32_t v : t)
        if (v >= uvs.size()) return false;
    const Float2 &a = uvs[t[0]], &b = uvs[t[1]], &c = uvs[t[2]];
    // Seen from outside u grows to the right and v downwards.
    return (double{b.x} - a.x) * (double{c.y} - a.y) - (double{b.y} - a.y) * (double{c.x} - a.x) > 0;
}

void keep_part(const GltfReading& reading, TriangleMesh& mesh) {
    if (reading.part == GltfPart::whole && !reading.groups) return;
    size_t kept = 0;
    for (size_t i = 0; i < mesh.triangles.size(); ++i) {
        const Triangle& t = mesh.triangles[i];
        const bool other_part = reading.part != GltfPart::whole && is_mirrored(mesh.uvs, t) != (reading.part == GltfPart::mirrored);
        const bool other_group = reading.groups && (i < reading.groups->size() ? (*reading.groups)[i] : 0) != reading.group;
        if (!other_part && !other_group) mesh.triangles[kept++] = t;
    }
    mesh.triangles.resize(kept);
}

}  // namespace

// Section 3.7.2.1 of the specification.
std::vector<Triangle> gltf_triangles(const std::vector<uint32_t>& corners, int mode) {
    std::vector<Triangle> triangles;
    if (mode == TINYGLTF_MODE_TRIANGLES) {
        triangles.reserve(corners.size() / 3);
        for (size_t i = 0; i + 2 < corners.size(); i += 3) triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
        return triangles;
    }
    const bool fan = mode == TINYGLTF_MODE_TRIANGLE_FAN;
    for (size_t i = 0; i + 2 < corners.size(); ++i)
        triangles.push_back(fan ? Triangle{corners[i + 1], corners[i + 2], corners[0]}
                                : Triangle{corners[i], corners[i + 1 + i % 2], corners[i + 2 - i % 2]});
    return triangles;
}

std::string gltf_primitive_name(const GltfModel& model, int64_t mesh, int64_t primitive) {
    const auto* found = gltf_item(model.content().meshes, mesh);
    const std::string called = found && !found->name.empty() ? fmt::format(" \"{}\"", clipped(found->name)) : "";
    const std::string part = found && found->primitives.size() > 1 ? fmt::format(", primitive {}", primitive) : "";
    return fmt::format("mesh {}{}{}", mesh, called, part);
}

GltfMesh::GltfMesh(std::shared_ptr<const GltfModel> model, GltfReading reading) : model_(std::move(model)), reading_(std::move(reading)) {
    const char* part = reading_.part == GltfPart::mirrored ? ", mirrored part" : "";
    const std::string group = reading_.groups ? fmt::format(", {}", reading_.group == 0 ? "dark part" : fmt::format("light {}", reading_.group)) : "";
    name_ = fmt::format("{} ({}{}{})", model_->name(), gltf_primitive_name(*model_, reading_.mesh, reading_.primitive), part, group);
}

Status GltfMesh::load(TriangleMesh& mesh, MeshIssues& issues) const {
    mesh = {};
    try {
        GltfArrays arrays;
        RAYPAGER_TRY(read_gltf_arrays(*model_, reading_, arrays).at(name_));
        const auto& primitive = model_->content().meshes[static_cast<size_t>(reading_.mesh)].primitives[static_cast<size_t>(reading_.primitive)];
        mesh.triangles = gltf_triangles(arrays.corners, primitive.mode);
        mesh.positions = std::move(arrays.positions);
        mesh.normals = std::move(arrays.normals);
        mesh.uvs = std::move(arrays.uvs);
        mesh.colors.reserve(arrays.colors.size());
        for (const Float3& color : arrays.colors) mesh.colors.push_back(packed_color(color, reading_.color_factor));
        keep_part(reading_, mesh);
        MeshIssues found;
        clean_mesh(mesh, found);
        issues.add(found);
    } catch (const std::bad_alloc&) {
        return Status::failed(name_ + ": not enough memory for its mesh");
    }
    return {};
}

uint64_t GltfMesh::bytes_to_read() const {
    uint64_t bytes = 0;
    const auto& primitive = model_->content().meshes[static_cast<size_t>(reading_.mesh)].primitives[static_cast<size_t>(reading_.primitive)];
    const auto add = [&](int number) {
        if (const auto* accessor = gltf_item(model_->content().accessors, number)) bytes += accessor->count * 12;
    };
    for (const auto& [attribute, number] : primitive.attributes) add(number);
    add(primitive.indices);
    return bytes;
}

std::vector<std::array<double, 3>> GltfMesh::corners() const {
    const auto& primitive = model_->content().meshes[static_cast<size_t>(reading_.mesh)].primitives[static_cast<size_t>(reading_.primitive)];
    const auto found = primitive.attributes.find("POSITION");
    const auto* accessor = found == primitive.attributes.end() ? nullptr : gltf_item(model_->content().accessors, found->second);
    const bool plain = accessor && accessor->componentType == TINYGLTF_COMPONENT_TYPE_FLOAT && reading_.joints.empty() && reading_.weights.empty();
    if (!plain || accessor->minValues.size() != 3 || accessor->maxValues.size() != 3) return {};
    const auto &lower = accessor->minValues, &upper = accessor->maxValues;
    return {{lower[0], lower[1], lower[2]}, {upper[0], upper[1], upper[2]}};
}

Result<bool> has_mirrored_uvs(const std::shared_ptr<const GltfModel>& model, const GltfReading& reading) {
    TriangleMesh mesh;
    MeshIssues ignored;
    if (auto status = GltfMesh(model, reading).load(mesh, ignored); !status.ok()) return status;
    return std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const Triangle& t) { return is_mirrored(mesh.uvs, t); });
}

Result<std::shared_ptr<const PointSource>> read_gltf_points(const std::shared_ptr<const GltfModel>& model, const GltfReading& reading) {
    const std::string name = fmt::format("{} ({})", model->name(), gltf_primitive_name(*model, reading.mesh, reading.primitive));
    GltfArrays arrays;
    if (auto status = read_gltf_arrays(*model, reading, arrays); !status.ok()) return status.at(name);
    std::vector<CloudPoint> points;
    points.reserve(arrays.corners.size());
    for (const uint32_t i : arrays.corners) {
        if (i >= arrays.positions.size() || !finite(arrays.positions[i])) continue;
        CloudPoint& point = points.emplace_back();
        point.position = arrays.positions[i];
        if (!arrays.colors.empty()) point.color = packed_color(arrays.colors[i], reading.color_factor);
    }
    return std::shared_ptr<const PointSource>(std::make_shared<PointsInMemory>(name, std::move(points), !arrays.colors.empty()));
}

}  // namespace raypager
