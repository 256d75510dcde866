#include "import/bare_look.hpp"

#include <cmath>
#include <memory>
#include <numbers>

#include "raypager/materials.hpp"
#include "scene/emitters.hpp"

namespace raypager {
namespace {

using std::numbers::pi;

// In radii of the object: further than what a camera sees that looks down at it from 22 degrees, but for the corners of tall pictures. It depends on
// the object alone, so that other views of it do not bake another ground.
constexpr double ground_reach = 40;
constexpr Float3 key_radiance = {9.5f, 9.0f, 8.2f}, sun_irradiance = {2.9f, 2.6f, 2.15f};
constexpr Float3 sky_of_objects = {0.22f, 0.25f, 0.30f}, sky_of_landscapes = {0.42f, 0.55f, 0.75f};

void store_color(const Float3& color, double strength, float (&target)[3]) {
    target[0] = static_cast<float>(color.x * strength);
    target[1] = static_cast<float>(color.y * strength);
    target[2] = static_cast<float>(color.z * strength);
}

bool shines(const Float3& color) { return color.x > 0 || color.y > 0 || color.z > 0; }

// From the object towards the viewer, along the ground.
Vector towards_viewer(const Framing& view, const Axes& axes) { return unit(view.to_camera - dot(view.to_camera, axes.up) * axes.up); }

// As on a clear afternoon; it stands at the viewer's left.
rp_light sun_light(const BareLight& light, const Framing& view, const Axes& axes) {
    Vector direction = unit(0.8 * axes.up - 0.8 * view.right + 0.25 * towards_viewer(view, axes));
    if (light.place) {
        const double azimuth = light.place->azimuth * pi / 180, elevation = light.place->elevation * pi / 180;
        const Vector level = std::cos(azimuth) * towards_viewer(view, axes) + std::sin(azimuth) * view.right;
        direction = unit(std::cos(elevation) * level + std::sin(elevation) * axes.up);
    }
    rp_light sun{};
    sun.kind = RP_LIGHT_DISTANT;
    for (size_t a = 0; a < 3; ++a) sun.p[a] = static_cast<float>(direction[a]);
    store_color(sun_irradiance, light.strength, sun.radiance);
    return sun;
}

// A square of light, up at the viewer's left in front, facing the object. The picture does not show it, nor do mirrors.
void add_key_light(const BareLight& light, const BareSubject& subject, const Framing& view, const Axes& axes, Scene& scene) {
    const Vector direction = unit(0.9 * axes.up - 0.85 * view.right + 0.55 * towards_viewer(view, axes));
    const Vector middle = subject.center + 3.2 * subject.radius * direction;
    const Vector x = 0.9 * subject.radius * unit(cross(axes.up, direction)), y = cross(direction, x);
    const Float3 corners[4] = {float3(middle - x - y), float3(middle - x + y), float3(middle + x + y), float3(middle + x - y)};
    const auto strength = static_cast<float>(light.strength);
    const AreaLight shine = {{key_radiance.x * strength, key_radiance.y * strength, key_radiance.z * strength}, false};
    scene.lights.push_back(unseen(triangle_light(corners[0], corners[1], corners[2], shine)));
    scene.lights.push_back(unseen(triangle_light(corners[0], corners[2], corners[3], shine)));
}

// A disc under the object.
void add_ground(const BareSubject& subject, const Axes& axes, uint32_t material, Scene& scene) {
    // A little below, so that a flat underside and the ground do not coincide.
    const double height = subject.lowest - (subject.points ? 1e-2 : 1e-4) * subject.radius;
    const Vector middle = subject.center + (height - dot(subject.center, axes.up)) * axes.up;
    constexpr uint32_t corners = 96;
    TriangleMesh mesh;
    mesh.positions.push_back(float3(middle));
    for (uint32_t i = 0; i < corners; ++i) {
        const double angle = 2 * pi * i / corners;
        mesh.positions.push_back(float3(middle + ground_reach * subject.radius * (std::cos(angle) * axes.front + std::sin(angle) * axes.side)));
        mesh.triangles.push_back({0, i + 1, (i + 1) % corners + 1});
    }
    Shape shape;
    shape.name = "ground";
    shape.material = material;
    shape.backdrop = true;
    shape.mesh = std::make_shared<MeshInMemory>("ground", std::move(mesh));
    scene.shapes.push_back(std::move(shape));
}

}  // namespace

rp_material bare_ground_material() { return diffuse_material({0.40f, 0.38f, 0.35f}); }

void light_bare_scene(const BareLook& look, const BareSubject& subject, const Framing& view, const Axes& axes, uint32_t ground_material,
                      Scene& scene) {
    const Float3 sky = look.sky.value_or(subject.landscape ? sky_of_landscapes : sky_of_objects);
    if (shines(sky)) scene.lights.push_back(infinite_light(sky));
    BareLight::Kind kind = look.light.kind;
    if (kind == BareLight::Kind::usual) kind = subject.landscape ? BareLight::Kind::sun : BareLight::Kind::key;
    if (kind == BareLight::Kind::sun) scene.lights.push_back(sun_light(look.light, view, axes));
    if (kind == BareLight::Kind::key) add_key_light(look.light, subject, view, axes, scene);
    if (scene.lights.empty()) scene.warnings.push_back("--sky none and --light none: nothing shines, so the picture will be black");
    if (!look.no_ground && !subject.landscape) add_ground(subject, axes, ground_material, scene);
}

}  // namespace raypager
