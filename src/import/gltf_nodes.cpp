#include "import/gltf_nodes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "import/gltf_accessor.hpp"

namespace raypager {
namespace {

Transform rotation_of(double x, double y, double z, double w) {
    const double n = x * x + y * y + z * z + w * w;
    Transform t;
    if (!(n > 0) || !std::isfinite(n)) return t;
    const double s = 2 / n;
    t.m[0] = {1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y), 0};
    t.m[1] = {s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x), 0};
    t.m[2] = {s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y), 0};
    return t;
}

// Columns one after the other.
Transform matrix_of(const std::vector<double>& m) {
    Transform t;
    for (size_t row = 0; row < 3; ++row)
        for (size_t column = 0; column < 4; ++column) t.m[row][column] = m[4 * column + row];
    return t;
}

bool has_finite_place(const Transform& t) {
    return std::all_of(t.m.begin(), t.m.end(),
                       [](const auto& row) { return std::all_of(row.begin(), row.end(), [](double x) { return std::isfinite(x); }); });
}

Transform local_transform(const tinygltf::Node& node) {
    if (node.matrix.size() == 16) return matrix_of(node.matrix);
    Transform t;
    if (node.translation.size() == 3) t = Transform::translate(node.translation[0], node.translation[1], node.translation[2]);
    if (node.rotation.size() == 4) t = t * rotation_of(node.rotation[0], node.rotation[1], node.rotation[2], node.rotation[3]);
    if (node.scale.size() == 3) t = t * Transform::scale(node.scale[0], node.scale[1], node.scale[2]);
    return t;
}

std::vector<int> roots_of(const GltfModel& model, GltfNotes& notes) {
    const auto& content = model.content();
    const auto* scene = gltf_item(content.scenes, content.defaultScene);
    if (content.scenes.size() > 1)
        notes.add("scenes", fmt::format("{} scenes", content.scenes.size()),
                  scene ? fmt::format("scene {}, its default, is shown", content.defaultScene) : "the first is shown");
    if (!scene) scene = gltf_item(content.scenes, 0);
    if (scene) return scene->nodes;
    // A library of things: all of them.
    std::vector<bool> is_child(content.nodes.size(), false);
    for (const auto& node : content.nodes)
        for (const int child : node.children)
            if (gltf_item(content.nodes, child)) is_child[static_cast<size_t>(child)] = true;
    std::vector<int> roots;
    for (size_t i = 0; i < is_child.size(); ++i)
        if (!is_child[i]) roots.push_back(static_cast<int>(i));
    return roots;
}

}  // namespace

Result<std::vector<GltfNode>> walk_gltf_nodes(const GltfModel& model, GltfNotes& notes) {
    const auto& nodes = model.content().nodes;
    std::vector<GltfNode> walked, open;
    std::vector<bool> seen(nodes.size(), false);
    const std::vector<int> roots = roots_of(model, notes);
    for (auto root = roots.rbegin(); root != roots.rend(); ++root) open.push_back({*root, {}});
    while (!open.empty()) {
        const GltfNode next = open.back();
        open.pop_back();
        const auto* node = gltf_item(nodes, next.number);
        if (!node) return model.failed(fmt::format("there is no node {}; the file is damaged", next.number));
        if (seen[static_cast<size_t>(next.number)])
            return model.failed(fmt::format("node {} is met twice: below itself, or below two others; the file is damaged", next.number));
        seen[static_cast<size_t>(next.number)] = true;
        walked.push_back({next.number, next.to_world * local_transform(*node)});
        if (!has_finite_place(walked.back().to_world)) return model.failed(fmt::format("node {}: its transform is not finite", next.number));
        for (auto child = node->children.rbegin(); child != node->children.rend(); ++child) open.push_back({*child, walked.back().to_world});
    }
    return walked;
}

Status for_each_gltf_instance(const GltfModel& model, const tinygltf::Node& node, const std::function<Status(const Transform&)>& take) {
    const auto* extension = gltf_extension(node.extensions, "EXT_mesh_gpu_instancing");
    if (!extension) return take({});
    const auto* attributes = gltf_member(extension, "attributes");
    std::optional<GltfAccessor> translations, rotations, scales;
    std::optional<uint64_t> count;
    const auto open = [&](const char* name, uint32_t components, std::optional<GltfAccessor>& out) -> Status {
        const int64_t number = gltf_index(attributes, name);
        if (number < 0) return {};
        auto accessor = GltfAccessor::open(model, number, components, components);
        if (!accessor) return accessor.status();
        if (count && *count != accessor->count())
            return model.failed(fmt::format("the attributes of instances have {} and {} elements; the file is damaged", *count, accessor->count()));
        if (model.content().accessors[static_cast<size_t>(number)].bufferView < 0)
            return model.failed(fmt::format("accessor {}, of instances, has no bytes; the file is damaged", number));
        count = accessor->count();
        out = *accessor;
        return {};
    };
    RAYPAGER_TRY(open("TRANSLATION", 3, translations));
    RAYPAGER_TRY(open("ROTATION", 4, rotations));
    RAYPAGER_TRY(open("SCALE", 3, scales));
    for (uint64_t i = 0; i < count.value_or(1); ++i) {
        Transform t;
        if (translations) t = Transform::translate(translations->number(i, 0), translations->number(i, 1), translations->number(i, 2));
        if (rotations) t = t * rotation_of(rotations->number(i, 0), rotations->number(i, 1), rotations->number(i, 2), rotations->number(i, 3));
        if (scales) t = t * Transform::scale(scales->number(i, 0), scales->number(i, 1), scales->number(i, 2));
        if (!has_finite_place(t)) return model.failed(fmt::format("instance {} of a node is at no finite place", i));
        RAYPAGER_TRY(take(t));
    }
    return {};
}

Result<std::vector<Transform>> gltf_joints_of(const GltfModel& model, int64_t number, const std::vector<GltfNode>& nodes) {
    const auto* skin = gltf_item(model.content().skins, number);
    if (!skin) return model.failed(fmt::format("there is no skin {}; the file is damaged", number));
    std::optional<GltfAccessor> inverses;
    if (skin->inverseBindMatrices >= 0) {
        auto accessor = GltfAccessor::open(model, skin->inverseBindMatrices, 16, 16);
        if (!accessor) return accessor.status();
        if (accessor->count() < skin->joints.size())
            return model.failed(
                fmt::format("skin {} has {} joints, but {} matrices; the file is damaged", number, skin->joints.size(), accessor->count()));
        inverses = *accessor;
    }
    std::map<int64_t, const Transform*> places;
    for (const GltfNode& node : nodes) places[node.number] = &node.to_world;
    std::vector<Transform> joints;
    for (size_t i = 0; i < skin->joints.size(); ++i) {
        const auto place = places.find(skin->joints[i]);
        if (place == places.end()) return model.failed(fmt::format("skin {}: node {}, a joint, is not in the scene", number, skin->joints[i]));
        Transform bind;
        if (inverses) {
            std::vector<double> m(16);
            for (uint32_t c = 0; c < 16; ++c) m[c] = inverses->number(i, c);
            bind = matrix_of(m);
        }
        joints.push_back(*place->second * bind);
        if (!has_finite_place(joints.back())) return model.failed(fmt::format("skin {}: joint {} is at no finite place", number, i));
    }
    return joints;
}

}  // namespace raypager
