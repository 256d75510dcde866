// Tells whether a cached block file still has the geometry of a scene, cut as the options say. What the scene looks like does not count: it is set
// when the file is opened (restyle.hpp). A scene file counts by what it says of geometry, meshes and clouds by size and time of their files. So do
// images that programs read, and the texels of a sky that is paged; the programs themselves are set anew.
#include <fmt/format.h>

#include <filesystem>
#include <span>
#include <system_error>
#include <type_traits>

#include "bake/instance_traits.hpp"
#include "bake/paged_sky.hpp"
#include "bake/used_images.hpp"
#include "base/hash.hpp"
#include "gather/lights.hpp"
#include "raypager/bake.hpp"
#include "scene/check_material.hpp"
#include "scene/texture_use.hpp"

namespace raypager {
namespace {

// Counts up whenever the same scene would be baked into other bytes.
constexpr uint32_t baker_version = 9;

class Fingerprint {
public:
    template <class T>
    requires std::is_arithmetic_v<T>
    void add(T value) { add_bytes(std::as_bytes(std::span(&value, 1))); }
    template <class T, size_t n>
    void add(const T (&values)[n]) {
        for (const T& value : values) add(value);
    }
    void add(const std::string& text) {
        add(text.size());
        add_bytes(std::as_bytes(std::span(text)));
    }
    void add(const Float3& v) {
        for (const float value : {v.x, v.y, v.z}) add(value);
    }
    void add_bytes(std::span<const std::byte> bytes) { hash_ = hash64(bytes, hash_); }

    Status add_file(const std::string& path) {
        std::error_code error;
        const auto size = std::filesystem::file_size(path, error);
        if (error) return Status::failed(fmt::format("{}: cannot be examined: {}", path, error.message()));
        const auto time = std::filesystem::last_write_time(path, error);
        if (error) return Status::failed(fmt::format("{}: cannot be examined: {}", path, error.message()));
        const auto whole = std::filesystem::absolute(path, error);
        add(error ? path : whole.lexically_normal().string());
        add(uint64_t{size});
        add(static_cast<int64_t>(time.time_since_epoch().count()));
        return {};
    }

