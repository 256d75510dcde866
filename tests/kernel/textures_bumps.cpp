// Bumps and normal maps on the device (kernels/shading/texture.cl): surfaces whose normals are known.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "base/half.hpp"
#include "raypager/image_source.hpp"
#include "reference/vector.hpp"
#include "support/texture_probe.hpp"

namespace raypager {
namespace {

using reference::Vec3;

// Octahedral, two numbers of 16 bits with signs.
Vec3 normal_of_code(uint32_t code) {
    const double u = static_cast<int16_t>(code & 0xffff) / 32767.0, v = static_cast<int16_t>(code >> 16) / 32767.0;
    Vec3 p(u, v, 1 - std::abs(u) - std::abs(v));
    if (p.z < 0) p = {std::copysign(1 - std::abs(v), u), std::copysign(1 - std::abs(u), v), p.z};
    return reference::normalized(p);
}

rp_texture_op bump_op(uint32_t op, uint32_t map, std::array<float, 3> a, uint32_t image = 0, uint32_t lookup = 0) {
    return {op, image, lookup, map, {a[0], a[1], a[2], 0}, {}};
}

class BumpsOnDevice : public testing::Test {
protected:
    void add_program(std::vector<rp_texture_op> ops) {
        rp_material m = {};
        m.flags = static_cast<uint32_t>(scene_.texture_ops.size() + 1) << RP_MATERIAL_PROGRAM_SHIFT;
        ops.back().op |= RP_TEXTURE_LAST;
        scene_.materials.push_back(m);
        scene_.texture_ops.insert(scene_.texture_ops.end(), ops.begin(), ops.end());
    }
    // Raises the surface by a number: of the map, or of an image times `scale`.
    void add_bump(rp_texture_op height, float texels) {
        std::vector<rp_texture_op> ops;
        constexpr float steps[][2] = {{0, 0}, {1, 0}, {-1, 1}};
        for (uint32_t i = 0; i < 3; i++) {
            if (i > 0) ops.push_back(bump_op(RP_TEXTURE_SHIFT, RP_NONE, {steps[i][0], steps[i][1], texels}));
            height.lookup = i;
            ops.push_back(height);
        }
        ops.push_back(bump_op(RP_TEXTURE_SHIFT, RP_NONE, {0, -1, texels}));
        ops.push_back(bump_op(RP_TEXTURE_BUMP, RP_NONE, {0, 0, texels}));
        add_program(ops);
    }
    float between(float low, float high) { return std::uniform_real_distribution<float>(low, high)(random_); }
    // With a frame of its own.
    support::ProgramSite random_site(uint32_t material) {
        support::ProgramSite site;
        const reference::Frame frame(reference::normalized(Vec3(between(-1, 1), between(-1, 1), between(-1, 1))));
        const double turn = between(0, 6), c = std::cos(turn), s = std::sin(turn);
        const auto put = [](const Vec3& v, float* to) {
            for (int i = 0; i < 3; i++) to[i] = static_cast<float>(v[i]);
        };
        put(frame.z, site.shading);
        put(c * frame.x + s * frame.y, site.tangent);
        put(c * frame.y - s * frame.x, site.bitangent);
        for (float& x : site.position) x = between(-1, 1);
        site.u = between(0.3f, 0.7f);
        site.v = between(0.3f, 0.7f);
        site.density = between(0.2f, 5);
        site.material = material;
        site.shading_normal = 0x12345678;
        site.sample = static_cast<uint32_t>(random_());
        return site;
    }
    std::vector<support::ProgramOutcome> run(const std::vector<support::ProgramSite>& sites) {
        support::TextureProbe probe(scene_);
        std::vector<support::SlotTexels> texels;
        return probe.run_programs(sites, texels, materials_);
    }
    // Of grey, in steps of 1/65535: 1000 + 500 x + 300 y.
    static std::shared_ptr<const ImageSource> ramp(uint32_t width, uint32_t height) {
        std::vector<uint16_t> codes;
        for (uint32_t y = 0; y < height; y++)
            for (uint32_t x = 0; x < width; x++) codes.push_back(static_cast<uint16_t>(1000 + 500 * x + 300 * y));
        const auto bytes = std::as_bytes(std::span(codes));
        return memory_image("ramp", {width, height, 1, TexelKind::unsigned_16, false}, {bytes.begin(), bytes.end()});
    }

