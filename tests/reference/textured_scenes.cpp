#include "reference/textured_scenes.hpp"

#include <cmath>
#include <cstring>

#include "base/check.hpp"
#include "import/textures.hpp"
#include "raypager/image_source.hpp"
#include "raypager/materials.hpp"
#include "reference/scene_builder.hpp"

namespace raypager::reference {
namespace {

using ImagePointer = std::shared_ptr<const ImageSource>;

// value: 0 to 1 by column, row and channel.
template <class Value>
ImagePointer byte_image(const std::string& name, uint32_t width, uint32_t height, uint32_t channels, bool srgb, const Value& value) {
    std::vector<std::byte> texels;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++)
            for (uint32_t c = 0; c < channels; c++) texels.push_back(static_cast<std::byte>(std::lround(255 * value(x, y, c))));
    return memory_image(name, {width, height, channels, TexelKind::unsigned_8, srgb}, std::move(texels));
}

// Halves of 0 to 1 in steps of 1/1024, which are exact.
template <class Value>
ImagePointer half_image(const std::string& name, uint32_t width, uint32_t height, uint32_t channels, const Value& value) {
    std::vector<std::byte> texels;
    for (uint32_t y = 0; y < height; y++)
        for (uint32_t x = 0; x < width; x++)
            for (uint32_t c = 0; c < channels; c++) {
                const double v = std::round(1024 * value(x, y, c)) / 1024;
                int exponent = 0;
                const double mantissa = std::frexp(v, &exponent);  // 0.5 to 1
                const uint16_t bits = v == 0 ? 0 : static_cast<uint16_t>((exponent + 14) << 10 | static_cast<int>(mantissa * 2048 - 1024));
                for (int k = 0; k < 2; k++) texels.push_back(static_cast<std::byte>(bits >> 8 * k));
            }
    return memory_image(name, {width, height, channels, TexelKind::half, false}, std::move(texels));
}

ImagePointer colored_tiles(const std::string& name, uint32_t size, uint64_t seed) {
    Dice dice(seed);
    std::vector<double> values(size_t{4} * size * size);
    for (double& v : values) v = dice.between(0.1, 0.95);
    return byte_image(name, size, size, 4, true, [&](uint32_t x, uint32_t y, uint32_t c) { return values[4 * (size_t{y} * size + x) + c]; });
}

// A ring, whose inside and outside are cut away.
ImagePointer ring_mask(uint32_t size) {
    return byte_image("ring", size, size, 1, false, [&](uint32_t x, uint32_t y, uint32_t) {
        const double r = std::hypot(2 * (x + 0.5) / size - 1, 2 * (y + 0.5) / size - 1);
        return r > 0.4 && r < 0.9 ? 1.0 : 0.0;
    });
}

rp_texture_op image_op(uint32_t wrap = RP_WRAP_REPEAT, uint32_t channel = 0) {
    rp_texture_op op = texture_op(RP_TEXTURE_IMAGE);
    op.op |= (wrap | wrap << 2) << RP_TEXTURE_WRAP_SHIFT | channel << RP_TEXTURE_CHANNEL_SHIFT;
    return op;
}

rp_texture_map uv_map(float scale_u, float scale_v, float u, float v) {
    rp_texture_map map{};
    map.kind = RP_MAP_UV;
    map.m[0] = scale_u, map.m[5] = scale_v, map.m[2] = u, map.m[6] = v;
    return map;
}

rp_texture_map point_map(uint32_t kind, double scale) {
    rp_texture_map map{};
    map.kind = kind;
    for (size_t i = 0; i < 3; i++) map.m[5 * i] = static_cast<float>(scale);
    map.m[3] = 0.31f, map.m[7] = 0.57f, map.m[11] = 0.11f;
    map.scale[0] = 2, map.scale[1] = 3, map.offset[0] = 0.25f;
    return map;
}

// With u and v from 0 to 1 along its edges.
TriangleMesh mapped_quad(const Vec3& corner, const Vec3& edge_s, const Vec3& edge_t, uint32_t divisions = 1) {
    TriangleMesh mesh = quad(corner, edge_s, edge_t, divisions);
    for (const Float3& p : mesh.positions) {
        const Vec3 d = Vec3(p) - corner;
        mesh.uvs.push_back({static_cast<float>(dot(d, edge_s) / dot(edge_s, edge_s)), static_cast<float>(dot(d, edge_t) / dot(edge_t, edge_t))});
    }
    return mesh;
}

uint32_t add(SceneBuilder& builder, const TexturedMaterial& material) {
    RAYPAGER_CHECK(add_material(builder.scene(), material));
    return static_cast<uint32_t>(builder.scene().materials.size() - 1);
}

uint32_t painted(SceneBuilder& builder, const Texture& color) {
    TexturedMaterial m{diffuse_material({1, 1, 1}), {}};
    m.set(RP_PARAMETER_COLOR, color, m.material.color);
    return add(builder, m);
}

uint32_t cut_out(SceneBuilder& builder, uint32_t material, const Texture& alpha) {
    TexturedMaterial m{mix_material(RP_NONE, material, alpha.mean().x), {}};
    if (!alpha.is_constant()) m.textures.push_back({RP_PARAMETER_AMOUNT, alpha});
    return add(builder, m);
}

Texture checks(const Texture& a, const Texture& b, const rp_texture_map& map, bool solid = false) {
    rp_texture_op op = texture_op(RP_TEXTURE_CHECKS);
    if (solid) op.op |= RP_TEXTURE_SOLID;
    return Texture::operation(op, {a, b}, map, {0.5f, 0.5f, 0.5f});
}

}  // namespace