    uint64_t value() const { return hash_; }

private:
    uint64_t hash_ = 0;
};

void add_points(Fingerprint& f, const PointOptions& options) {
    f.add(options.radius);
    f.add(options.radius_from_spacing);
    f.add(options.radius_scale);
    f.add(options.cull_to_camera);
    f.add(options.cull_margin);
    f.add(options.filter_to_image);
}

// uvs: whether they are baked.
Status add_shape(Fingerprint& f, const Scene& scene, const Shape& shape, bool uvs) {
    for (const auto& row : shape.to_world.m)
        for (const double value : row) f.add(value);
    f.add(shape.reverse_orientation);
    f.add(shape.material);
    f.add(shape.backdrop);
    // Its range says so, whatever else the material is.
    if (may_be_nothing(scene.materials, shape.material)) f.add(true);
    // Which light it is counts, not how it shines; but whether it does at all decides what is in the list of lights.
    f.add(shape.area_light.value_or(RP_NONE));
    f.add(shape.area_light && is_black(scene.area_lights[*shape.area_light]));
    f.add(shape.unseen);
    if (shape.points) {
        f.add(shape.points->name());
        f.add(shape.points->reading());
        f.add(shape.points->has_color());
        f.add(shape.point_radius);
        f.add(shape.radius_scale);
        if (const auto* points = dynamic_cast<const PointsInMemory*>(shape.points.get())) f.add_bytes(std::as_bytes(std::span(points->points())));
        for (const std::string& file : shape.points->files()) RAYPAGER_TRY(f.add_file(file));
        return {};
    }
    if (!shape.mesh) {
        f.add(shape.sphere.center);
        f.add(shape.sphere.radius);
        return {};
    }
    f.add(shape.vertex_colors);
    f.add(uvs);
    if (const auto* mesh = dynamic_cast<const MeshInMemory*>(shape.mesh.get())) {
        f.add_bytes(std::as_bytes(std::span(mesh->mesh().positions)));
        f.add_bytes(std::as_bytes(std::span(mesh->mesh().triangles)));
        f.add_bytes(std::as_bytes(std::span(mesh->mesh().normals)));
        f.add_bytes(std::as_bytes(std::span(mesh->mesh().colors)));
        if (uvs) f.add_bytes(std::as_bytes(std::span(mesh->mesh().uvs)));
        return {};  // its name has the line of a scene file, which may move
    }
    f.add(shape.mesh->name());
    for (const std::string& file : shape.mesh->files()) RAYPAGER_TRY(f.add_file(file));
    return {};
}

void add_sources(Fingerprint& f, const Scene& scene, const std::vector<std::shared_ptr<const InstanceSource>>& sources) {
    for (const auto& source : sources) {
        f.add(source->count());
        f.add(source->fingerprint());
        for (const ObjectMaterial& put : source->materials()) f.add(may_be_nothing(scene.materials, put.material));
    }
}

// Which shapes are whose, and where they are put. A scene without objects has the fingerprint that it had before there were any.
void add_instances(Fingerprint& f, const Scene& scene, uint64_t flatten_limit) {
    if (scene.objects.empty()) return;
    f.add(scene.objects.size());
    for (const Object& object : scene.objects) {
        f.add(object.shapes.size());
        if (object.instances.empty()) continue;
        f.add(std::string("instances"));
        f.add(flatten_limit);
        add_sources(f, scene, object.instances);
    }
    add_sources(f, scene, scene.instances);
}

Status add_shapes(Fingerprint& f, const Scene& scene) {
    for (const Shape& shape : scene.shapes) RAYPAGER_TRY(add_shape(f, scene, shape, wants_uvs(scene, shape)));
    for (uint32_t i = 0; i < scene.objects.size(); i++) {
        const bool keeps = keeps_uvs(scene, i);
        for (const Shape& shape : scene.objects[i].shapes) RAYPAGER_TRY(add_shape(f, scene, shape, wants_uvs(scene, shape) || (shape.mesh && keeps)));
    }
    return {};
}

// Those that are baked, in their order: then programs that name the same ones can be replaced. A scene without any has the fingerprint that it had
// before there were images.
Status add_images(Fingerprint& f, const Scene& scene) {
    for (const uint32_t image : used_images(scene)) {
        const auto fingerprint = scene.images[image]->fingerprint();
        if (!fingerprint) return fingerprint.status();
        f.add(*fingerprint);
    }
    return {};
}

// That of a sky that is resident does not count.
Status add_sky(Fingerprint& f, const Scene& scene, const BakeOptions& options) {
    const auto sky = paged_sky(scene, options);
    if (!sky) return {};
    const auto fingerprint = sky_source(*sky)->fingerprint();
    if (!fingerprint) return fingerprint.status();
    f.add(*fingerprint);
    f.add(sky->level);
    return {};
}

}  // namespace

Result<uint64_t> bake_fingerprint(const Scene& scene, const BakeOptions& options) {
    Fingerprint f;
    f.add(baker_version);
    f.add(options.block_bytes);
    f.add(options.block_entries);
    f.add(options.position_error);
    add_points(f, options.points);
    // Only then do blocks depend on who looks at them.
    if (options.points.cull_to_camera || options.points.filter_to_image) {
        const Camera& camera = scene.camera;
        for (const Float3& v : {camera.eye, camera.right, camera.up, camera.forward}) f.add(v);
        f.add(static_cast<uint32_t>(camera.projection));
        for (const float value : {camera.lens_radius, camera.focal_distance}) f.add(value);
        for (const float share : camera.window) f.add(share);
        for (const uint32_t value : {scene.width, scene.height}) f.add(value);
    }
    if (auto status = add_shapes(f, scene); !status.ok()) return status;
    add_instances(f, scene, options.flatten_limit);
    if (auto status = add_images(f, scene); !status.ok()) return status;
    if (auto status = add_sky(f, scene, options); !status.ok()) return status;
    return f.value();
}

}  // namespace raypager
