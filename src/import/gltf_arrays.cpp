#include "import/gltf_arrays.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "import/gltf_accessor.hpp"
#include "import/gltf_draco.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

int64_t attribute_of(const std::map<std::string, int>& attributes, const std::string& name) {
    const auto found = attributes.find(name);
    return found == attributes.end() ? -1 : found->second;
}

Float3 unit_or_zero(const Vector& v) { return dot(v, v) > 0 && std::isfinite(dot(v, v)) ? float3(unit(v)) : Float3{}; }

class ArrayReader {
public:
    ArrayReader(const GltfModel& model, const GltfReading& reading, GltfArrays& out)
        : model_(model),
          reading_(reading),
          primitive_(model.content().meshes[static_cast<size_t>(reading.mesh)].primitives[static_cast<size_t>(reading.primitive)]),
          out_(out) {}

    Status read() {
        const auto* draco = gltf_extension(primitive_.extensions, "KHR_draco_mesh_compression");
        RAYPAGER_TRY(draco ? read_draco(*draco) : read_accessors());
        RAYPAGER_TRY(morph());
        return reading_.joints.empty() ? Status() : skin();
    }

private:
    // An attribute that is as long as there are vertices.
    Result<GltfAccessor> open(int64_t number, const std::string& what, uint32_t from, uint32_t to, uint64_t vertices) const {
        auto accessor = GltfAccessor::open(model_, number, from, to);
        if (accessor && accessor->count() != vertices)
            return Status::failed(fmt::format("{} has {} elements for {} vertices; the file is damaged", what, accessor->count(), vertices));
        return accessor;
    }

    Status read_accessors() {
        const int64_t number = attribute_of(primitive_.attributes, "POSITION");
        if (number < 0) return Status::failed("has no POSITION");
        const auto positions = GltfAccessor::open(model_, number, 3, 3);
        if (!positions) return positions.status();
        const uint64_t vertices = positions->count();
        out_.positions.resize(static_cast<size_t>(vertices));
        for (uint64_t i = 0; i < vertices; ++i) out_.positions[i] = positions->vector(i);
        RAYPAGER_TRY(read_normals(vertices));
        RAYPAGER_TRY(read_uvs(vertices));
        RAYPAGER_TRY(read_colors(vertices));
        if (primitive_.indices < 0) {
            out_.corners.resize(static_cast<size_t>(vertices));
            std::iota(out_.corners.begin(), out_.corners.end(), 0u);
            return {};
        }
        const auto indices = GltfAccessor::open(model_, primitive_.indices, 1, 1);
        if (!indices) return indices.status();
        if (!indices->is_integer()) return Status::failed("its indices are no whole numbers; the file is damaged");
        out_.corners.resize(static_cast<size_t>(indices->count()));
        for (uint64_t i = 0; i < indices->count(); ++i) out_.corners[i] = indices->index(i);
        return {};
    }

    Status read_normals(uint64_t vertices) {
        const int64_t number = attribute_of(primitive_.attributes, "NORMAL");
        if (number < 0) return {};
        const auto normals = open(number, "NORMAL", 3, 3, vertices);
        if (!normals) return normals.status();
        out_.normals.resize(static_cast<size_t>(vertices));
        for (uint64_t i = 0; i < vertices; ++i) out_.normals[i] = normals->vector(i);
        return {};
    }

    Status read_uvs(uint64_t vertices) {
        const int64_t number = attribute_of(primitive_.attributes, fmt::format("TEXCOORD_{}", reading_.uv_set));
        if (number < 0) return {};
        const auto uvs = open(number, "TEXCOORD", 2, 2, vertices);
        if (!uvs) return uvs.status();
        out_.uvs.resize(static_cast<size_t>(vertices));
        for (uint64_t i = 0; i < vertices; ++i) out_.uvs[i] = {static_cast<float>(uvs->number(i, 0)), static_cast<float>(uvs->number(i, 1))};
        return {};
    }

    Status read_colors(uint64_t vertices) {
        const int64_t number = attribute_of(primitive_.attributes, "COLOR_0");
        if (number < 0 || !reading_.colors) return {};
        const auto colors = open(number, "COLOR_0", 3, 4, vertices);
        if (!colors) return colors.status();
        out_.colors.resize(static_cast<size_t>(vertices));
        for (uint64_t i = 0; i < vertices; ++i) out_.colors[i] = colors->vector(i);
        return {};
    }