Scene textured_room(bool with_cutouts, PictureSize size) {
    SceneBuilder builder(size);
    builder.camera({0, 1.2, 4.2}, {0, 0.8, 0}, {0, 1, 0}, 50);
    const ImagePointer tiles = colored_tiles("tiles", 8, 1), more = colored_tiles("more tiles", 5, 2);
    const ImagePointer rough = half_image("rough", 4, 6, 1, [](uint32_t x, uint32_t y, uint32_t) { return 0.1 + 0.2 * ((x + y) % 4); });
    const ImagePointer light = half_image("light", 3, 3, 4, [](uint32_t x, uint32_t y, uint32_t c) { return 0.2 + 0.7 * ((x + 2 * y + c) % 5) / 5; });
    const Texture of_tiles = Texture::image(tiles, image_op(), uv_map(1.5f, 1.5f, 0.2f, 0));
    const Texture of_more = Texture::image(more, image_op(RP_WRAP_MIRROR), uv_map(2, 2, -0.3f, 0.4f));
    rp_texture_op inverted = image_op(RP_WRAP_CLAMP);
    inverted.op |= RP_TEXTURE_INVERT;
    const uint32_t floor = painted(builder, checks(of_tiles, of_more, uv_map(4, 4, 0, 0)));
    const uint32_t back = painted(builder, mixed(of_tiles, Texture::image(light, inverted, uv_map(1, 1, 0, 0)), Texture(0.4)));
    const uint32_t side = painted(builder, checks(Float3{0.7f, 0.3f, 0.2f}, of_more, point_map(RP_MAP_POINT, 1.7), true));
    TexturedMaterial glossy{glossy_material({0.5f, 0.5f, 0.5f}, {0.08f, 0.08f, 0.08f}, 0.3f), {}};
    glossy.set(RP_PARAMETER_COLOR, Texture::image(more, image_op(RP_WRAP_BLACK), point_map(RP_MAP_SPHERE, 1)) * Texture(0.9), glossy.material.color);
    const Texture roughness = Texture::image(rough, image_op(RP_WRAP_REPEAT, 3), point_map(RP_MAP_CYLINDER, 1));
    glossy.textures.push_back({RP_PARAMETER_ALPHA, roughness, 1});
    const uint32_t ball = add(builder, glossy);
    TexturedMaterial metal{conductor_of_reflectance({0.5f, 0.5f, 0.5f}, 0.3f), {}};
    metal.textures.push_back({RP_PARAMETER_METAL, Texture::image(light, image_op(), point_map(RP_MAP_SPHERE, 1))});
    const uint32_t metal_ball = add(builder, metal);
    TexturedMaterial mix{mix_material(ball, metal_ball, 0.5f), {}};
    mix.textures.push_back({RP_PARAMETER_AMOUNT, Texture::image(rough, image_op(), point_map(RP_MAP_POINT, 0.8)) * Texture(1.5)});
    const uint32_t both = add(builder, mix);

    builder.add("floor", mapped_quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}), floor);
    builder.add("back", mapped_quad({-2, 0, -2}, {4, 0, 0}, {0, 2.5, 0}), back);
    builder.add("left", mapped_quad({-2, 0, 2}, {0, 0, -4}, {0, 2.5, 0}), side);
    builder.add_sphere("glossy ball", {-0.8, 0.5, 0.2}, 0.5, ball);
    builder.add_sphere("metal ball", {0.3, 0.4, 0.6}, 0.4, metal_ball);
    builder.add("ball of both", icosphere(0.45, 3, true), both, Transform::translate(1.1, 0.45, -0.3));
    builder.shine(builder.add("lamp", quad({-0.4, 2.4, -0.4}, {0.8, 0, 0}, {0, 0, 0.8}), builder.material(absorber())), {9, 8.5, 8});
    builder.infinite_light({0.25, 0.3, 0.4});
    if (with_cutouts) {
        const Texture ring = Texture::image(ring_mask(8), image_op(), uv_map(3, 3, 0, 0));
        const uint32_t leaf = cut_out(builder, floor, ring), veil = cut_out(builder, builder.material(diffuse({0.8, 0.2, 0.2})), Texture(0.4));
        builder.add("leaf", mapped_quad({-1.2, 1.5, -1}, {2.4, 0, 0}, {0, 0.1, 1.8}), leaf);
        builder.add("leaf below", mapped_quad({-1, 1.2, -0.8}, {2, 0, 0}, {0, 0.1, 1.6}), leaf);
        builder.add("veil", mapped_quad({0.4, 0, 1.4}, {1.2, 0, 0}, {0, 1.2, 0}), veil);
        builder.add_sphere("veiled ball", {-1.3, 0.3, 1.2}, 0.3, veil);
        // Not of images: a path sees the roughness of one texel, the reference that between some.
        TexturedMaterial brushed{anisotropic(conductor_of_reflectance({0.8f, 0.7f, 0.5f}, 0.3f), 0.3f), {}};
        brushed.textures = {{RP_PARAMETER_ALPHA, checks(Texture(0.1), Texture(0.4), uv_map(4, 4, 0, 0))},
                            {RP_PARAMETER_ALPHA_ACROSS, checks(Texture(0.2), Texture(0.01), uv_map(2, 3, 0, 0)), 1}};
        builder.add("brushed", mapped_quad({-0.3, 0.02, 1.9}, {1.1, 0.3, 0}, {0, 0.1, -0.8}), add(builder, brushed));
    }
    return builder.finish();
}

