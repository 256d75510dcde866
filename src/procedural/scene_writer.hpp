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
    // Makes the folder, and in it meshes/ unless the scene is one of points, textures/ if it is a museum or an island, and instances/ if
    // it is a forest or an island. An old scene file there is removed, so that it never names a mix of old and new meshes.
    static Result<SceneWriter> create(const MakeSceneOptions& options);

    // Written first: film, sampler, integrator, camera; the world begins.
    void begin(std::string_view comment, const View& view);

    // Named materials; roughness is the GGX alpha, 0 a mirror.
    void diffuse(std::string_view name, const Rgb& reflectance);
    void conductor(std::string_view name, const Rgb& eta, const Rgb& k, double roughness);
    void glass(std::string_view name, double ior);
    void coat(std::string_view name, const Rgb& reflectance, double roughness);  // smooth or rough, over a diffuse base
    void diffuse_transmission(std::string_view name, const Rgb& reflectance, const Rgb& transmittance);

    // Images for textures, by the names of these. Somebody else writes the files, and says so to count_images.
    void color_texture(std::string_view name, std::string_view file);
    // Of linear numbers, times scale.
    void number_texture(std::string_view name, std::string_view file, double scale = 1);
    void count_images(uint64_t count, uint64_t texture_bytes, uint64_t file_bytes);
    // Materials of textures; a roughness is the name of one, too, or a number in a string.
    void textured_diffuse(std::string_view name, std::string_view color);
    void textured_coat(std::string_view name, std::string_view color, std::string_view roughness);
    void textured_conductor(std::string_view name, const Rgb& eta, const Rgb& k, std::string_view roughness);

    void sky(const Rgb& radiance);
    void image_sky(std::string_view file);  // square, in the equal-area mapping of pbrt-v4; its z is up
    void sun(const Vector& towards_sun, const Rgb& irradiance);
    // A rectangle with corners p, p + a, p + a + b, p + b that shines to the side of cross(a, b).
    void light(const Vector& p, const Vector& a, const Vector& b, const Rgb& radiance);
    void sphere(std::string_view material, const Vector& center, double radius);
    void quad(std::string_view material, const Vector& p, const Vector& a, const Vector& b);

    // meshes/NAME.ply, to be filled and handed to finish_mesh.
    Result<PlyWriter> begin_mesh(std::string_view name, uint64_t vertices, uint64_t triangles) const;
    Status finish_mesh(std::string_view name, std::string_view material, PlyWriter& writer);
    Status mesh(std::string_view name, std::string_view material, std::span<const Float3> positions, std::span<const Triangle> triangles);

    // With its coordinates of textures, and its normals if it has any. alpha: the texture that cuts it out, or none.
    Status textured_mesh(std::string_view name, std::string_view material, const TriangleMesh& mesh, std::string_view alpha = {});

    // What is written between the two is moved by so much.
    void begin_moved(const Vector& by);
    void end_moved();

    // What is written between the two is seen where instances of it are. How many there are, the writer of their files says.
    void begin_object(std::string_view name);
    void end_object();
    Status include(std::string_view file, std::string_view text);  // writes FILE in the scene's folder, and has it read here
    void count_instances(uint64_t count) { made_.instances += count; }

    // A cloud that has been written to FILE in the scene's folder.
    void points(std::string_view file, std::string_view material, uint64_t count, uint64_t bytes);

    uint64_t triangles() const { return made_.triangles; }
    Result<MadeScene> finish();

private:
    void add_mesh_file(std::string_view name, std::string_view material, std::string_view alpha, const PlyWriter& writer);
    void shape_quad(const Vector& p, const Vector& a, const Vector& b);
    MakeSceneOptions options_;
    MadeScene made_;
    std::string text_;
};

// No mesh file has more triangles than this, however large the scene.
constexpr uint64_t max_mesh_triangles = uint64_t{1} << 21;

}  // namespace raypager
