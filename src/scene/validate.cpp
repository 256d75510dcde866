#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <span>

#include "raypager/scene.hpp"
#include "scene/check_material.hpp"
#include "scene/check_texture.hpp"
#include "scene/light_images.hpp"
#include "scene/pixel_filter.hpp"
#include "scene/projection.hpp"
#include "scene/shapes.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

// Far more than anyone renders, small enough that products of the two stay in 32 bits.
constexpr uint32_t largest_side = 65535;

bool finite(std::span<const float> values) {
    return std::all_of(values.begin(), values.end(), [](float x) { return std::isfinite(x); });
}
bool at_least(std::span<const float> values, float bound) {
    return std::all_of(values.begin(), values.end(), [&](float x) { return std::isfinite(x) && x >= bound; });
}

Status check_camera(const Scene& scene) {
    const Camera& c = scene.camera;
    if (!finite(c.eye) || !finite(c.right) || !finite(c.up) || !finite(c.forward)) return Status::failed("camera: a coordinate is not finite");
    const double determinant = double{c.right.x} * (double{c.up.y} * c.forward.z - double{c.up.z} * c.forward.y) -
                               double{c.right.y} * (double{c.up.x} * c.forward.z - double{c.up.z} * c.forward.x) +
                               double{c.right.z} * (double{c.up.x} * c.forward.y - double{c.up.y} * c.forward.x);
    if (determinant == 0) return Status::failed("camera: its axes lie in one plane; check its transform and field of view");
    if (const Status status = check_projection(c); !status.ok()) return status;
    if (const Status status = check_filter(scene.filter); !status.ok()) return status;
    for (const uint32_t side : {scene.width, scene.height})
        if (side == 0 || side > largest_side)
            return Status::failed(fmt::format("picture: {} x {} pixels; each side must be 1 to {}", scene.width, scene.height, largest_side));
    if (scene.spp == 0) return Status::failed("picture: 0 samples per pixel; at least 1 is needed");
    return {};
}

Status check_film(const FilmResponse& film) {
    if (!(film.exposure >= 0) || !std::isfinite(film.exposure)) return Status::failed("film: its exposure must be finite and 0 or more");
    if (!finite(film.color_matrix)) return Status::failed("film: its colour matrix is not finite");
    if (!(film.max_luminance >= 0) || !(film.max_xyz >= 0)) return Status::failed("film: its limits for samples must be 0 or more");
    return {};
}

Status check_light(const rp_light& light, size_t index) {
    const auto bad = [&](const char* what) { return Status::failed(fmt::format("light {}: {}", index, what)); };
    if (!at_least(std::span(light.radiance), 0)) return bad("its radiance must be finite and 0 or more");
    const std::span p(light.p);
    switch (light.kind) {
        case RP_LIGHT_INFINITE:
            return {};
        case RP_LIGHT_POINT:
        case RP_LIGHT_SPOT:
        case RP_LIGHT_PROJECTION:
            return finite(p) && finite(light.e1) && finite(light.e2) ? Status() : bad("its position or its axes are not finite");
        case RP_LIGHT_DISTANT: {
            const double length = std::hypot(double{p[0]}, double{p[1]}, double{p[2]});
            return std::abs(length - 1) < 1e-3 ? Status() : bad("its direction is not a unit vector");
        }
        case RP_LIGHT_TRIANGLE:
        case RP_LIGHT_SPHERE:
            if (!(light.flags & RP_LIGHT_UNSEEN)) return bad("surfaces that are seen shine as shapes");
            if (!finite(p) || !finite(light.e1) || !finite(light.e2)) return bad("its place is not finite");
            return light.area > 0 && std::isfinite(light.area) ? Status() : bad("its area must be finite and more than 0");
        default:
            return bad("of an unknown kind");
    }
}