Scene textured_hills(uint32_t n, PictureSize size) {
    SceneBuilder builder(size);
    builder.camera({0, 1.5, 3}, {0, 0.2, 0}, {0, 1, 0}, 45);
    const ImagePointer stones = colored_tiles("stones", 300, 3), heath = colored_tiles("heath", 257, 4);
    const ImagePointer snow =
        half_image("snow", 130, 70, 4, [](uint32_t x, uint32_t y, uint32_t c) { return 0.5 + 0.5 * ((3 * x + 5 * y + c) % 7) / 7; });
    const ImagePointer wet = byte_image("wet", 520, 300, 1, false, [](uint32_t x, uint32_t y, uint32_t) { return ((x / 40 + y / 30) % 3) / 2.0; });
    const Texture share = Texture::image(wet, image_op(), uv_map(2, 2, 0, 0));
    const Texture ground =
        mixed(Texture::image(stones, image_op(), uv_map(3, 3, 0, 0)), Texture::image(heath, image_op(), uv_map(4, 4, 0.3f, 0)), share);
    const uint32_t hill = painted(builder, mixed(ground, Texture::image(snow, image_op(RP_WRAP_MIRROR), uv_map(2, 2, 0, 0)), Texture(0.3)));
    TexturedMaterial pond{glossy_material({0.2f, 0.2f, 0.2f}, {0.06f, 0.06f, 0.06f}, 0.2f), {}};
    pond.textures.push_back({RP_PARAMETER_ALPHA, share * Texture(0.5), 1});
    pond.set(RP_PARAMETER_COLOR, Texture::image(stones, image_op(RP_WRAP_CLAMP), uv_map(1, 1, 0, 0)), pond.material.color);
    TriangleMesh mesh = patch(n, n, [](double s, double t) {
        const double x = 4 * s - 2, z = 2 - 4 * t;
        return Vec3(x, 0.25 * std::sin(3 * x) * std::cos(2 * z), z);
    });
    for (const Float3& p : mesh.positions) mesh.uvs.push_back({0.25f * p.x + 0.5f, 0.25f * p.z + 0.5f});
    builder.add("hills", std::move(mesh), hill);
    builder.add("pond", mapped_quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, 4), add(builder, pond));
    builder.distant_light({1, 2, 1}, {2, 1.9, 1.7});
    builder.infinite_light({0.4, 0.45, 0.6});
    return builder.finish();
}

