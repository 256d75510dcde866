#include "import/gltf_lights.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "import/text.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

constexpr double lumens_per_watt = 683, most_intensity = 1e12;

bool was_written_by_blender(const GltfModel& model) { return model.about().generator.find("Blender I/O") != std::string::npos; }

void put(const Vector& from, float (&to)[3]) {
    for (size_t i = 0; i < 3; ++i) to[i] = static_cast<float>(from[i]);
}

Float3 strength_of(const tinygltf::Light& light, double unit_of_file) {
    const auto channel = [&](size_t i) {
        const double value = (light.color.size() == 3 ? light.color[i] : 1) * light.intensity / unit_of_file;
        return std::isfinite(value) ? static_cast<float>(std::clamp(value, 0.0, most_intensity)) : 0.0f;
    };
    return {channel(0), channel(1), channel(2)};
}

// Down the node's -z axis.
std::optional<Vector> axis_of(const Transform& to_world) {
    const Vector z = to_world.vector(0, 0, -1);
    const double size = length(z);
    return size > 0 && std::isfinite(size) ? std::optional((1 / size) * z) : std::nullopt;
}

std::string place_of(const GltfModel& model, int64_t number) {
    const auto* node = gltf_item(model.content().nodes, number);
    return node && !node->name.empty() ? fmt::format("node {} \"{}\"", number, clipped(node->name)) : fmt::format("node {}", number);
}

struct View {
    Vector eye = {}, right = {}, up = {}, forward = {};
};

// A camera looks along -z, with +y up and +x to the right; scales do not count.
std::optional<View> view_of(const Transform& to_world) {
    const auto forward = axis_of(to_world);
    if (!forward) return std::nullopt;
    const Vector up = to_world.vector(0, 1, 0), right = cross(*forward, up);
    if (!(length(right) > 0) || !std::isfinite(length(right))) return std::nullopt;
    return View{to_world.point(0, 0, 0), unit(right), cross(unit(right), *forward), *forward};
}

// Pictures that a file says the shape of fit into the usual size.
void shape_picture(double aspect, Scene& scene) {
    const double usual = static_cast<double>(scene.width) / scene.height;
    const auto pixels = [](double n) { return static_cast<uint32_t>(std::clamp(std::round(n), 1.0, 65535.0)); };
    if (aspect > usual)
        scene.height = pixels(scene.width / aspect);
    else
        scene.width = pixels(scene.height * aspect);
}

bool can_be_used(double value) { return value > 0 && std::isfinite(value); }

}  // namespace

Status add_gltf_light(const GltfModel& model, const GltfNode& node, Scene& scene, GltfNotes& notes) {
    const auto* extension = gltf_extension(model.content().nodes[static_cast<size_t>(node.number)].extensions, "KHR_lights_punctual");
    if (!extension) return {};
    const int64_t number = gltf_index(extension, "light");
    const auto* light = gltf_item(model.content().lights, number);
    const std::string place = place_of(model, node.number);
    if (!light) return model.failed(fmt::format("{}: there is no light {}; the file is damaged", place, number));
    const auto axis = axis_of(node.to_world);
    rp_light out{};
    const Float3 strength = strength_of(*light, was_written_by_blender(model) ? lumens_per_watt : 1);
    put(vector(strength), out.radiance);
    if (light->type == "directional") {
        if (!axis) return model.failed(place + ": its light has no direction");
        out.kind = RP_LIGHT_DISTANT;
        put(-1.0 * *axis, out.p);
    } else if (light->type == "point" || light->type == "spot") {
        out.kind = RP_LIGHT_POINT;
        put(node.to_world.point(0, 0, 0), out.p);
        if (light->range > 0) notes.add("range", place, "its light goes on beyond its \"range\", as that of lamps does");
    } else {
        return model.failed(fmt::format("{}: its light is of the unknown type \"{}\"", place, clipped(light->type)));
    }
    if (light->type == "spot") {
        if (!axis) return model.failed(place + ": its light has no direction");
        const double end = std::clamp(light->spot.outerConeAngle, 1e-4, std::numbers::pi / 2);
        const double full = std::clamp(light->spot.innerConeAngle, 0.0, end);
        out.kind = RP_LIGHT_SPOT;
        put(*axis, out.e1);
        out.e2[0] = static_cast<float>(std::cos(end));
        out.e2[1] = static_cast<float>(std::cos(full));
    }
    for (const float x : out.p)
        if (!std::isfinite(x)) return model.failed(place + ": its light is too far away to compute with");
    scene.lights.push_back(out);
    return {};
}

Result<bool> take_gltf_camera(const GltfModel& model, const std::vector<GltfNode>& nodes, Scene& scene, GltfNotes& notes) {
    const GltfNode* first = nullptr;
    std::string others;
    uint64_t count = 0;
    constexpr uint64_t most_named = 4;
    for (const GltfNode& node : nodes) {
        if (model.content().nodes[static_cast<size_t>(node.number)].camera < 0) continue;
        if (!first)
            first = &node;
        else if (count++ < most_named)
            others += (others.empty() ? "" : ", ") + place_of(model, node.number);
    }
    if (!first) return false;
    const std::string place = place_of(model, first->number);
    if (count > most_named) others += fmt::format(" and {} more", count - most_named);
    if (count > 0) notes.add("cameras", place, fmt::format("of {} cameras, this one is used; others are at {}", count + 1, others));
    const auto* camera = gltf_item(model.content().cameras, model.content().nodes[static_cast<size_t>(first->number)].camera);
    const auto view = view_of(first->to_world);
    if (!camera) return model.failed(place + ": its camera does not exist; the file is damaged");
    if (!view) return model.failed(place + ": its camera looks nowhere: its transform is flat");
    double half_width = 0, half_height = 0;
    const bool perspective = camera->type == "perspective";
    if (perspective) {
        const auto& p = camera->perspective;
        if (!(p.yfov > 0 && p.yfov < std::numbers::pi)) return model.failed(fmt::format("{}: its yfov of {} is no angle of a camera", place, p.yfov));
        if (can_be_used(p.aspectRatio)) shape_picture(p.aspectRatio, scene);
        half_height = std::tan(p.yfov / 2);
        half_width = half_height * scene.width / scene.height;
    } else {
        const auto& o = camera->orthographic;
        half_width = std::abs(o.xmag);
        half_height = std::abs(o.ymag);
        if (!can_be_used(half_width) || !can_be_used(half_height))
            return model.failed(place + ": its camera sees nothing: xmag or ymag are not usable");
        shape_picture(half_width / half_height, scene);
    }
    Camera& out = scene.camera;
    out.projection = perspective ? Projection::perspective : Projection::orthographic;
    out.eye = float3(view->eye);
    out.right = float3(half_width * view->right);
    out.up = float3(half_height * view->up);
    out.forward = float3(view->forward);
    return true;
}

}  // namespace raypager
