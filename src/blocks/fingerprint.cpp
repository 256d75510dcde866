// Tells whether a cached block file is still that of a scene and its options.
#include <fmt/format.h>

#include <filesystem>
#include <span>
#include <system_error>
#include <type_traits>

#include "base/hash.hpp"
#include "blocks/bake.hpp"

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

void add_material(Fingerprint& f, const rp_material& m) {
    f.add(m.kind);
    f.add(m.alpha);
    f.add(m.ior);
    f.add(m.color);
    f.add(m.eta);
    f.add(m.k);
}

void add_light(Fingerprint& f, const rp_light& light) {
    f.add(light.kind);
    f.add(light.flags);
    f.add(light.p);
    f.add(light.e1);
    f.add(light.e2);
    f.add(light.area);
    f.add(light.radiance);
}

void add_points(Fingerprint& f, const PointOptions& options) {
    f.add(options.radius);
    f.add(options.radius_from_spacing);
    f.add(options.radius_scale);
    f.add(options.cull_to_camera);
    f.add(options.cull_margin);
    f.add(options.filter_to_image);
}

Status add_shape(Fingerprint& f, const Shape& shape) {
    for (const auto& row : shape.to_world.m)
        for (const double value : row) f.add(value);
    f.add(shape.reverse_orientation);
    f.add(shape.material);
    f.add(shape.area_light.value_or(RP_NONE));
    if (shape.points) {
        f.add(shape.points->name());
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
    f.add(shape.mesh->name());
    if (const auto* mesh = dynamic_cast<const MeshInMemory*>(shape.mesh.get())) {
        f.add_bytes(std::as_bytes(std::span(mesh->mesh().positions)));
        f.add_bytes(std::as_bytes(std::span(mesh->mesh().triangles)));
        f.add_bytes(std::as_bytes(std::span(mesh->mesh().normals)));
    }
    for (const std::string& file : shape.mesh->files()) RAYPAGER_TRY(f.add_file(file));
    return {};
}

}  // namespace

Result<uint64_t> bake_fingerprint(const Scene& scene, const BakeOptions& options) {
    Fingerprint f;
    f.add(baker_version);
    f.add(options.block_bytes);
    f.add(options.sub_boxes);
    f.add(options.position_error);
    add_points(f, options.points);
    for (const std::string& file : scene.files)
        if (auto status = f.add_file(file); !status.ok()) return status;
    for (const Float3& v : {scene.camera.eye, scene.camera.right, scene.camera.up, scene.camera.forward}) f.add(v);
    for (const uint32_t value : {scene.width, scene.height, scene.spp, scene.max_depth}) f.add(value);
    for (const float value : scene.film.color_matrix) f.add(value);
    for (const float value : {scene.film.exposure, scene.film.max_luminance, scene.film.max_xyz}) f.add(value);
    for (const rp_material& material : scene.materials) add_material(f, material);
    for (const AreaLight& light : scene.area_lights) {
        f.add(light.radiance);
        f.add(light.two_sided);
    }
    for (const rp_light& light : scene.lights) add_light(f, light);
    for (const Shape& shape : scene.shapes)
        if (auto status = add_shape(f, shape); !status.ok()) return status;
    return f.value();
}

}  // namespace raypager
