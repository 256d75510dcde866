// Geometry of any kind through the whole bake: coordinates of all magnitudes, transforms, spheres. An input is a list of floats and
// bytes; whatever they are, the baker refuses them or writes a block file that passes every check and holds what came in.
#include <array>
#include <cmath>
#include <cstring>

#include "base/check.hpp"
#include "fuzz/fuzz.hpp"
#include "raypager/bake.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager::fuzz {
namespace {

class Reader {
public:
    explicit Reader(std::string_view input) : input_(input) {}
    template <class T>
    T take() {
        T value{};
        const size_t count = std::min(sizeof value, input_.size());
        std::memcpy(&value, input_.data(), count);
        input_.remove_prefix(count);
        return value;
    }
    bool done() const { return input_.empty(); }

private:
    std::string_view input_;
};

Scene read_scene(Reader& in) {
    Scene scene = blocks_test::scene_of({});
    scene.area_lights = {{{1, 2, 3}, false}};
    while (!in.done()) {
        const auto kind = in.take<uint8_t>(), size = in.take<uint8_t>();
        if (kind & 1) {
            const Float3 center = {in.take<float>(), in.take<float>(), in.take<float>()};
            scene.shapes.push_back(blocks_test::sphere_shape(center, in.take<float>()));
        } else {
            TriangleMesh mesh;
            for (int i = 0; i < 3 + size / 4; i++) mesh.positions.push_back({in.take<float>(), in.take<float>(), in.take<float>()});
            for (int i = 0; i < 1 + size % 16; i++) mesh.triangles.push_back({in.take<uint8_t>(), in.take<uint8_t>(), in.take<uint8_t>()});
            if (kind & 2) mesh.normals = mesh.positions;
            scene.shapes.push_back(blocks_test::mesh_shape(std::move(mesh)));
        }
        Shape& shape = scene.shapes.back();
        shape.reverse_orientation = kind & 4;
        if (kind & 8) shape.area_light = 0;
        if (kind & 16)
            for (size_t row = 0; row < 3; row++)
                for (double& x : shape.to_world.m[row]) x = in.take<float>();
    }
    return scene;
}

void check_blocks(const BlockFile& file, const BakeSummary& summary) {
    uint64_t primitives = 0;
    for (uint32_t block = 0; block < file.scene().blocks.size(); block++) {
        std::vector<std::byte> stored(file.scene().blocks[block].stored_bytes);
        RAYPAGER_CHECK(file.read_block(block, stored).ok());
        RAYPAGER_CHECK(file.check_block(block, stored).ok());
        const BlockView view(stored);
        for (const rp_block_entry& block_entry : file.scene().block_entries)
            if (block_entry.block == block) {
                const DecodedLeaf leaf = decode_subtree(view, block_entry.root);
                primitives += leaf.triangles.size() + leaf.spheres.size();
            }
    }
    RAYPAGER_CHECK(primitives == summary.triangles + summary.spheres);
}

}  // namespace

std::vector<std::string> seeds() {
    std::string mesh = {0, 4}, lit_sphere = {9, 0}, transformed = {26, 8};
    const auto add = [](std::string& to, std::initializer_list<float> values) {
        for (const float value : values) to.append(reinterpret_cast<const char*>(&value), sizeof value);
    };
    add(mesh, {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 1e-40f});
    mesh += {0, 1, 2, 1, 3, 2, 0, 0, 1, 0, 2, 3, 3, 1, 0};
    add(lit_sphere, {1, 2, 3, 0.5f});
    add(transformed, {0, 0, 0, 1, 0, 0, 0, 1e12f, 0, 1, 1, -1e30f, 0, -0.0f, 0});
    transformed += {0, 1, 2, 1, 3, 2, 0, 0, 1, 0, 2, 3, 3, 1, 0, 2, 2, 2, 1, 0, 3, 0, 1, 4, 4, 3, 2};
    add(transformed, {1, 0, 0, 5, 0, 0, 1, -5, 0, 1e-20f, 0, INFINITY});
    return {mesh, lit_sphere, transformed, mesh + lit_sphere + mesh, ""};
}

void run(std::string_view input) {
    Reader in(input);
    BakeOptions options;
    options.block_bytes = 16 << 10;
    const auto choice = in.take<uint8_t>();
    options.block_entries = 1 + choice % 64;
    options.position_error = std::array{0.0f, 1e-3f, min_position_error, max_position_error}[choice / 64];
    const Scene scene = read_scene(in);
    const std::filesystem::path path = scratch_path("output.rpb");
    const auto summary = bake(scene, options, path);
    if (!summary) return;
    const auto file = BlockFile::open(path);
    RAYPAGER_CHECK(file.ok());
    check_blocks(**file, *summary);
}

}  // namespace raypager::fuzz
