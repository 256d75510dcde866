#include "import/gltf_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>

#include "import/gltf_framing.hpp"
#include "import/gltf_glow.hpp"
#include "import/gltf_lights.hpp"
#include "import/gltf_materials.hpp"
#include "import/gltf_mesh.hpp"
#include "import/placement_store.hpp"
#include "import/text.hpp"
#include "raypager/materials.hpp"

namespace raypager {
namespace {

class GltfSceneReader {
public:
    GltfSceneReader(std::shared_ptr<const GltfModel> model, const BareLook& look)
        : model_(std::move(model)), look_(look), notes_(model_->name()), materials_(scene_, model_, notes_) {}

    Result<Scene> read() {
        note_the_file();
        scene_.files = model_->files();
        scene_.materials = {bare_ground_material()};
        auto nodes = walk_gltf_nodes(*model_, notes_);
        if (!nodes) return nodes.status();
        nodes_ = std::move(*nodes);
        for (const GltfNode& node : nodes_)
            if (auto status = add_gltf_light(*model_, node, scene_, notes_); !status.ok()) return status;
        has_light_ = !scene_.lights.empty();
        const auto has_camera = take_gltf_camera(*model_, nodes_, scene_, notes_);
        if (!has_camera) return has_camera.status();
        frames_ = !*has_camera || !has_light_;
        if (auto status = count_meshes(); !status.ok()) return status;
        if (auto status = place_meshes(); !status.ok()) return status;
        if (scene_.shapes.empty() && scene_.instances.empty()) return model_->failed("has no surface that can be seen");
        const bool look_is_given = look_.sky || look_.light.kind != BareLight::Kind::usual;
        if (has_light_ && look_is_given) notes_.add("look", "it has lights of its own", "--sky and --light are for what has none, and are left out");
        if (!*has_camera || !has_light_)
            if (auto status = frame_gltf(*model_, look_, *has_camera, has_light_, placed_, scene_); !status.ok()) return status;
        notes_.add_to(scene_.warnings);
        if (auto status = validate(scene_); !status.ok()) return status.at(model_->name());
        return std::move(scene_);
    }

private:
    // What one mesh is, wherever it stands: a node may have weights of its own for its morph targets.
    using MeshKey = std::pair<int64_t, std::vector<double>>;
    struct Use {
        uint64_t places = 0;
        uint32_t object = RP_NONE;
        size_t placed = 0;  // of the object, in placed_
    };

    const tinygltf::Node& node_of(const GltfNode& node) const { return model_->content().nodes[static_cast<size_t>(node.number)]; }

    void note_the_file() {
        if (model_->about().has_animations) notes_.add("animations", "animations", "are left out; it is shown as its nodes stand");
        for (const std::string& extension : model_->about().used)
            if (!is_known_gltf_extension(extension))
                notes_.add("extension " + extension, clipped(extension), "this extension is not read; it is left out");
    }

    MeshKey key_of(const tinygltf::Node& node) const {
        const auto& mesh = model_->content().meshes[static_cast<size_t>(node.mesh)];
        std::vector<double> weights = node.weights.empty() ? mesh.weights : node.weights;
        while (!weights.empty() && weights.back() == 0) weights.pop_back();
        return {node.mesh, std::move(weights)};
    }

    Status count_meshes() {
        for (const GltfNode& place : nodes_) {
            const auto& node = node_of(place);
            if (node.mesh < 0 || node.skin >= 0) continue;
            if (!gltf_item(model_->content().meshes, node.mesh))
                return model_->failed(fmt::format("node {}: there is no mesh {}; the file is damaged", place.number, node.mesh));
            uint64_t& places = uses_[key_of(node)].places;
            RAYPAGER_TRY(for_each_gltf_instance(*model_, node, [&](const Transform&) {
                ++places;
                return Status();
            }));
        }
        return {};
    }

    Status place_meshes() {
        for (const GltfNode& place : nodes_) {
            const auto& node = node_of(place);
            if (node.mesh < 0) continue;
            if (node.skin >= 0) {
                RAYPAGER_TRY(place_skinned(place));
                continue;
            }
            const MeshKey key = key_of(node);
            Use& use = uses_[key];
            if (use.places == 1) {
                RAYPAGER_TRY(add_shapes(key, {}, place.to_world, scene_.shapes));
                continue;
            }
            RAYPAGER_TRY(place_instances(key, use, place));
        }
        return finish_instances();
    }