    Status read_draco(const tinygltf::Value& draco) {
        const auto bytes = model_.view(gltf_index(&draco, "bufferView"));
        if (!bytes) return bytes.status();
        const auto* ids = gltf_member(&draco, "attributes");
        const auto wanted = [&](const std::string& name, uint32_t components) {
            DracoAttribute attribute;
            attribute.id = gltf_index(ids, name.c_str());
            attribute.components = components;
            const auto* accessor = gltf_item(model_.content().accessors, attribute_of(primitive_.attributes, name));
            attribute.fractions = accessor && accessor->normalized;
            return attribute;
        };
        DracoAttribute positions = wanted("POSITION", 3), normals = wanted("NORMAL", 3), colors = wanted("COLOR_0", 3);
        DracoAttribute uvs = wanted(fmt::format("TEXCOORD_{}", reading_.uv_set), 2);
        if (positions.id < 0) return Status::failed("has no POSITION in its Draco data");
        if (!reading_.colors) colors.id = -1;
        const std::array all = {&positions, &normals, &colors, &uvs};
        RAYPAGER_TRY(unpack_draco(*bytes, all, out_.corners));
        const auto vectors = [](const DracoAttribute& from, std::vector<Float3>& to) {
            to.resize(from.values.size() / 3);
            for (size_t i = 0; i < to.size(); ++i) to[i] = {from.values[3 * i], from.values[3 * i + 1], from.values[3 * i + 2]};
        };
        vectors(positions, out_.positions);
        vectors(normals, out_.normals);
        vectors(colors, out_.colors);
        out_.uvs.resize(uvs.values.size() / 2);
        for (size_t i = 0; i < out_.uvs.size(); ++i) out_.uvs[i] = {uvs.values[2 * i], uvs.values[2 * i + 1]};
        return {};
    }

    Status morph() {
        for (size_t t = 0; t < std::min(primitive_.targets.size(), reading_.weights.size()); ++t) {
            const double weight = reading_.weights[t];
            if (weight == 0) continue;
            RAYPAGER_TRY(add_target(primitive_.targets[t], "POSITION", weight, out_.positions));
            if (out_.normals.empty()) continue;
            RAYPAGER_TRY(add_target(primitive_.targets[t], "NORMAL", weight, out_.normals));
        }
        return {};
    }

    Status add_target(const std::map<std::string, int>& target, const char* attribute, double weight, std::vector<Float3>& to) const {
        const int64_t number = attribute_of(target, attribute);
        if (number < 0) return {};
        const auto moves = open(number, "a morph target", 3, 3, to.size());
        if (!moves) return moves.status();
        for (uint64_t i = 0; i < to.size(); ++i) to[i] = float3(vector(to[i]) + weight * vector(moves->vector(i)));
        return {};
    }

    // Section 3.7.3 of the specification. Normals go the same way as positions: skins bend, and hardly stretch.
    Status skin() {
        const uint64_t vertices = out_.positions.size();
        const auto joints = open(attribute_of(primitive_.attributes, "JOINTS_0"), "JOINTS_0", 4, 4, vertices);
        if (!joints) return joints.status();
        const auto weights = open(attribute_of(primitive_.attributes, "WEIGHTS_0"), "WEIGHTS_0", 4, 4, vertices);
        if (!weights) return weights.status();
        if (!joints->is_integer()) return Status::failed("its JOINTS_0 are no whole numbers; the file is damaged");
        for (uint64_t i = 0; i < vertices; ++i) {
            Vector position = {}, normal = {};
            double sum = 0;
            for (uint32_t c = 0; c < 4; ++c) {
                const double weight = weights->number(i, c);
                const double joint = joints->number(i, c);
                if (!(weight > 0)) continue;
                if (joint >= static_cast<double>(reading_.joints.size()))
                    return Status::failed("it hangs on a joint that its skin has not; the file is damaged");
                const Transform& place = reading_.joints[static_cast<size_t>(joint)];
                const Float3& p = out_.positions[i];
                position = position + weight * Vector(place.point(p.x, p.y, p.z));
                if (!out_.normals.empty()) {
                    const Float3& n = out_.normals[i];
                    normal = normal + weight * Vector(place.vector(n.x, n.y, n.z));
                }
                sum += weight;
            }
            if (sum > 0) out_.positions[i] = float3((1 / sum) * position);
            if (sum > 0 && !out_.normals.empty()) out_.normals[i] = unit_or_zero(normal);
        }
        return {};
    }

    const GltfModel& model_;
    const GltfReading& reading_;
    const tinygltf::Primitive& primitive_;
    GltfArrays& out_;
};

}  // namespace

Status read_gltf_arrays(const GltfModel& model, const GltfReading& reading, GltfArrays& arrays) { return ArrayReader(model, reading, arrays).read(); }

Result<GltfColors> look_at_gltf_colors(const GltfModel& model, const tinygltf::Primitive& primitive) {
    GltfColors result;
    const int64_t number = attribute_of(primitive.attributes, "COLOR_0");
    if (number < 0) return result;
    result.any = true;
    if (gltf_extension(primitive.extensions, "KHR_draco_mesh_compression")) {
        result.uniform = false;  // it would have to be unpacked to tell
        return result;
    }
    const auto colors = GltfAccessor::open(model, number, 3, 4);
    if (!colors) return colors.status();
    Vector sum = {};
    const Float3 first = colors->count() > 0 ? colors->vector(0) : Float3{1, 1, 1};
    for (uint64_t i = 0; i < colors->count(); ++i) {
        const Float3 color = colors->vector(i);
        result.uniform = result.uniform && color == first;
        result.alpha = result.alpha || (colors->components() == 4 && colors->number(i, 3) < 1);
        if (finite(color)) sum = sum + vector(color);
    }
    result.mean = result.uniform ? first : float3((1.0 / static_cast<double>(std::max<uint64_t>(colors->count(), 1))) * sum);
    return result;
}

}  // namespace raypager
