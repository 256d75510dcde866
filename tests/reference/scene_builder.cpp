#include "reference/scene_builder.hpp"

#include <stdexcept>

#include "base/check.hpp"
#include "raypager/sky.hpp"
#include "scene/emitters.hpp"

namespace raypager::reference {
namespace {

void store(float* out, const Vec3& value) {
    const Float3 rounded = value.to_float();
    out[0] = rounded.x, out[1] = rounded.y, out[2] = rounded.z;
}

}  // namespace

rp_material diffuse(const Vec3& reflectance) {
    rp_material m{};
    m.kind = RP_MATERIAL_DIFFUSE;
    store(m.color, reflectance);
    return m;
}

rp_material conductor(const Vec3& eta, const Vec3& k, double alpha) {
    rp_material m{};
    m.kind = RP_MATERIAL_CONDUCTOR;
    m.alpha = static_cast<float>(alpha);
    store(m.eta, eta);
    store(m.k, k);
    return m;
}

rp_material glass(double ior) {
    rp_material m{};
    m.kind = RP_MATERIAL_DIELECTRIC;
    m.ior = static_cast<float>(ior);
    return m;
}

rp_material absorber() {
    rp_material m{};
    m.kind = RP_MATERIAL_ABSORBING;
    return m;
}

SceneBuilder::SceneBuilder(PictureSize size) {
    scene_.width = size.width;
    scene_.height = size.height;
}

uint32_t SceneBuilder::material(const rp_material& material) {
    scene_.materials.push_back(material);
    return static_cast<uint32_t>(scene_.materials.size() - 1);
}

void SceneBuilder::camera(const Vec3& eye, const Vec3& target, const Vec3& up, double fov_degrees) {
    const std::optional<Camera> made = make_camera(eye.to_float(), target.to_float(), up.to_float(), fov_degrees, scene_.width, scene_.height);
    RAYPAGER_CHECK(made.has_value());
    scene_.camera = *made;
}

Shape& SceneBuilder::add(std::string name, TriangleMesh mesh, uint32_t material, const Transform& to_world) {
    Shape shape;
    shape.name = name;
    shape.to_world = to_world;
    shape.material = material;
    shape.mesh = std::make_shared<MeshInMemory>(std::move(name), std::move(mesh));
    return scene_.shapes.emplace_back(std::move(shape));
}

Shape& SceneBuilder::add_sphere(std::string name, const Vec3& center, double radius, uint32_t material) {
    Shape shape;
    shape.name = std::move(name);
    shape.material = material;
    shape.sphere = {.center = center.to_float(), .radius = static_cast<float>(radius)};
    return scene_.shapes.emplace_back(std::move(shape));
}

Shape& SceneBuilder::add_points(std::string name, std::vector<CloudPoint> points, bool has_color, uint32_t material) {
    Shape shape;
    shape.name = name;
    shape.material = material;
    shape.points = std::make_shared<PointsInMemory>(std::move(name), std::move(points), has_color);
    return scene_.shapes.emplace_back(std::move(shape));
}

void SceneBuilder::shine(Shape& shape, const Vec3& radiance, bool two_sided) {
    shape.area_light = static_cast<uint32_t>(scene_.area_lights.size());
    scene_.area_lights.push_back({.radiance = radiance.to_float(), .two_sided = two_sided});
}

void SceneBuilder::infinite_light(const Vec3& radiance) {
    rp_light light{};
    light.kind = RP_LIGHT_INFINITE;
    store(light.radiance, radiance);
    scene_.lights.push_back(light);
}

void SceneBuilder::distant_light(const Vec3& towards_light, const Vec3& irradiance) {
    rp_light light{};
    light.kind = RP_LIGHT_DISTANT;
    store(light.p, normalized(towards_light));
    store(light.radiance, irradiance);
    scene_.lights.push_back(light);
}

void SceneBuilder::unseen_light(const rp_light& light) { scene_.lights.push_back(unseen(light)); }

void SceneBuilder::point_light(const Vec3& position, const Vec3& intensity) {
    rp_light light{};
    light.kind = RP_LIGHT_POINT;
    store(light.p, position);
    store(light.radiance, intensity);
    scene_.lights.push_back(light);
}

void SceneBuilder::sky(const Image& image, const std::array<Float3, 3>& axes) { RAYPAGER_CHECK(set_sky(scene_, image, axes).ok()); }

void SceneBuilder::lamp(rp_light light, const Image* image) {
    if (image) {
        auto packed = light_image_of(*image);
        RAYPAGER_CHECK(packed.ok());
        scene_.light_images.push_back(*packed);
        light.flags |= static_cast<rp_u32>(scene_.light_images.size()) << RP_LIGHT_IMAGE_SHIFT;
    }
    scene_.lights.push_back(light);
}

Scene SceneBuilder::finish() {
    if (const Status valid = validate(scene_); !valid.ok()) throw std::runtime_error(valid.message());
    return std::move(scene_);
}

}  // namespace raypager::reference