    Status place_skinned(const GltfNode& place) {
        const auto& node = node_of(place);
        if (!gltf_item(model_->content().meshes, node.mesh))
            return model_->failed(fmt::format("node {}: there is no mesh {}; the file is damaged", place.number, node.mesh));
        notes_.add("skin", fmt::format("node {}", place.number), "its skin is shown as its joints stand in the file");
        const auto joints = gltf_joints_of(*model_, node.skin, nodes_);
        if (!joints) return joints.status();
        return add_shapes(key_of(node), *joints, {}, scene_.shapes);
    }

    Status place_instances(const MeshKey& key, Use& use, const GltfNode& place) {
        if (use.object == RP_NONE) {
            std::vector<Shape> shapes;
            RAYPAGER_TRY(add_shapes(key, {}, {}, shapes));
            use.object = static_cast<uint32_t>(scene_.objects.size());
            const auto& mesh = model_->content().meshes[static_cast<size_t>(key.first)];
            use.placed = placed_.size();
            GltfPlaced& placed = placed_.emplace_back();
            for (const Shape& shape : shapes)
                if (shape.mesh) placed.meshes.push_back(shape.mesh);
            scene_.objects.push_back({fmt::format("mesh {} \"{}\"", key.first, clipped(mesh.name)), std::move(shapes)});
        }
        if (scene_.objects[use.object].shapes.empty()) return {};
        return for_each_gltf_instance(*model_, node_of(place), [&](const Transform& instance) -> Status {
            const Transform to_world = place.to_world * instance;
            if (!to_world.inverse()) {
                notes_.add("flat instance", fmt::format("node {}", place.number), "a transform that cannot be inverted flattens it; it is left out");
                return {};
            }
            const auto& m = to_world.m;
            if (const Status kept = placements_->add({use.object, {m[0], m[1], m[2]}}); !kept.ok()) return no_room(kept);
            if (frames_) placed_[use.placed].places.push_back(to_world);
            return {};
        });
    }

    Status no_room(const Status& why) const {
        return model_->failed(fmt::format("no room for so many instances ({}); set TMPDIR to another folder", why.message()));
    }

    Status finish_instances() {
        if (placements_->count() == 0) return {};
        if (const Status kept = placements_->finish(); !kept.ok()) return no_room(kept);
        const auto objects = std::make_shared<std::vector<StoredInstances::PlacedObject>>();
        for (uint32_t i = 0; i < scene_.objects.size(); ++i) objects->push_back({i, {}});
        const auto instances = std::make_shared<StoredInstances>(model_->name(), placements_, objects);
        RAYPAGER_TRY(instances->prepare([](const Placement&) { return Status(); }));
        scene_.instances.push_back(instances);
        return {};
    }

    Status add_shapes(const MeshKey& key, const std::vector<Transform>& joints, const Transform& to_world, std::vector<Shape>& shapes) {
        const auto& primitives = model_->content().meshes[static_cast<size_t>(key.first)].primitives;
        for (size_t i = 0; i < primitives.size(); ++i) {
            GltfReading reading;
            reading.mesh = key.first;
            reading.primitive = static_cast<int64_t>(i);
            reading.weights = key.second;
            reading.joints = joints;
            RAYPAGER_TRY(add_primitive(reading, primitives[i], to_world, shapes));
        }
        return {};
    }