Status check_shape(const Scene& scene, const Shape& shape) {
    const auto bad = [&](const std::string& what) { return Status::failed(shape.name + ": " + what); };
    if (shape.material >= scene.materials.size()) return bad(fmt::format("material {} does not exist", shape.material));
    if (shape.area_light && *shape.area_light >= scene.area_lights.size()) return bad(fmt::format("area light {} does not exist", *shape.area_light));
    if (shape.area_light && may_be_nothing(scene.materials, shape.material)) return bad("what shines cannot be cut out; give it another material");
    const auto& m = shape.to_world.m;
    for (const auto& row : m)
        for (const double x : row)
            if (!std::isfinite(x)) return bad("its transform is not finite");
    if (m[3] != std::array<double, 4>{0, 0, 0, 1}) return bad("its transform is projective; only affine ones can place a shape");
    if (shape.mesh) return {};
    if (shape.points) {
        if (shape.unseen) return bad("only meshes and spheres can shine unseen");
        if (!at_least(std::array{shape.point_radius, shape.radius_scale}, 0) || shape.radius_scale == 0)
            return bad("the radius of its points must be 0 or more, and their scale more than 0");
        return {};
    }
    if (!finite(shape.sphere.center) || !(shape.sphere.radius > 0) || !std::isfinite(shape.sphere.radius))
        return bad("a sphere needs a finite centre and a radius of more than 0");
    return {};
}

Status check_shape_of_object(const Shape& shape) {
    const auto bad = [&](const std::string& what) { return Status::failed(fmt::format("{}: {}", shape.name, what)); };
    // So many a range can tell apart, which have to be set anew for each instance.
    if (shape.area_light && *shape.area_light >= RP_RANGE_AREA_LIGHTS)
        return bad(fmt::format("only the first {} area lights can be those of objects", RP_RANGE_AREA_LIGHTS));
    if (shape.backdrop) return bad("a backdrop cannot be part of an object");
    return {};
}

// Which objects the placements name is checked as they are streamed, and whether these are all materials that they have.
Status check_instances(const Scene& scene) {
    if (scene.objects.size() >= RP_NONE) return Status::failed(fmt::format("{} objects; there can be {}", scene.objects.size(), RP_NONE - 1));
    uint64_t count = 0;
    const auto add = [&](const std::vector<std::shared_ptr<const InstanceSource>>& sources) -> Status {
        for (const auto& source : sources) {
            if (!source) return Status::failed("a source of instances is missing");
            const uint64_t more = source->count();
            if (more >= RP_NONE - count)
                return Status::failed(fmt::format("{}: the scene has more than {} instances with it", source->name(), RP_NONE - 1));
            count += more;
            for (const auto& [object, material] : source->materials()) {
                if (object >= scene.objects.size()) return Status::failed(fmt::format("{}: object {} does not exist", source->name(), object));
                if (material >= scene.materials.size())
                    return Status::failed(fmt::format("{}: material {} of instances does not exist", source->name(), material));
            }
        }
        return {};
    };
    RAYPAGER_TRY(add(scene.instances));
    for (const Object& object : scene.objects) RAYPAGER_TRY(add(object.instances));
    if (count > 0 && scene.objects.empty()) return Status::failed("there are instances, but no objects");
    return {};
}

}  // namespace

Status validate(const Scene& scene) {
    RAYPAGER_TRY(check_camera(scene));
    RAYPAGER_TRY(check_film(scene.film));
    for (size_t i = 0; i < scene.materials.size(); ++i) RAYPAGER_TRY(check_material(scene.materials, i));
    for (size_t i = 0; i < scene.area_lights.size(); ++i) {
        const Float3& l = scene.area_lights[i].radiance;
        if (!at_least(std::array{l.x, l.y, l.z}, 0))
            return Status::failed(fmt::format("area light {}: its radiance must be finite and 0 or more", i));
        if (!at_least(std::array{scene.area_lights[i].power}, 0))
            return Status::failed(fmt::format("area light {}: its power must be finite and 0 or more", i));
    }
    size_t infinite = 0;
    for (size_t i = 0; i < scene.lights.size(); ++i) {
        RAYPAGER_TRY(check_light(scene.lights[i], i));
        if (scene.lights[i].kind == RP_LIGHT_INFINITE && ++infinite > 1) return Status::failed("more than one infinite light; add them up");
    }
    RAYPAGER_TRY(check_light_images(scene.light_images, scene.lights));
    RAYPAGER_TRY(check_textures({scene.texture_ops, scene.texture_maps, scene.materials, scene.images.size()}).at("textures"));
    RAYPAGER_TRY(for_each_shape(scene, [&](const Shape& shape) { return check_shape(scene, shape); }));
    for (const Object& object : scene.objects)
        for (const Shape& shape : object.shapes) RAYPAGER_TRY(check_shape_of_object(shape));
    return check_instances(scene);
}

}  // namespace raypager
