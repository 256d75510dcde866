// The scenes whose light is checked.
#include "reference/scenes.hpp"

#include <cmath>
#include <numbers>

#include "base/check.hpp"
#include "raypager/materials.hpp"
#include "reference/scene_builder.hpp"
#include "scene/emitters.hpp"

namespace raypager::reference {
namespace {

Vec3 grey(double value) { return Vec3(value); }

}  // namespace

// The room is [-1, 1]^3, seen along -z; its front is open.
Scene cornell_small(const CornellOptions& options, PictureSize size) {
    SceneBuilder scene(size);
    const uint32_t white = scene.material(diffuse(grey(0.73))), red = scene.material(diffuse({0.63, 0.06, 0.05})),
                   green = scene.material(diffuse({0.14, 0.45, 0.09})), mirror = scene.material(conductor({0.2, 0.9, 1.1}, {3.9, 2.5, 2.4}, 0)),
                   clear = scene.material(glass(1.5)), rough = scene.material(conductor({1.3, 1.0, 0.7}, {7.5, 6.4, 5.3}, 0.25)),
                   black = scene.material(absorber());
    const uint32_t n = options.wall_divisions;
    scene.camera({0, 0, 3.6}, {0, 0, 0}, {0, 1, 0}, 42);
    scene.add("floor", quad({-1, -1, 1}, {2, 0, 0}, {0, 0, -2}, n), white);
    scene.add("ceiling", quad({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, n), white);
    scene.add("back", quad({-1, -1, -1}, {2, 0, 0}, {0, 2, 0}, n), white);
    scene.add("left", quad({-1, -1, 1}, {0, 0, -2}, {0, 2, 0}, n), red);
    scene.add("right", quad({1, -1, -1}, {0, 0, 2}, {0, 2, 0}, n), green);
    scene.shine(scene.add("light", quad({-0.5, 0.98, -0.5}, {1, 0, 0}, {0, 0, 1}), black), {5, 4, 2.6});
    const auto ball = [&](const char* name, const Vec3& center, double radius, uint32_t material) {
        if (options.sphere_primitives) {
            scene.add_sphere(name, center, radius, material);
        } else {
            scene.add(name, icosphere(radius, options.subdivisions, options.smooth_normals), material,
                      Transform::translate(center.x, center.y, center.z));
        }
    };
    ball("mirror", {-0.5, -0.62, -0.45}, 0.36, mirror);
    ball("glass", {0.45, -0.65, 0.35}, 0.33, clear);
    scene.add("block", box({-0.25, -0.5, -0.25}, {0.25, 0.5, 0.25}, n), rough,
              Transform::translate(0.4, -0.495, -0.5) * Transform::rotate(25, 0, 1, 0));
    return scene.finish();
}

Scene cornell_unseen(PictureSize size) {
    SceneBuilder scene(size);
    const uint32_t white = scene.material(diffuse(grey(0.73))), rough = scene.material(conductor({1.3, 1.0, 0.7}, {7.5, 6.4, 5.3}, 0.25));
    scene.camera({0, 0, 3.6}, {0, 0, 0}, {0, 1, 0}, 42);
    scene.add("floor", quad({-1, -1, 1}, {2, 0, 0}, {0, 0, -2}, 4), white);
    scene.add("ceiling", quad({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, 4), white);
    scene.add("back", quad({-1, -1, -1}, {2, 0, 0}, {0, 2, 0}, 4), white);
    scene.add_sphere("rough", {-0.45, -0.6, -0.3}, 0.4, rough);
    scene.add_sphere("white", {0.5, -0.6, 0.1}, 0.4, white);
    scene.unseen_light(sphere_light({0, 0.1f, 0.6f}, 0.15f, {{9, 7, 5}}));
    scene.unseen_light(triangle_light({-0.9f, 0.5f, 0.2f}, {-0.6f, 0.5f, 0.2f}, {-0.9f, 0.8f, -0.2f}, {{2, 6, 9}, true}));
    scene.unseen_light(triangle_light({0.9f, 0.5f, 0.2f}, {0.9f, 0.8f, -0.2f}, {0.6f, 0.5f, 0.2f}, {{9, 3, 3}}));
    return scene.finish();
}

Scene balls_on_a_floor(ViewKind view, const PixelFilter& filter, PictureSize size) {
    SceneBuilder scene(size);
    const uint32_t white = scene.material(diffuse(grey(0.8))), blue = scene.material(diffuse({0.1, 0.2, 0.7})),
                   red = scene.material(diffuse({0.7, 0.1, 0.1})), mirror = scene.material(conductor({0.2, 0.9, 1.5}, {3.9, 2.5, 1.8}, 0));
    for (int i = -4; i < 4; i++)
        for (int k = -8; k < 2; k++)
            scene.add("floor", quad({double(i), -1, double(k) + 1}, {1, 0, 0}, {0, 0, -1}, 4), (i + k) % 2 == 0 ? white : blue);
    scene.add("near", icosphere(0.4, 3), red, Transform::translate(-0.5, -0.6, 0.9));
    scene.add("middle", icosphere(0.5, 3), mirror, Transform::translate(0.4, -0.5, -1));
    scene.add("far", icosphere(0.8, 3), red, Transform::translate(-0.9, -0.2, -4));
    const Vec3 eye(0.2, 0.3, 3), target(0, -0.4, -1);
    scene.camera(eye, target, {0, 1, 0}, 40);
    Camera& camera = scene.camera();
    switch (view) {
        case ViewKind::lens:
            camera.lens_radius = 0.15f;
            camera.focal_distance = static_cast<float>(length(target - eye));
            break;
        case ViewKind::orthographic:
        case ViewKind::orthographic_lens:
            camera.projection = Projection::orthographic;
            camera.right = (2 / length(Vec3(camera.up)) * Vec3(camera.right)).to_float();
            camera.up = (2 / length(Vec3(camera.up)) * Vec3(camera.up)).to_float();
            if (view == ViewKind::orthographic) break;
            camera.lens_radius = 0.2f;
            camera.focal_distance = 4;
            break;
        case ViewKind::equirectangular:
        case ViewKind::equal_area:
            camera.projection = view == ViewKind::equal_area ? Projection::equal_area : Projection::equirectangular;
            for (Float3* axis : {&camera.right, &camera.up, &camera.forward}) *axis = normalized(Vec3(*axis)).to_float();
            camera.eye = {0.1f, 0.1f, 0};
            break;
        case ViewKind::shifted:
            camera.forward = (Vec3(camera.forward) + 0.25 * Vec3(camera.right) - 0.3 * Vec3(camera.up)).to_float();
            break;
    }
    scene.filter(filter);
    scene.infinite_light({1, 0.9, 0.8});
    scene.point_light({2, 3, 2}, {9, 9, 9});
    Scene result = scene.finish();
    result.max_depth = 3;
    return result;
}

namespace {

// Colours that vary slowly, and one bright spot.
Image spotted_image(uint32_t width, uint32_t height, double spot) {
    Image image{width, height, 3, {}};
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++) {
            const double s = (x + 0.5) / width, t = (y + 0.5) / height;
            const double bright = x == width / 3 && y == height / 2 ? spot : 0;
            for (const double v : {0.2 + 0.6 * s * s + bright, 0.5 + 0.3 * std::sin(6 * t) + 0.8 * bright, 0.9 - 0.7 * s * t + 0.5 * bright})
                image.values.push_back(static_cast<float>(v));
        }
    return image;
}

void put(float (&to)[3], const Vec3& from) { to[0] = float(from.x), to[1] = float(from.y), to[2] = float(from.z); }

}  // namespace

Image spotted_sky(uint32_t pixels) { return spotted_image(pixels, pixels, pixels / 2.0); }

Scene sky_small(uint32_t n, PictureSize size, uint32_t pixels) {
    SceneBuilder scene(size);
    TriangleMesh mesh = patch(n, n, [](double s, double t) { return Vec3(8 * (s - 0.5), 8 * (t - 0.5), 0.3 * std::sin(9 * s) * std::cos(7 * t)); });
    add_normals(mesh);
    scene.add("hills", std::move(mesh), scene.material(diffuse({0.6, 0.5, 0.4})));
    scene.add_sphere("mirror", {-1.6, -1, 0.9}, 0.6, scene.material(conductor({0.2, 0.9, 1.1}, {3.9, 2.5, 2.4}, 0)));
    scene.add("rough", icosphere(0.6, 3, true), scene.material(conductor({1.3, 1.0, 0.7}, {7.5, 6.4, 5.3}, 0.25)), Transform::translate(0, -1, 0.9));
    scene.add_sphere("glass", {1.6, -1, 0.9}, 0.6, scene.material(glass(1.5)));
    scene.camera({0, -6, 2.2}, {0, 0, 0.5}, {0, 0, 1}, 45);
    const Frame frame(normalized({0.3, -0.5, 0.8}));
    scene.sky(spotted_sky(pixels), {frame.x.to_float(), (-frame.y).to_float(), frame.z.to_float()});
    return scene.finish();
}

Scene lamps_small(PictureSize size) {
    SceneBuilder scene(size);
    const uint32_t white = scene.material(diffuse(grey(0.73))), rough = scene.material(conductor({1.3, 1.0, 0.7}, {7.5, 6.4, 5.3}, 0.25));
    scene.camera({0, 0, 3.6}, {0, 0, 0}, {0, 1, 0}, 42);
    scene.add("floor", quad({-1, -1, 1}, {2, 0, 0}, {0, 0, -2}, 4), white);
    scene.add("back", quad({-1, -1, -1}, {2, 0, 0}, {0, 2, 0}, 4), white);
    scene.add_sphere("rough", {-0.45, -0.6, -0.3}, 0.4, rough);
    scene.add_sphere("white", {0.5, -0.6, 0.1}, 0.4, white);
    rp_light spot{}, fading{}, lantern{}, projector{};
    spot.kind = fading.kind = RP_LIGHT_SPOT;
    put(spot.p, {0.8, 0.9, 0.8});
    put(spot.e1, normalized({-0.6, -1.2, -0.8}));
    put(spot.e2, {0.85, 0.95, 0});
    put(spot.radiance, {6, 5, 3});
    put(fading.p, {-0.9, 0.5, 0.9});
    put(fading.e1, normalized({0.5, -1, -0.6}));
    put(fading.e2, {0.5, 1, 1});
    put(fading.radiance, {1, 2, 4});
    scene.lamp(spot);
    scene.lamp(fading);
    const Image all_around = spotted_image(16, 16, 6), slide = spotted_image(20, 12, 2);
    lantern.kind = RP_LIGHT_POINT;
    const Frame frame(normalized({0.5, 0.2, -0.6}));
    put(lantern.p, {-0.2, 0.2, 0.3});
    put(lantern.e1, frame.x);
    put(lantern.e2, frame.y);
    put(lantern.radiance, {0.8, 0.8, 0.8});
    lantern.flags = RP_LIGHT_MIRRORED;
    scene.lamp(lantern, &all_around);
    projector.kind = RP_LIGHT_PROJECTION;
    put(projector.p, {0.2, 0.3, 1.5});
    put(projector.e1, Vec3(0.5, 0, 0));
    put(projector.e2, Vec3(0, 0.3, 0));
    projector.flags = RP_LIGHT_MIRRORED;  // towards -z
    put(projector.radiance, {7, 7, 7});
    scene.lamp(projector, &slide);
    Scene result = scene.finish();
    result.max_depth = 3;
    return result;
}

Furnace furnace(FurnaceKind kind, double albedo, double alpha, uint32_t subdivisions, PictureSize size) {
    SceneBuilder scene(size);
    const Vec3 much(1e5);  // of an extinction so strong that nothing is lost: 1 - F is about 4 eta / k^2
    uint32_t material = 0, max_depth = 1;
    double expected = 1;
    switch (kind) {
        case FurnaceKind::closed:
            max_depth = 12;
            expected = albedo == 1 ? max_depth + 1 : (1 - std::pow(albedo, max_depth + 1)) / (1 - albedo);
            [[fallthrough]];
        case FurnaceKind::diffuse:
            material = scene.material(diffuse(grey(albedo)));
            break;
        case FurnaceKind::mirror:
            material = scene.material(conductor(grey(1), much, 0));
            break;
        case FurnaceKind::rough_conductor:
            material = scene.material(conductor(grey(1), much, alpha));
            break;
        case FurnaceKind::glass:
            material = scene.material(glass(1.5));
            max_depth = 64;  // of light that is reflected inside again and again at most 1e-6 is left
            break;
    }
    if (kind == FurnaceKind::diffuse) expected = albedo;
    Shape& shape = subdivisions ? scene.add("ball", icosphere(1, subdivisions), material) : scene.add_sphere("ball", {0, 0, 0}, 1, material);
    if (kind == FurnaceKind::closed) {
        scene.camera({0.2, 0.3, -0.1}, {0, 0, 0}, {0, 1, 0}, 70);
        // Inwards through the orientation where that can be said of the shape, else on both sides.
        shape.reverse_orientation = subdivisions > 0;
        scene.shine(shape, grey(1), subdivisions == 0);
    } else {
        scene.camera({0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 16);  // to 0.56 from the middle at distance 4: within an icosahedron, too
        scene.infinite_light(grey(1));
    }
    Furnace result{scene.finish(), expected};
    result.scene.max_depth = max_depth;
    return result;
}

Furnace thin_prism(double length, PictureSize size) {
    constexpr uint32_t sides = 10;
    constexpr double radius = 0.014;
    const Vec3 along = normalized(Vec3(1, 0.3, 1)), across = normalized(cross(along, Vec3(0, 1, 0))), up = cross(across, along);
    TriangleMesh mesh;
    for (uint32_t i = 0; i < sides; i++) {
        const double angle = 2 * std::numbers::pi * i / sides;
        const Vec3 from_axis = across * (radius * std::cos(angle)) + up * (radius * std::sin(angle));
        for (const double end : {-length / 2, length / 2}) {
            const Vec3 p = from_axis + along * end;
            mesh.positions.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
        }
        const uint32_t a = 2 * i, b = 2 * ((i + 1) % sides);
        mesh.triangles.push_back({a, b, a + 1});
        mesh.triangles.push_back({a + 1, b, b + 1});
    }
    SceneBuilder scene(size);
    scene.add("prism", std::move(mesh), scene.material(diffuse(grey(0.5))));
    scene.camera(across * 0.1 + up * 0.05, {0, 0, 0}, along, 6);
    scene.infinite_light(grey(1));
    Furnace result{scene.finish(), 0.5};
    result.scene.max_depth = 5;
    return result;
}

namespace {

// Two rows of balls on a floor, below a wide lamp, a point light and a dim sky.
Scene rows_of_balls(const std::vector<rp_material>& materials, const std::vector<uint32_t>& shown, PictureSize size) {
    SceneBuilder scene(size);
    for (const rp_material& material : materials) scene.material(material);
    const uint32_t floor = scene.material(diffuse({0.6, 0.5, 0.4})), dark = scene.material(absorber());
    scene.add("floor", quad({-8, 0, 8}, {16, 0, 0}, {0, 0, -16}, 4), floor);
    for (size_t i = 0; i < shown.size(); i++) {
        const double x = 2.2 * static_cast<double>(i % 4) - 3.3, z = i < 4 ? 0 : -2.4;
        scene.add("ball " + std::to_string(i), icosphere(1, 3, true), shown[i], Transform::translate(x, 1.02, z));
    }
    scene.shine(scene.add("lamp", quad({-3, 6, -4}, {6, 0, 0}, {0, 0, 6}), dark), Vec3(3));
    scene.point_light({2, 5, 5}, Vec3(12));
    scene.infinite_light({0.3, 0.35, 0.4});
    scene.camera({0, 4, 9}, {0, 0.8, -1}, {0, 1, 0}, 32);
    Scene result = scene.finish();
    result.max_depth = 6;
    return result;
}

// Kinds for which importers alone have a use, so nothing else makes them.
rp_material layers(uint32_t flags, double ior, double alpha, const Vec3& color, const Vec3& specular) {
    rp_material m{};
    m.kind = RP_MATERIAL_LAYERED;
    m.flags = flags;
    m.ior = static_cast<float>(ior);
    m.alpha = static_cast<float>(alpha);
    for (int k = 0; k < 3; k++) m.color[k] = static_cast<float>(color[k]), m.specular[k] = static_cast<float>(specular[k]);
    return m;
}

}  // namespace

Scene coated_balls(PictureSize size) {
    return rows_of_balls({layers(0, 1.5, 0.15, {0.4, 0.2, 0.1}, Vec3(0.4)), layers(RP_MATERIAL_BLEND, 1.5, 0.2, {0.1, 0.3, 0.5}, Vec3(0.2)),
                          glossy_material({0.5f, 0.1f, 0.1f}, {0.1f, 0.2f, 0.3f}, 0.3f), coated_diffuse_material({0.7f, 0.3f, 0.1f}, 1.5f, 0),
                          coated_diffuse_material({0.2f, 0.6f, 0.3f}, 1.6f, 0.25f), rough_diffuse_material({0.7f, 0.6f, 0.5f}, 30),
                          coated_conductor_material({0.2f, 0.9f, 1.1f}, {3.9f, 2.5f, 2.4f}, 0.3f, 1.5f, 0.2f),
                          coated_conductor_material({1.3f, 1, 0.6f}, {7, 6, 5}, 0.15f, 1.4f, 0)},
                         {0, 1, 2, 3, 4, 5, 6, 7}, size);
}

Scene clear_balls(PictureSize size) {
    rp_material uber = layers(RP_MATERIAL_SOLID | RP_MATERIAL_SMOOTH_REFRACTION, 1.4, 0.2, Vec3(0.1), Vec3(0.2)),
                leaf = layers(RP_MATERIAL_SOLID, 1.5, 0.3, {0.1, 0.3, 0.1}, Vec3(0.2));
    for (int k = 0; k < 3; k++) uber.mirror[k] = 0.3f, uber.refracted[k] = 0.6f, leaf.transmittance[k] = 0.3f, leaf.refracted[k] = 0.2f;
    return rows_of_balls({dielectric_material(1.5f, 0.2f, {1, 1, 1}, {1, 1, 1}), dielectric_material(1.5f, 0, {1, 1, 1}, {0.3f, 0.8f, 0.2f}),
                          thin_dielectric_material(1.5f), translucent_material({0.2f, 0.1f, 0.1f}, {0.1f, 0.6f, 0.5f}), uber, leaf, clear_material(),
                          diffuse_material({0.8f, 0.2f, 0.2f}), mix_material(6, 7, 0.4f),
                          conductor_material({0.2f, 0.9f, 1.1f}, {3.9f, 2.5f, 2.4f}, 0.2f), mix_material(8, 9, 0.5f)},
                         {0, 1, 2, 3, 4, 5, 8, 10}, size);
}

Scene ball_under_sky(const std::vector<rp_material>& materials, uint32_t material, uint32_t max_depth, PictureSize size) {
    SceneBuilder scene(size);
    for (const rp_material& m : materials) scene.material(m);
    scene.add_sphere("ball", {0, 0, 0}, 1, material);
    scene.camera({0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 16);
    scene.infinite_light(grey(1));
    Scene result = scene.finish();
    result.max_depth = max_depth;
    return result;
}

Scene glass_row(PictureSize size) {
    SceneBuilder scene(size);
    const uint32_t material = scene.material(glass(1.5));
    // Light is bent towards the axis and away from it in turn, so that paths near it go through all of them.
    for (int i = 0; i < 4; i++) scene.add_sphere("ball " + std::to_string(i), {0, 0, -8.0 * i}, 1, material);
    scene.camera({0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 1);
    scene.infinite_light(grey(1));
    Scene result = scene.finish();
    result.max_depth = 64;
    return result;
}

Scene ball_in_glass(PictureSize size) {
    SceneBuilder scene(size);
    scene.add_sphere("glass", {0, 0, 0}, 1, scene.material(glass(1.5)));
    scene.add_sphere("ball", {0, 0, 0}, 0.5, scene.material(diffuse(grey(1))));
    scene.camera({0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 4);
    scene.infinite_light(grey(1));
    Scene result = scene.finish();
    result.max_depth = 64;
    return result;
}

namespace {

// The plane is y = 0.
constexpr double plane_albedo = 0.6, plane_view = 2.0;
const Vec3 point_position(0.5, 1.5, -0.25), point_intensity(3, 3, 3), sun_direction(0.48, 0.6, 0.64), sun_irradiance(2, 2, 2);

}  // namespace

LitPlane two_lights_plane(PlaneLights lights, PictureSize size) {
    SceneBuilder scene(size);
    const uint32_t material = scene.material(diffuse(grey(plane_albedo)));
    scene.add("plane", quad({-8, 0, 8}, {16, 0, 0}, {0, 0, -16}, 4), material);
    scene.camera({0, plane_view, 0}, {0, 0, 0}, {0, 0, -1}, 60);
    if (lights != PlaneLights::distant) scene.point_light(point_position, point_intensity);
    if (lights != PlaneLights::point) scene.distant_light(sun_direction, sun_irradiance);
    LitPlane result{scene.finish(), lights};
    result.scene.max_depth = 1;
    return result;
}

double LitPlane::radiance(double u, double v) const {
    const Vec3 direction = Vec3(scene.camera.forward) + (2 * u - 1) * Vec3(scene.camera.right) + (1 - 2 * v) * Vec3(scene.camera.up);
    const Vec3 seen = Vec3(scene.camera.eye) - direction * (double{scene.camera.eye.y} / direction.y);
    double irradiance = 0;
    if (lights != PlaneLights::distant) {
        const Vec3 to_point = point_position - seen;
        const double distance2 = dot(to_point, to_point);
        irradiance += point_intensity.x * to_point.y / (distance2 * std::sqrt(distance2));
    }
    if (lights != PlaneLights::point) irradiance += sun_irradiance.x * normalized(sun_direction).y;
    return plane_albedo / pi * irradiance;
}

}  // namespace raypager::reference