    Status add_primitive(GltfReading reading, const tinygltf::Primitive& primitive, const Transform& to_world, std::vector<Shape>& shapes) {
        const std::string place = gltf_primitive_name(*model_, reading.mesh, reading.primitive);
        if (primitive.material >= 0 && !gltf_item(model_->content().materials, primitive.material))
            return model_->failed(fmt::format("{}: there is no material {}; the file is damaged", place, primitive.material));
        const auto colors = look_at_gltf_colors(*model_, primitive);
        if (!colors) return colors.status();
        GltfSurfaceUse use{*colors, false};
        if (primitive.mode == TINYGLTF_MODE_POINTS) return add_points(reading, primitive, use, to_world, shapes);
        if (primitive.mode < TINYGLTF_MODE_TRIANGLES || primitive.mode > TINYGLTF_MODE_TRIANGLE_FAN) {
            notes_.add("lines", place, "lines have no surface; they are left out");
            return {};
        }
        reading.uv_set = materials_.uv_set(primitive.material);
        bool split = false;
        if (materials_.has_normal_map(primitive.material)) {
            const auto mirrored = has_mirrored_uvs(model_, reading);
            if (!mirrored) return mirrored.status();
            split = *mirrored;
        }
        const auto add = [&](GltfPart part) -> Status {
            use.green_is_turned = (part == GltfPart::mirrored) != to_world.swaps_handedness();
            const GltfSurface surface = materials_.surface(primitive.material, use);
            if (surface.invisible) return {};
            reading.part = part;
            reading.colors = surface.vertex_colors;
            reading.color_factor = read_gltf_material(*model_, primitive.material).base;
            if (surface.glow) return add_glowing(reading, primitive.material, surface, to_world, shapes);
            add_shape(std::make_shared<GltfMesh>(model_, reading), surface, to_world, shapes);
            return {};
        };
        if (!split) return add(GltfPart::whole);
        RAYPAGER_TRY(add(GltfPart::usual));
        return add(GltfPart::mirrored);
    }

    // A shape for each group of triangles that shine about alike, and one for those that do not shine.
    Status add_glowing(GltfReading reading, int64_t material, GltfSurface surface, const Transform& to_world, std::vector<Shape>& shapes) {
        const auto image = materials_.glow_image(material);
        if (!image) return {};
        const auto glow = group_by_glow(*model_, reading, *image);
        if (!glow) return glow.status().at(model_->name() + ": " + gltf_primitive_name(*model_, reading.mesh, reading.primitive));
        reading.groups = glow->groups;
        const Float3 factor = *surface.glow;
        for (size_t group = 0; group < glow->means.size(); ++group) {
            if (std::find(glow->groups->begin(), glow->groups->end(), group) == glow->groups->end()) continue;
            const Float3& mean = glow->means[group];
            GltfSurface part = surface;
            if (group == 0)
                part.material = surface.dark_material;
            else
                part.area_light = materials_.add_light(material, {factor.x * mean.x, factor.y * mean.y, factor.z * mean.z});
            reading.group = static_cast<uint8_t>(group);
            add_shape(std::make_shared<GltfMesh>(model_, reading), part, to_world, shapes);
        }
        return {};
    }

    void add_shape(std::shared_ptr<const MeshSource> mesh, const GltfSurface& surface, const Transform& to_world, std::vector<Shape>& shapes) {
        Shape& shape = shapes.emplace_back();
        shape.name = mesh->name();
        shape.to_world = to_world;
        shape.material = surface.material;
        shape.area_light = surface.area_light;
        shape.vertex_colors = surface.vertex_colors;
        shape.mesh = std::move(mesh);
        has_light_ = has_light_ || (surface.is_lamp && surface.area_light);
        if (&shapes == &scene_.shapes && frames_) placed_.push_back({{shape.mesh}, {to_world}});
    }

    Status add_points(GltfReading reading, const tinygltf::Primitive& primitive, const GltfSurfaceUse& use, const Transform& to_world,
                      std::vector<Shape>& shapes) {
        const GltfMaterial material = read_gltf_material(*model_, primitive.material);
        reading.colors = use.colors.any;
        reading.color_factor = material.base;
        auto points = read_gltf_points(model_, reading);
        if (!points) return points.status();
        Shape& shape = shapes.emplace_back();
        shape.name = (*points)->name();
        shape.to_world = to_world;
        scene_.materials.push_back(diffuse_material(material.base));
        shape.material = static_cast<uint32_t>(scene_.materials.size() - 1);
        shape.points = std::move(*points);
        return {};
    }

    std::shared_ptr<const GltfModel> model_;
    const BareLook& look_;
    Scene scene_;
    GltfNotes notes_;
    GltfMaterials materials_;
    std::vector<GltfNode> nodes_;
    std::map<MeshKey, Use> uses_;
    std::shared_ptr<PlacementStore> placements_ = std::make_shared<PlacementStore>();
    std::vector<GltfPlaced> placed_;
    bool has_light_ = false, frames_ = true;  // frames_: it may have to be framed or lit, so places are kept
};

}  // namespace

Result<Scene> import_gltf(const std::filesystem::path& path, const BareLook& look) {
    auto model = GltfModel::open(path);
    if (!model) return model.status();
    return GltfSceneReader(std::move(*model), look).read();
}

}  // namespace raypager
