// Collects a scene that is being generated: writes meshes at once and the .pbrt file, which names them, last.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "procedural/make_scene.hpp"
#include "procedural/numeric.hpp"
#include "procedural/ply_writer.hpp"

namespace raypager {

using Rgb = std::array<double, 3>;

struct View {
    Vector eye, target, up = {0, 1, 0};
    double fov_degrees = 45;  // of the picture's shorter side
    uint32_t width = 1280, height = 720;
};

// World coordinates are right-handed with y up, in the unit that the scene's own comment names.
class SceneWriter {
public:
    // Makes the folder, and meshes/ in it unless the scene is one of points. An old scene file there is removed, so that it never names a mix of old
    // and new meshes.
    static Result<SceneWriter> create(const MakeSceneOptions& options);

    // Written first: film, sampler, integrator, camera; the world begins.
    void begin(std::string_view comment, const View& view);

    // Named materials; roughness is the GGX alpha, 0 a mirror.
    void diffuse(std::string_view name, const Rgb& reflectance);
    void conductor(std::string_view name, const Rgb& eta, const Rgb& k, double roughness);
    void glass(std::string_view name, double ior);

    void sky(const Rgb& radiance);
    void sun(const Vector& towards_sun, const Rgb& irradiance);
    // A rectangle with corners p, p + a, p + a + b, p + b that shines to the side of cross(a, b).
    void light(const Vector& p, const Vector& a, const Vector& b, const Rgb& radiance);
    void sphere(std::string_view material, const Vector& center, double radius);
    void quad(std::string_view material, const Vector& p, const Vector& a, const Vector& b);

    // meshes/NAME.ply, to be filled and handed to finish_mesh.
    Result<PlyWriter> begin_mesh(std::string_view name, uint64_t vertices, uint64_t triangles) const;
    Status finish_mesh(std::string_view name, std::string_view material, PlyWriter& writer);
    Status mesh(std::string_view name, std::string_view material, std::span<const Float3> positions, std::span<const Triangle> triangles);

    // A cloud that has been written to FILE in the scene's folder.
    void points(std::string_view file, std::string_view material, uint64_t count, uint64_t bytes);

    uint64_t triangles() const { return made_.triangles; }
    Result<MadeScene> finish();

private:
    void shape_quad(const Vector& p, const Vector& a, const Vector& b);
    MakeSceneOptions options_;
    MadeScene made_;
    std::string text_;
};

// No mesh file has more triangles than this, however large the scene.
constexpr uint64_t max_mesh_triangles = uint64_t{1} << 21;

}  // namespace raypager
