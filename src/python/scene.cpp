// Scenes: loaded, or built from arrays.
#include "raypager/scene.hpp"

#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <iterator>

#include "python/arrays.hpp"
#include "python/bindings.hpp"
#include "python/errors.hpp"
#include "python/sources.hpp"
#include "raypager/camera_text.hpp"
#include "raypager/import.hpp"
#include "raypager/materials.hpp"
#include "raypager/sky.hpp"

namespace raypager::python {
namespace {

using Triple = std::array<float, 3>;
using Axes = std::array<Triple, 3>;

// An object of a scene, or, without one, the world.
using Where = std::optional<uint32_t>;

std::vector<Shape>& shapes_of(Scene& scene, Where object) { return object ? scene.objects.at(*object).shapes : scene.shapes; }

// Before backdrops, which come last.
void put(Scene& scene, Where object, Shape shape) {
    auto& shapes = shapes_of(scene, object);
    auto at = shapes.end();
    while (!shape.backdrop && at != shapes.begin() && std::prev(at)->backdrop) --at;
    shapes.insert(at, std::move(shape));
}

void add_mesh(Scene& scene, Where object, Shape shape, const Table<float, 3>& positions, const Table<uint32_t, 3>& triangles,
              const std::optional<Table<float, 3>>& normals, const std::optional<Table<float, 2>>& uvs, const std::optional<Column<uint32_t>>& colors,
              std::vector<std::string> files) {
    MeshRows rows{rows_of<Float3>(positions), rows_of<Triangle>(triangles), rows_of<Float3>(normals), rows_of<Float2>(uvs),
                  rows_of<uint32_t>(colors)};
    shape.mesh = std::make_shared<ArrayMesh>(shape.name, std::move(rows), std::move(files));
    put(scene, object, std::move(shape));
}

void add_points(Scene& scene, Where object, Shape shape, const Table<float, 3>& positions, const std::optional<Column<float>>& radii,
                const std::optional<Column<uint32_t>>& colors, std::vector<std::string> files) {
    PointRows rows{rows_of<Float3>(positions), rows_of<float>(radii), rows_of<uint32_t>(colors)};
    shape.points = std::make_shared<ArrayPoints>(shape.name, std::move(rows), std::move(files));
    put(scene, object, std::move(shape));
}

void add_chunks(Scene& scene, Where object, Shape shape, nb::object chunks, uint64_t count, bool has_color) {
    shape.points = std::make_shared<ChunkedPoints>(shape.name, std::move(chunks), count, has_color);
    put(scene, object, std::move(shape));
}

void add_sphere(Scene& scene, Where object, Shape shape, const Triple& center, float radius) {
    shape.sphere = {float3(center), radius};
    put(scene, object, std::move(shape));
}

void add_instances(Scene& scene, Where parent, uint32_t object, const std::string& name, const Matrices& transforms,
                   const std::optional<Column<uint32_t>>& materials, const std::optional<Table<float, 3>>& colors) {
    InstanceRows rows{object, rows_of<std::array<std::array<double, 4>, 3>>(transforms), rows_of<uint32_t>(materials), rows_of<Float3>(colors)};
    auto& sources = parent ? scene.objects.at(*parent).instances : scene.instances;
    sources.push_back(std::make_shared<ArrayInstances>(name, std::move(rows)));
}

std::shared_ptr<ImageSource> texture_image(const std::string& name, uint32_t width, uint32_t height, uint32_t channels, const std::string& kind,
                                           bool srgb, bool has_alpha, const Column<uint8_t>& texels) {
    const TexelKind texel = kind == "uint8" ? TexelKind::unsigned_8 : kind == "uint16" ? TexelKind::unsigned_16 : TexelKind::half;
    return std::make_shared<ArrayImage>(name, ImageShape{width, height, channels, texel, srgb, has_alpha}, rows_of<std::byte>(texels));
}

// globe: an image that is twice as wide as high, unrolled like the map of a globe.
void set_sky_image(Scene& scene, const Pixels& pixels, const Axes& axes, bool globe) {
    Image image = image_of(pixels);
    check(without_gil([&] {
        if (globe) image = sky_of_globe(image);
        return set_sky(scene, image, {float3(axes[0]), float3(axes[1]), float3(axes[2])});
    }));
}

Camera camera_of(const Triple& eye, const std::array<double, 3>& target, const std::array<double, 3>& up, double fov, uint32_t width, uint32_t height,
                 bool mirrored) {
    const auto camera = make_exact_camera(float3(eye), target, up, fov, width, height, !mirrored);
    if (!camera)
        raise(Status::usage("camera: has no direction; give a target that is not the eye, and an up that is not along the line between them"));
    return *camera;
}

template <Float3 Camera::*member>
void vector_of(nb::class_<Camera>& camera, const char* name) {
    camera.def_prop_rw(
        name,
        [](const Camera& c) {
            return Triple{(c.*member).x, (c.*member).y, (c.*member).z};
        },
        [](Camera& c, const Triple& value) { c.*member = float3(value); });
}

void add_camera(nb::module_& module) {
    nb::class_<Camera> camera(module, "Camera", "Where a picture is taken from, and how.");
    vector_of<&Camera::eye>(camera, "eye");
    vector_of<&Camera::right>(camera, "right");
    vector_of<&Camera::up>(camera, "up");
    vector_of<&Camera::forward>(camera, "forward");
    camera
        .def_prop_rw(
            "projection", [](const Camera& c) { return static_cast<uint32_t>(c.projection); },
            [](Camera& c, uint32_t value) { c.projection = static_cast<Projection>(std::min(value, uint32_t{3})); })
        .def_rw("lens_radius", &Camera::lens_radius)
        .def_rw("focal_distance", &Camera::focal_distance)
        .def_rw("window", &Camera::window)
        .def("__copy__", [](const Camera& c) { return c; });
    module.def("make_camera", &camera_of);
    module.def("camera_of_text", [](const std::string& text, uint32_t width, uint32_t height) {
        const auto camera = make_camera(value_of(parse_camera(text)), width, height);
        if (!camera) raise(Status::usage("'" + text + "' has no direction; give other points"));
        return *camera;
    });
    module.def("fit_camera", &fit_camera);
}

void add_shape(nb::module_& module) {
    nb::class_<Shape>(module, "Shape")
        .def(nb::init<>())
        .def_rw("name", &Shape::name)
        .def_prop_rw(
            "to_world", [](const Shape& shape) { return shape.to_world.m; },
            [](Shape& shape, const std::array<std::array<double, 4>, 4>& matrix) { shape.to_world.m = matrix; })
        .def_rw("reverse_orientation", &Shape::reverse_orientation)
        .def_rw("material", &Shape::material)
        .def_rw("area_light", &Shape::area_light, nb::arg().none())
        .def_rw("unseen", &Shape::unseen)
        .def_rw("point_radius", &Shape::point_radius)
        .def_rw("radius_scale", &Shape::radius_scale)
        .def_rw("keep_uvs", &Shape::keep_uvs)
        .def_rw("backdrop", &Shape::backdrop);
}

void add_import(nb::module_& module) {
    nb::class_<BareLook>(module, "BareLook")
        .def(nb::init<>())
        .def_rw("material", &BareLook::material, nb::arg().none())
        .def_prop_rw(
            "sky", [](const BareLook&) { return nb::none(); }, [](BareLook& look, const Triple& color) { look.sky = float3(color); })
        .def_prop_ro("says_light", [](const BareLook& look) { return look.sky || look.light.kind != BareLight::Kind::usual; })
        .def_rw("no_ground", &BareLook::no_ground)
        .def_rw("width", &BareLook::width)
        .def_rw("height", &BareLook::height)
        .def("set_light", [](BareLook& look, const std::string& kind, double strength, std::optional<std::array<double, 2>> place) {
            look.light.kind = kind == "none"  ? BareLight::Kind::none
                              : kind == "key" ? BareLight::Kind::key
                              : kind == "sun" ? BareLight::Kind::sun
                                              : BareLight::Kind::usual;
            look.light.strength = strength;
            if (place) look.light.place = BareLight::Place{(*place)[0], (*place)[1]};
        });
    module.def(
        "load",
        [](const std::vector<std::filesystem::path>& inputs, const BareLook& look, const std::string& columns, uint64_t host_limit) {
            ImportOptions options;
            options.look = look;
            if (!columns.empty()) options.columns = value_of(parse_point_columns(columns));
            if (host_limit) options.keep_bytes = std::min(default_keep_bytes, host_limit / 8);
            return value_of(without_gil([&] { return import_scene(inputs, options); }));
        },
        nb::arg("inputs"), nb::arg("look"), nb::arg("columns"), nb::arg("host_limit"));
    // points: in world space.
    module.def("complete_scene", [](Scene& scene, const BareLook& look, bool has_camera, bool has_light, bool z_up, const Table<double, 3>& points) {
        const auto rows = rows_of<std::array<double, 3>>(points);
        check(without_gil([&] { return complete_scene(look, {has_camera, has_light, z_up}, rows.values, scene); }));
    });
}

}  // namespace

void add_scene(nb::module_& module) {
    add_camera(module);
    add_shape(module);
    module.def("texture_image", &texture_image);
    nb::class_<Scene>(module, "Scene")
        .def(nb::init<>())
        .def_rw("width", &Scene::width)
        .def_rw("height", &Scene::height)
        .def_rw("spp", &Scene::spp)
        .def_rw("max_depth", &Scene::max_depth)
        .def_rw("camera", &Scene::camera)
        .def_rw("warnings", &Scene::warnings)
        .def_rw("files", &Scene::files)
        .def_prop_rw(
            "exposure", [](const Scene& scene) { return scene.film.exposure; }, [](Scene& scene, float value) { scene.film.exposure = value; })
        .def_prop_ro("materials", [](const Scene& scene) { return scene.materials.size(); })
        .def("add_area_light",
             [](Scene& scene, const Triple& radiance, bool two_sided, float power) {
                 scene.area_lights.push_back({float3(radiance), two_sided, power});
                 return static_cast<uint32_t>(scene.area_lights.size() - 1);
             })
        .def("add_object",
             [](Scene& scene, const std::string& name) {
                 scene.objects.push_back({name, {}});
                 return static_cast<uint32_t>(scene.objects.size() - 1);
             })
        .def("add_light", [](Scene& scene, const rp_light& light) { scene.lights.push_back(light); })
        .def("add_mesh", &add_mesh)
        .def("add_points", &add_points)
        .def("add_chunks", &add_chunks)
        .def("add_sphere", &add_sphere)
        .def("add_instances", &add_instances)
        .def("set_sky", &set_sky_image)
        .def(
            "copy_for_bake",
            [](const Scene& scene) {
                Scene copy = scene;
                prepare_spheres(copy);
                check(validate(copy));
                return copy;
            },
            "A copy that shares all arrays, checked, with textures around its spheres.");
    add_import(module);
}

}  // namespace raypager::python