namespace {

// About z; u around it, v around the tube.
TriangleMesh mapped_torus(double radius, double tube, uint32_t n) {
    TriangleMesh mesh = torus(radius, tube, n, n, true);
    for (uint32_t row = 0; row <= n; row++)
        for (uint32_t column = 0; column <= n; column++)
            mesh.uvs.push_back({static_cast<float>(column) / static_cast<float>(n), static_cast<float>(row) / static_cast<float>(n)});
    return mesh;
}

}  // namespace

Scene brushed_small(uint32_t n, PictureSize size) {
    SceneBuilder builder(size);
    builder.camera({0, 2.2, 5}, {0, 0.6, 0}, {0, 1, 0}, 42);
    const auto brushed = [&](const rp_material& m, float across, float base_across = 0) {
        return builder.material(anisotropic(m, across, base_across));
    };
    constexpr Float3 white{1, 1, 1}, eta{0.2f, 0.9f, 1.1f}, k{3.9f, 2.5f, 2.4f};
    const uint32_t metal = brushed(conductor_material(eta, k, 0.35f), 0.08f),
                   floor = brushed(conductor_of_reflectance({0.6f, 0.7f, 0.8f}, 0.1f), 0.4f),
                   paint = brushed(coated_diffuse_material({0.7f, 0.3f, 0.1f}, 1.5f, 0.1f), 0.3f),
                   coated = brushed(coated_conductor_material(eta, k, 0.3f, 1.5f, 0.1f), 0.25f, 0.1f),
                   glass = brushed(dielectric_material(1.5f, 0.3f, white, white), 0.08f),
                   gloss = brushed(glossy_material({0.1f, 0.4f, 0.2f}, {0.2f, 0.2f, 0.2f}, 0.1f), 0.4f),
                   dull = builder.material(conductor_material(eta, k, 0.3f));
    builder.add("floor", mapped_quad({-3, 0, 3}, {6, 0, 0}, {1, 0, -6}, 8), floor);
    builder.add("torus", mapped_torus(0.6, 0.25, n), paint, Transform::translate(-1.5, 0.9, 0) * Transform::rotate(20, 0, 1, 0));
    builder.add("coated torus", mapped_torus(0.6, 0.25, n), coated, Transform::translate(1.5, 0.3, 0.9) * Transform::rotate(-80, 1, 0, 0));
    const Transform turned = Transform::rotate(25, 1, 2, 3);  // no triangle with a normal next to z = 0, where what counts without uv leaps
    builder.add("no uv", icosphere(0.5, 3, true), metal, Transform::translate(0, 0.5, 1.2) * turned);
    builder.add("flat, no uv", icosphere(0.4, 1), gloss, Transform::translate(-1.2, 0.4, 1.6) * turned);
    builder.add_sphere("metal ball", {0, 1.4, -1}, 0.6, metal).to_world = Transform::rotate(10, 1, 0, 0);
    builder.add_sphere("another axis", {1.6, 1.4, -1}, 0.5, metal).to_world = Transform::rotate(10, 1, 0, 0) * Transform::rotate(-20, 0, 0, 1);
    builder.add_sphere("glass ball", {0.5, 0.4, 2}, 0.4, glass);
    builder.add_sphere("as rough in both directions", {-1.9, 0.4, -1.3}, 0.4, dull);
    map_textures_around_spheres(builder.scene());
    builder.shine(builder.add("lamp", quad({-0.6, 3.4, -0.6}, {1.2, 0, 0}, {0, 0, 1.2}), builder.material(absorber())), {12, 11, 10});
    builder.point_light({-2, 3, 3}, Vec3(6));
    builder.infinite_light({0.25, 0.3, 0.4});
    Scene scene = builder.finish();
    scene.max_depth = 6;
    return scene;
}

