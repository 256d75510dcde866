// Scenes for the tests of the baker and the block file, and a block file read back as a whole.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "block/decode.hpp"
#include "gather/gather.hpp"
#include "raypager/bake.hpp"
#include "store/block_file.hpp"
#include "support/temporary_folder.hpp"

namespace raypager::blocks_test {

using support::TemporaryFolder;

inline TriangleMesh soup(uint32_t triangles, uint32_t seed, float size = 0.05f) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> place(-1, 1), offset(-size, size);
    TriangleMesh mesh;
    for (uint32_t i = 0; i < triangles; i++) {
        const Float3 c = {place(random), place(random), place(random)};
        for (int k = 0; k < 3; k++) mesh.positions.push_back({c.x + offset(random), c.y + offset(random), c.z + offset(random)});
        mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    return mesh;
}

// 2 n^2 triangles over [0, 1]^2, y up.
inline TriangleMesh terrain(uint32_t n, bool with_normals = false) {
    TriangleMesh mesh;
    for (uint32_t j = 0; j <= n; j++) {
        for (uint32_t i = 0; i <= n; i++) {
            const float u = float(i) / float(n), v = float(j) / float(n);
            mesh.positions.push_back({u, 0.1f * std::sin(9 * u) * std::cos(7 * v) + 0.01f * std::sin(90 * u + 50 * v), v});
            if (with_normals) mesh.normals.push_back({0.1f * std::sin(3 * u), 1, 0.2f * std::cos(5 * v)});
        }
    }
    for (uint32_t j = 0; j < n; j++) {
        for (uint32_t i = 0; i < n; i++) {
            const uint32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
            mesh.triangles.push_back({a, c, b});
            mesh.triangles.push_back({b, c, d});
        }
    }
    return mesh;
}

inline TriangleMesh painted(TriangleMesh mesh) {
    for (uint32_t i = 0; i < mesh.positions.size(); i++) mesh.colors.push_back(i * 2654435761u & 0xffffffu);
    return mesh;
}

// u and v from the position, and a little of each vertex's own.
inline TriangleMesh with_uvs(TriangleMesh mesh) {
    for (uint32_t i = 0; i < mesh.positions.size(); i++) {
        const Float3& p = mesh.positions[i];
        mesh.uvs.push_back({3 * p.x + 0.01f * float(i % 7), p.y - 2 * p.z});
    }
    return mesh;
}

// A unit sphere of 20 * 4^levels triangles.
inline TriangleMesh icosphere(int levels) {
    const float t = static_cast<float>(std::numbers::phi);
    TriangleMesh mesh;
    mesh.positions = {{-1, t, 0},  {1, t, 0},  {-1, -t, 0}, {1, -t, 0}, {0, -1, t},  {0, 1, t},
                      {0, -1, -t}, {0, 1, -t}, {t, 0, -1},  {t, 0, 1},  {-t, 0, -1}, {-t, 0, 1}};
    mesh.triangles = {{0, 11, 5}, {0, 5, 1}, {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                      {3, 9, 4},  {3, 4, 2}, {3, 2, 6}, {3, 6, 8},  {3, 8, 9},   {4, 9, 5}, {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    for (int level = 0; level < levels; level++) {
        std::vector<Triangle> finer;
        std::map<std::pair<uint32_t, uint32_t>, uint32_t> known;
        const auto middle = [&](uint32_t a, uint32_t b) {
            const auto [at, fresh] = known.try_emplace(std::minmax(a, b), static_cast<uint32_t>(mesh.positions.size()));
            if (fresh) {
                const Float3 p = mesh.positions[a], q = mesh.positions[b];
                mesh.positions.push_back({(p.x + q.x) / 2, (p.y + q.y) / 2, (p.z + q.z) / 2});
            }
            return at->second;
        };
        for (const Triangle& f : mesh.triangles) {
            const uint32_t a = middle(f[0], f[1]), b = middle(f[1], f[2]), c = middle(f[2], f[0]);
            for (const Triangle& g : {Triangle{f[0], a, c}, Triangle{f[1], b, a}, Triangle{f[2], c, b}, Triangle{a, b, c}}) finer.push_back(g);
        }
        mesh.triangles = std::move(finer);
    }
    for (Float3& p : mesh.positions) {
        const float length = std::hypot(p.x, p.y, p.z);
        p = {p.x / length, p.y / length, p.z / length};
    }
    return mesh;
}

inline rp_material gray() {
    rp_material material = {};
    material.kind = RP_MATERIAL_DIFFUSE;
    material.color[0] = material.color[1] = material.color[2] = 0.5f;
    material.ior = 1;
    return material;
}

// A material whose colour a texture program says.
inline uint32_t add_textured_gray(Scene& scene) {
    rp_texture_op color = {}, set = {};
    color.op = RP_TEXTURE_CONSTANT;
    color.map = set.map = RP_NONE;
    std::fill_n(color.a, 3, 0.5f);
    set.op = RP_TEXTURE_SET | RP_TEXTURE_LAST;
    set.image = RP_PARAMETER_COLOR;
    rp_material material = gray();
    material.flags = static_cast<rp_u32>(scene.texture_ops.size() + 1) << RP_MATERIAL_PROGRAM_SHIFT;
    scene.texture_ops.insert(scene.texture_ops.end(), {color, set});
    scene.materials.push_back(material);
    return static_cast<uint32_t>(scene.materials.size() - 1);
}

inline Shape mesh_shape(TriangleMesh mesh, std::string name = "mesh") {
    Shape shape;
    shape.name = name;
    shape.mesh = std::make_shared<MeshInMemory>(name, std::move(mesh));
    return shape;
}

inline Shape sphere_shape(Float3 center, float radius) {
    Shape shape;
    shape.name = "sphere";
    shape.sphere = {center, radius};
    return shape;
}

inline Scene scene_of(std::vector<Shape> shapes) {
    Scene scene;
    scene.materials = {gray()};
    scene.shapes = std::move(shapes);
    return scene;
}

inline Gathered gathered(const Scene& scene, const PointOptions& options = {}) {
    auto result = gather(
        scene, [](double) {}, options);
    if (!result) throw std::runtime_error(result.status().message());
    return std::move(*result);
}

inline std::vector<Shape> random_spheres(uint32_t count, uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> place(-1, 1), radius(0.001f, 0.05f);
    std::vector<Shape> shapes;
    for (uint32_t i = 0; i < count; i++) shapes.push_back(sphere_shape({place(random), place(random), place(random)}, radius(random)));
    return shapes;
}

// Near a wavy sheet, of all colours; a third with radii of their own.
inline std::vector<CloudPoint> random_points(uint32_t count, uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> place(-1, 1), radius(0.001f, 0.03f);
    std::vector<CloudPoint> points;
    for (uint32_t i = 0; i < count; i++) {
        const float x = place(random), z = place(random), y = 0.2f * std::sin(5 * x) * std::cos(4 * z) + 0.02f * place(random);
        const float own = radius(random);
        points.push_back({{x, y, z}, i % 3 == 0 ? own : 0, static_cast<uint32_t>(random()) & 0xffffffu});
    }
    return points;
}

inline Shape cloud_shape(std::vector<CloudPoint> points, bool has_color = true) {
    Shape shape;
    shape.name = "cloud";
    shape.points = std::make_shared<PointsInMemory>("cloud", std::move(points), has_color);
    return shape;
}

// Soup, terrain with normals, a closed surface, meshes with coordinates of textures that are of use and that are not, a mesh given twice, a mirrored
// one, spheres and points among them.
inline Scene mixed_scene(uint32_t seed) {
    std::vector<Shape> shapes = random_spheres(500, seed);
    shapes.push_back(mesh_shape(soup(3000, seed + 1)));
    shapes.push_back(mesh_shape(terrain(60, true)));
    shapes.push_back(mesh_shape(icosphere(4)));
    shapes.push_back(mesh_shape(painted(icosphere(4))));
    shapes.push_back(mesh_shape(icosphere(3)));
    shapes.back().to_world = Transform::translate(0.3, -0.2, 0.1) * Transform::scale(-0.5, 0.7, 0.6);
    shapes.push_back(mesh_shape(icosphere(3)));
    shapes.back().reverse_orientation = true;
    for (Shape& shape : random_spheres(300, seed + 2)) shapes.push_back(std::move(shape));
    shapes.push_back(cloud_shape(random_points(2000, seed + 3)));
    shapes.push_back(cloud_shape(random_points(1000, seed + 4), false));
    shapes.push_back(mesh_shape(with_uvs(icosphere(2))));
    shapes.push_back(mesh_shape(with_uvs(icosphere(3))));
    shapes.push_back(mesh_shape(with_uvs(painted(terrain(30, true)))));
    shapes.push_back(mesh_shape(with_uvs(soup(500, seed + 5))));
    Scene scene = scene_of(std::move(shapes));
    const uint32_t textured = add_textured_gray(scene);
    for (size_t i = 1; i <= 3; i++) scene.shapes[scene.shapes.size() - i].material = textured;
    return scene;
}

struct AlignedBytes {
    std::vector<uint64_t> words;
    size_t size = 0;
    std::span<std::byte> span() { return std::as_writable_bytes(std::span(words)).first(size); }
};

inline AlignedBytes read_block(const BlockFile& file, uint32_t block) {
    AlignedBytes bytes;
    bytes.size = file.scene().blocks[block].stored_bytes;
    bytes.words.resize((bytes.size + 7) / 8);
    const Status status = file.read_block(block, bytes.span());
    if (!status.ok()) throw std::runtime_error(status.message());
    return bytes;
}

inline std::shared_ptr<const BlockFile> bake_and_open(const Scene& scene, const std::filesystem::path& path, uint64_t block_bytes,
                                                      uint32_t block_entries = 64, float position_error = 0) {
    BakeOptions options;
    options.block_bytes = block_bytes;
    options.block_entries = block_entries;
    options.position_error = position_error;
    const auto summary = bake(scene, options, path);
    if (!summary) throw std::runtime_error(summary.status().message());
    const auto file = BlockFile::open(path);
    if (!file) throw std::runtime_error(file.status().message());
    return *file;
}

}  // namespace raypager::blocks_test