    Scene scene_;
    std::vector<rp_material> materials_;
    std::mt19937 random_{17};
};

Vec3 raised_normal(const support::ProgramSite& s, double along, double across) {
    return reference::normalized(Vec3(s.shading) - along * Vec3(s.tangent) - across * Vec3(s.bitangent));
}

void expect_normal(uint32_t code, const Vec3& expected, const char* what) {
    const Vec3 n = normal_of_code(code);
    for (int i = 0; i < 3; i++) EXPECT_NEAR(n[i], expected[i], 1e-4) << what;  // codes have steps of half of it
}

TEST_F(BumpsOnDevice, APlaneOfUAndVHasItsNormal) {
    std::vector<std::array<float, 2>> slopes;
    for (uint32_t i = 0; i < 20; i++) {
        const float a = between(-0.4f, 0.4f), b = between(-0.4f, 0.4f);
        slopes.push_back({a, b});
        scene_.texture_maps.push_back({RP_MAP_UV, 0, {}, {a, b, 0.5f - 0.5f * (a + b), 0, 0, 0, 0, 0, 0, 0, 0, 0}, {1, 1}, {0, 0}});
        add_bump(bump_op(RP_TEXTURE_UV, i, {0, 0, 0}), i % 2 ? 64.0f : 0.0f);
    }
    std::vector<support::ProgramSite> sites;
    for (uint32_t i = 0; i < 2000; i++) {
        sites.push_back(random_site(i % 20));
        sites.back().width = between(0.008f, 0.05f);
    }
    const auto results = run(sites);
    for (size_t i = 0; i < sites.size(); i++) {
        const auto& [a, b] = slopes[sites[i].material];
        expect_normal(results[i].shading_normal, raised_normal(sites[i], a * sites[i].density, b * sites[i].density), "plane");
    }
}

// What is as wide as a texel at most sees the difference of two texels, whichever they are.
TEST_F(BumpsOnDevice, ARampOfTexelsHasItsNormalSeenFromNear) {
    scene_.images = {ramp(64, 64)};
    add_bump(bump_op(RP_TEXTURE_IMAGE, RP_NONE, {2, 2, 2}), 64);
    std::vector<support::ProgramSite> sites;
    for (uint32_t i = 0; i < 2000; i++) {
        sites.push_back(random_site(0));
        sites.back().width = i % 2 ? 0.0f : between(0, 1) / (64 * sites.back().density);
    }
    const auto results = run(sites);
    for (size_t i = 0; i < sites.size(); i++) {
        const double texel = 2 / 65535.0 * 64 * sites[i].density;
        expect_normal(results[i].shading_normal, raised_normal(sites[i], 500 * texel, 300 * texel), "ramp");
    }
}

// The mean of slopes over random numbers: from farther away, where texels are of several levels, and where they are longer than a step.
TEST_F(BumpsOnDevice, TheMeanOfARampsSlopesIsItsSlope) {
    constexpr uint32_t samples = 4096;
    scene_.images = {ramp(64, 64), ramp(64, 32)};
    for (const uint32_t image : {0u, 1u}) add_bump(bump_op(RP_TEXTURE_IMAGE, RP_NONE, {1, 1, 1}, image), 64);
    for (const uint32_t image : {0u, 1u})
        for (const float texels : {0.5f, 1.0f, 1.3f, 3.3f}) {
            const support::ProgramSite first = random_site(image);
            std::vector<support::ProgramSite> sites(samples, first);
            for (uint32_t i = 0; i < samples; i++) {
                sites[i].sample = i;
                sites[i].width = texels / (64 * first.density);
            }
            double along = 0, across = 0;
            for (const auto& r : run(sites)) {
                const Vec3 n = normal_of_code(r.shading_normal);
                along -= dot(n, Vec3(first.tangent)) / dot(n, Vec3(first.shading)) / samples;
                across -= dot(n, Vec3(first.bitangent)) / dot(n, Vec3(first.shading)) / samples;
            }
            const double texel = 64 * first.density / 65535.0;
            EXPECT_NEAR(along, 500 * texel, 500 * texel * 0.01) << image << ' ' << texels;
            EXPECT_NEAR(across, 300 * texel * (image == 0 ? 1 : 0.5), 300 * texel * 0.01) << image << ' ' << texels;
        }
}

TEST_F(BumpsOnDevice, NormalMapsAreOfTheTangentFrame) {
    std::vector<std::array<float, 3>> colors = {{0.5f, 0.5f, 1}, {0.5f, 0.5f, 0.5f}};
    for (uint32_t i = 0; i < 30; i++) colors.push_back({between(0, 1), between(0, 1), between(0, 1)});
    for (uint32_t i = 0; i < colors.size(); i++) {
        uint16_t texel[4] = {half_of(colors[i][0]), half_of(colors[i][1]), half_of(colors[i][2]), half_of(1)};
        const auto bytes = std::as_bytes(std::span(texel));
        for (size_t k = 0; k < 3; k++) colors[i][k] = float_of_half(texel[k]);
        scene_.images.push_back(memory_image("normals", {1, 1, 4, TexelKind::half, false}, {bytes.begin(), bytes.end()}));
        add_program({bump_op(RP_TEXTURE_IMAGE, RP_NONE, {1, 1, 1}, i), bump_op(RP_TEXTURE_SET, RP_NONE, {0, 0, 0}, RP_PARAMETER_NORMAL)});
    }
    std::vector<support::ProgramSite> sites;
    for (uint32_t i = 0; i < 2000; i++) sites.push_back(random_site(i % static_cast<uint32_t>(colors.size())));
    const auto results = run(sites);
    for (size_t i = 0; i < sites.size(); i++) {
        const support::ProgramSite& s = sites[i];
        const auto& c = colors[s.material];
        if (s.material == 1) {
            EXPECT_EQ(results[i].shading_normal, s.shading_normal);  // no direction
            continue;
        }
        const Vec3 n = (2.0 * c[0] - 1) * Vec3(s.tangent) + (2.0 * c[1] - 1) * Vec3(s.bitangent) + (2.0 * c[2] - 1) * Vec3(s.shading);
        expect_normal(results[i].shading_normal, reference::normalized(n), "normal map");
        if (s.material == 0) expect_normal(results[i].shading_normal, Vec3(s.shading), "the normal itself");
    }
}

// A step is as long as what a path stands for is wide, or where that is less, as a texel; without texels, or u and v, it is the former.
TEST_F(BumpsOnDevice, StepsAreOfTheFootprintOrOfATexel) {
    scene_.texture_maps = {{RP_MAP_POINT, 0, {}, {0.1f, 0, 0, 0.5f, 0, 0.1f, 0, 0.5f, 0, 0, 0.1f, 0.5f}, {1, 1}, {0, 0}},
                           {RP_MAP_UV, 0, {}, {0.1f, 0, 0.5f, 0, 0, 0.1f, 0.5f, 0, 0, 0, 0, 0}, {1, 1}, {0, 0}}};
    constexpr float shifts[][3] = {{1, 0, 0}, {0, 1, 16}, {-1, 1, 16}, {0.5f, -0.25f, 200}};
    for (const auto& [along, across, texels] : shifts)
        add_program({bump_op(RP_TEXTURE_SHIFT, RP_NONE, {along, across, texels}), bump_op(RP_TEXTURE_UV, 0, {0, 0, 0}),
                     bump_op(RP_TEXTURE_SET, RP_NONE, {0, 0, 0}, RP_PARAMETER_COLOR), bump_op(RP_TEXTURE_UV, 1, {0, 0, 0}),
                     bump_op(RP_TEXTURE_SET, RP_NONE, {0, 0, 0}, RP_PARAMETER_SPECULAR)});
    // No step at all: the normal stays.
    add_bump(bump_op(RP_TEXTURE_UV, 1, {0, 0, 0}), 16);
    std::vector<support::ProgramSite> sites;
    for (uint32_t i = 0; i < 2000; i++) {
        sites.push_back(random_site(i % 5));
        sites.back().width = i % 3 ? between(0, 0.2f) : 0;
        if (i % 7 == 0) sites.back().density = 0;
    }
    const auto results = run(sites);
    for (size_t i = 0; i < sites.size(); i++) {
        const support::ProgramSite& s = sites[i];
        if (s.material == 4) {
            if (s.density == 0 && s.width == 0) {
                EXPECT_EQ(results[i].shading_normal, s.shading_normal);
            }
            continue;
        }
        const auto& [along, across, texels] = shifts[s.material];
        const double step = s.density > 0 && texels > 0 ? std::max(double{s.width}, 1 / (double{s.density} * texels)) : s.width;
        const Vec3 p = Vec3(s.position) + step * (along * Vec3(s.tangent) + across * Vec3(s.bitangent));
        const double found[] = {materials_[i].color[0], materials_[i].color[1], materials_[i].specular[0], materials_[i].specular[1]};
        const double expected[] = {0.1 * p.x + 0.5, 0.1 * p.y + 0.5, 0.1 * (s.u + step * s.density * along) + 0.5,
                                   0.1 * (s.v + step * s.density * across) + 0.5};
        for (size_t k = 0; k < 4; k++) EXPECT_NEAR(found[k], expected[k], 1e-6) << i << ' ' << k;
    }
}

}  // namespace
}  // namespace raypager