namespace {

// n leaves at random places of a box.
TriangleMesh many_leaves(Dice& dice, uint32_t n, const Vec3& lower, const Vec3& upper) {
    TriangleMesh leaves;
    for (uint32_t i = 0; i < n; i++) {
        const Vec3 corner(dice.between(lower.x, upper.x), dice.between(lower.y, upper.y), dice.between(lower.z, upper.z));
        const Vec3 along = dice.point(-0.2, 0.2), across = dice.point(-0.2, 0.2);
        const TriangleMesh one = mapped_quad(corner, along, cross(along, normalized(across)));
        const auto base = static_cast<uint32_t>(leaves.positions.size());
        leaves.positions.insert(leaves.positions.end(), one.positions.begin(), one.positions.end());
        leaves.uvs.insert(leaves.uvs.end(), one.uvs.begin(), one.uvs.end());
        for (const Triangle& t : one.triangles) leaves.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
    }
    return leaves;
}

// Somewhere in the hedge; every other one is mirrored.
Placement place_in_hedge(Dice& dice, uint32_t i) {
    const Vec3 axis = normalized(dice.point(-1, 1) + Vec3(0, 1.1, 0));
    const double grows = dice.between(0.4, 1.1);
    const Transform t = Transform::translate(dice.between(-1.4, 1.4), dice.between(0.1, 1.7), dice.between(-0.8, 0.8)) *
                        Transform::rotate(dice.between(0, 360), axis.x, axis.y, axis.z) *
                        Transform::scale(i % 2 ? grows : -grows, dice.between(0.4, 1.1), grows);
    return {i % 3, {t.m[0], t.m[1], t.m[2]}};
}

}  // namespace

Scene instanced_hedge(uint32_t instances, PictureSize size) {
    SceneBuilder builder(size);
    Scene& scene = builder.scene();
    builder.camera({0, 1, 4}, {0, 0.9, 0}, {0, 1, 0}, 40);
    const uint32_t green = painted(builder, Texture::image(colored_tiles("leaves", 200, 5), image_op(), std::nullopt));
    const uint32_t leaf = cut_out(builder, green, Texture::image(ring_mask(150), image_op(), std::nullopt));
    const uint32_t tiles = painted(builder, Texture::image(colored_tiles("tiles", 600, 8), image_op(), std::nullopt));
    const uint32_t brushed = builder.material(anisotropic(conductor_of_reflectance({0.8f, 0.7f, 0.5f}, 0.4f), 0.1f));
    Dice dice(6);
    for (const char* name : {"twig", "another twig"})
        scene.objects.push_back({name, {std::move(builder.add(name, many_leaves(dice, 300, {-0.4, -0.3, -0.3}, {0.4, 0.3, 0.3}), leaf))}});
    scene.objects.push_back({"ring", {std::move(builder.add("ring", mapped_torus(0.25, 0.1, 24), brushed))}});
    scene.shapes.clear();
    std::vector<Placement> placements;
    for (uint32_t i = 0; i < instances; i++) placements.push_back(place_in_hedge(dice, i));
    scene.instances.push_back(std::make_shared<InstancesInMemory>("hedge", std::move(placements)));
    builder.add("floor", mapped_quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -3}, 8), tiles);
    builder.shine(builder.add("lamp", quad({-0.5, 2.5, 1}, {1, 0, 0}, {0, 0, 1}), builder.material(absorber())), {6, 6, 5});
    builder.infinite_light({0.3, 0.35, 0.4});
    return builder.finish();
}

Scene overridden_hedge(uint32_t instances, PictureSize size, bool tinted) {
    SceneBuilder builder(size);
    Scene& scene = builder.scene();
    builder.camera({0, 1, 4}, {0, 0.9, 0}, {0, 1, 0}, 40);
    const uint32_t green = painted(builder, Texture::image(colored_tiles("leaves", 200, 5), image_op(), std::nullopt));
    const uint32_t leaf = cut_out(builder, green, Texture::image(ring_mask(150), image_op(), std::nullopt));
    const uint32_t tiles = painted(builder, Texture::image(colored_tiles("tiles", 600, 8), image_op(), std::nullopt));
    const uint32_t brushed = builder.material(anisotropic(conductor_of_reflectance({0.8f, 0.7f, 0.5f}, 0.4f), 0.1f));
    const uint32_t plain = builder.material(diffuse({0.7, 0.6, 0.5}));
    Dice dice(7);
    scene.objects.push_back({"opaque", {std::move(builder.add("opaque", many_leaves(dice, 300, {-0.4, -0.3, -0.3}, {0.4, 0.3, 0.3}), plain))}});
    scene.objects.push_back({"cut", {std::move(builder.add("cut", many_leaves(dice, 300, {-0.4, -0.3, -0.3}, {0.4, 0.3, 0.3}), leaf))}});
    scene.objects.push_back({"ring", {std::move(builder.add("ring", mapped_torus(0.25, 0.1, 24), plain))}});
    scene.shapes.clear();
    std::vector<Placement> placements;
    for (uint32_t i = 0; i < instances; i++) {
        Placement placed = place_in_hedge(dice, i);
        const uint32_t others[] = {RP_NONE, leaf, tiles, brushed, plain};
        placed.material = others[dice.below(5)];
        if (tinted && dice.below(2) == 0) placed.color = dice.point(0.2, 1).to_float();
        placements.push_back(placed);
    }
    scene.instances.push_back(std::make_shared<InstancesInMemory>("hedge", std::move(placements)));
    builder.add("floor", mapped_quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -3}, 8), tiles);
    builder.shine(builder.add("lamp", quad({-0.5, 2.5, 1}, {1, 0, 0}, {0, 0, 1}), builder.material(absorber())), {6, 6, 5});
    builder.infinite_light({0.3, 0.35, 0.4});
    return builder.finish();
}

Scene hedge(uint32_t n, PictureSize size, bool decals) {
    SceneBuilder builder(size);
    builder.camera({0, 1, 4}, {0, 0.9, 0}, {0, 1, 0}, 40);
    const uint32_t green = painted(builder, Texture::image(colored_tiles("leaves", 200, 5), image_op(), std::nullopt));
    const uint32_t leaf = cut_out(builder, green, Texture::image(ring_mask(150), image_op(), std::nullopt));
    Dice dice(6);
    TriangleMesh leaves = many_leaves(dice, n * n, {-1.6, 0, -0.8}, {1.3, 1.7, 0.8});
    builder.add("wall", quad({-2, 0, -1}, {4, 0, 0}, {0, 2, 0}, 8), builder.material(diffuse({0.7, 0.7, 0.7})));
    builder.add("leaves", std::move(leaves), leaf);
    if (decals) {
        builder.add("sheet", quad({-0.4, 2.2, 0.8}, {0.8, 0, 0}, {0, 0, 0.6}), builder.material(diffuse({0.5, 0.5, 0.5})));
        builder.add("decals", mapped_quad({-0.4, 2.1999995, 0.8}, {0.8, 0, 0}, {0, 0, 0.6}), leaf);
    }
    builder.shine(builder.add("lamp", quad({-0.5, 2.5, 1}, {1, 0, 0}, {0, 0, 1}), builder.material(absorber())), {6, 6, 5});
    builder.infinite_light({0.3, 0.35, 0.4});
    return builder.finish();
}

}  // namespace raypager::reference
