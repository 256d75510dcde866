// Instances against the same scene in which each is written out as shapes of its own: hits, by Embree, and pictures. Both ways round differently: an
// instance takes the ray into its object, a copy takes the object into the world.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "raypager/materials.hpp"
#include "reference/geometry.hpp"
#include "reference/instanced_scenes.hpp"
#include "reference/rays.hpp"
#include "reference/scene_builder.hpp"
#include "reference/textured_scenes.hpp"
#include "render/render.hpp"
#include "scene/octahedral.hpp"
#include "support/device_scene.hpp"
#include "support/test_options.hpp"
#include "support/textured_scene.hpp"

namespace raypager {
namespace {

using reference::RayKind;
using reference::Vec3;

BakeOptions small_blocks() {
    BakeOptions options;
    options.block_bytes = 16 << 10;
    options.flatten_limit = 0;
    return options;
}

class Instances : public testing::Test {
protected:
    std::shared_ptr<const BlockFile> baked(const Scene& scene, const char* name) const {
        auto file = support::bake_and_open(scene, small_blocks(), folder_.path(), name);
        if (!file.ok()) throw std::runtime_error(file.status().message());
        return *file;
    }
    const support::TemporaryFolder folder_;
};

// Rays that find something else among instances than among copies.
struct Differences {
    size_t rays = 0, elsewhere = 0, found = 0, turned = 0;
    size_t apart = 0;  // of places that should be the same
};

// far: how far apart the same place may be in both.
Differences compare(support::DeviceScene& device, const reference::ReferenceGeometry& copies, RayKind kind, double far) {
    constexpr uint64_t seed = 20261128;
    const size_t rays_of_kind = support::thorough() ? 250000 : 50000;  // of four kinds: a million rays per scene
    std::vector<reference::Ray> rays = reference::make_rays(copies, kind, rays_of_kind, seed);
    std::vector<support::ProbeRay> probes;
    for (reference::Ray& ray : rays) {
        // As those of a render: of length 1, which instances rely on.
        const double length = reference::length(Vec3(ray.direction));
        ray.direction = (Vec3(ray.direction) / length).to_float();
        ray.tmax *= static_cast<float>(length);
        probes.push_back({ray.origin, ray.tmax, ray.direction});
    }
    Differences result;
    result.rays = rays.size();
    const auto hits = device.trace(probes);
    EXPECT_TRUE(hits.ok()) << hits.status().message();
    if (!hits) return result;
    for (size_t i = 0; i < rays.size(); i++) {
        const support::ProbeHit& hit = (*hits)[i];
        EXPECT_EQ(hit.occluded != 0, hit.primitive != RP_NONE) << reference::name(kind) << " ray " << i << ", seed " << seed;
        const reference::Hit expected = copies.closest(rays[i]);
        const bool same = expected.found() == (hit.primitive != RP_NONE) && (!expected.found() || std::abs(hit.t - expected.t) < far);
        result.elsewhere += !same;
        if (!same || !expected.found()) continue;
        result.found++;
        result.apart += reference::length(Vec3(hit.position) - copies.position(expected)) > far;
        result.turned += reference::dot(Vec3(decode_octahedral(hit.normal)), expected.normal) < 0.999;
    }
    std::printf("%s: %zu of %zu rays elsewhere, %zu normals turned and %zu places apart of %zu\n", reference::name(kind), result.elsewhere,
                result.rays, result.turned, result.apart, result.found);
    return result;
}

struct RaysCase {
    const char* name;
    Scene (*make)();
    uint64_t instances;
    // Objects are some units large, and rays come from as far: what either way rounds is some 1e-6 of that, times what an uneven placement stretches
    // it by, 7 at most. Far from the world's origin copies are rounded to what floats have there, which bends small things; instances are not.
    double far, bent;
};
const RaysCase rays_cases[] = {
    {"strewn", [] { return reference::strewn(300); }, 302, 1e-4, 0},
    {"groves", [] { return reference::groves(9, {}, 0, false); }, 61, 1e-4, 0},
    {"groves_far_away", [] { return reference::groves(9, {}, 3000, false); }, 61, 2e-3, 2e-3},
};
void PrintTo(const RaysCase& c, std::ostream* out) { *out << c.name; }

class InstanceRays : public Instances, public testing::WithParamInterface<RaysCase> {};

TEST_P(InstanceRays, hit_what_embree_hits_of_copies) {
    const Scene scene = GetParam().make();
    const auto copies = reference::ReferenceGeometry::build(reference::written_out(scene));
    ASSERT_TRUE(copies.ok()) << copies.status().message();
    const auto file = baked(scene, "instances");
    ASSERT_EQ(file->scene().instances, GetParam().instances);
    auto device = support::DeviceScene::create(file);
    ASSERT_TRUE(device.ok()) << device.status().message();
    for (const RayKind kind : {RayKind::random, RayKind::edges, RayKind::vertices, RayKind::axis_parallel}) {
        const Differences found = compare(**device, **copies, kind, GetParam().far);
        // Where a ray goes along an edge, one of its triangles or the other is hit, or what is behind; and where it is nearly in the plane of a
        // triangle, rounding moves the place along it.
        const bool hard = kind != RayKind::random;
        const auto few = [&](double share_of_hard, size_t of) {
            return 2 + static_cast<size_t>(static_cast<double>(of) * (hard ? share_of_hard : GetParam().bent));
        };
        EXPECT_LE(found.elsewhere, few(0.03, found.rays)) << reference::name(kind);
        EXPECT_LE(found.turned, few(0.1, found.found)) << reference::name(kind);
        EXPECT_LE(found.apart, found.found / (hard ? 100 : 1000)) << reference::name(kind);
        EXPECT_GT(found.found, found.rays / 10) << "most rays hit nothing";
    }
}

INSTANTIATE_TEST_SUITE_P(scenes, InstanceRays, testing::ValuesIn(rays_cases), [](const auto& param) { return std::string(param.param.name); });

// Rays from within a closed object that instances place cannot get out.
TEST_F(Instances, closed_objects_have_no_gaps) {
    Scene scene = reference::strewn(40, {}, false);
    scene.shapes.resize(1);
    const auto file = baked(scene, "closed");
    auto device = support::DeviceScene::create(file);
    ASSERT_TRUE(device.ok()) << device.status().message();
    std::vector<support::ProbeRay> probes;
    std::mt19937_64 random(3);
    std::normal_distribution<float> along;
    for (const auto& source : scene.instances) {
        const Status status = source->stream([&](std::span<const Placement> placements) {
            for (const Placement& p : placements) {
                if (p.object != 0) continue;
                // The middle of the ball.
                Float3 middle;
                float* const to[3] = {&middle.x, &middle.y, &middle.z};
                for (size_t i = 0; i < 3; i++)
                    *to[i] = static_cast<float>(p.to_world[i][0] * 3 - p.to_world[i][1] * 2 + p.to_world[i][2] + p.to_world[i][3]);
                for (int i = 0; i < 20000; i++)
                    probes.push_back({middle, std::numeric_limits<float>::infinity(), {along(random), along(random), along(random)}});
            }
            return Status();
        });
        ASSERT_TRUE(status.ok());
    }
    ASSERT_GT(probes.size(), 100000u);
    const auto hits = (*device)->trace(probes);
    ASSERT_TRUE(hits.ok()) << hits.status().message();
    size_t out = 0;
    for (const support::ProbeHit& hit : *hits) out += hit.primitive == RP_NONE;
    EXPECT_EQ(out, 0u);
}

// All have the same materials, so that most share their kernels.
void add_materials_of_all_kinds(reference::SceneBuilder& builder) {
    const rp_material materials[] = {
        reference::absorber(),       diffuse_material({0.8f, 0.6f, 0.4f}), translucent_material({0.3f, 0.2f, 0.1f}, {0.5f, 0.5f, 0.5f}),
        diffuse_material({1, 1, 0}), diffuse_material({0, 1, 1}),          mix_material(3, 4, 0.25f),
        diffuse_material({1, 1, 1})};
    for (const rp_material& material : materials) builder.material(material);
    support::set_grey_program(builder.scene());
    builder.scene().materials.back().flags |= 1u << RP_MATERIAL_PROGRAM_SHIFT;
}

// Under a sky that shines alike everywhere, what nothing shades has the radiance that it reflects and lets through.
TEST_F(Instances, have_the_colors_that_they_are_given) {
    struct Case {
        const char* name;
        uint32_t material;  // that is put on the instance
        Float3 expected;
        bool vertex_colors = false, point = false;
    };
    const Case cases[] = {{"plain", 1, {0.8f, 0.6f, 0.4f}},    {"translucent", 2, {0.8f, 0.7f, 0.6f}}, {"mixed", 5, {0.75f, 1, 0.25f}},
                          {"textured", 6, {0.5f, 0.5f, 0.5f}}, {"of vertices", 1, {1, 1, 1}, true},    {"of a point", 1, {1, 1, 1}, false, true}};
    const Float3 tint = {0.9f, 0.5f, 0.25f};
    for (const Case& c : cases) {
        SCOPED_TRACE(c.name);
        reference::SceneBuilder builder({32, 24});
        Scene& scene = builder.scene();
        add_materials_of_all_kinds(builder);
        TriangleMesh mesh = reference::quad({-20, -20, 0}, {40, 0, 0}, {0, 40, 0}, 9);
        if (c.vertex_colors) mesh.colors.assign(mesh.positions.size(), 0xffffffu);
        if (c.point)
            builder.add_points("point", {{{0, 0, 0}, 2.5f, 0xffffffu}}, true, 0);
        else
            builder.add("quad", std::move(mesh), 0);
        scene.objects.push_back({"object", std::move(scene.shapes)});
        scene.shapes.clear();
        Placement placed = {.object = 0, .material = c.material, .color = tint};
        placed.to_world[0][0] = -1;
        scene.instances = {std::make_shared<InstancesInMemory>("one", std::vector{placed})};
        builder.infinite_light({1, 1, 1});
        builder.camera({0, 0, 8}, {0, 0, 0}, {0, 1, 0}, 20);
        scene.max_depth = 1;
        support::TestOptions options;
        options.spp = 64;
        options.tuning.traversal = &c - cases < 2 ? Traversal::ray : Traversal::stream;
        const auto drawn = render(*baked(builder.scene(), "tinted"), options, {});
        ASSERT_TRUE(drawn.ok()) << drawn.status().message();
        double mean[3] = {};
        for (size_t i = 0; i < drawn->image.values.size(); i++) mean[i % 3] += drawn->image.values[i] / (32 * 24);
        // Of 49152 samples, each of which is 0 to 2 times the mean.
        EXPECT_NEAR(mean[0], c.expected.x * tint.x, 0.01);
        EXPECT_NEAR(mean[1], c.expected.y * tint.y, 0.01);
        EXPECT_NEAR(mean[2], c.expected.z * tint.z, 0.01);
    }
}

// Rays meet nothing of such instances; they light what there is.
TEST_F(Instances, of_nothing_but_unseen_lights_light_the_scene) {
    reference::SceneBuilder builder({16, 12});
    Scene& scene = builder.scene();
    const uint32_t white = builder.material(reference::diffuse(Vec3(0.8)));
    Shape& glow = builder.add("glow", reference::quad({-1, -1, 0}, {0, 2, 0}, {2, 0, 0}), white);
    builder.shine(glow, {5, 5, 5});
    glow.unseen = true;
    scene.objects.push_back({"glow", std::move(scene.shapes)});
    scene.shapes.clear();
    builder.add("floor", reference::quad({-4, -4, 0}, {8, 0, 0}, {0, 8, 0}, 4), white);
    std::vector<Placement> placements(2);
    placements[0].to_world[2][3] = placements[1].to_world[2][3] = 2;
    placements[1].to_world[0][3] = 1;
    scene.instances.push_back(std::make_shared<InstancesInMemory>("glows", std::move(placements)));
    builder.camera({0, -6, 3}, {0, 0, 0}, {0, 0, 1}, 45);
    const auto file = baked(builder.finish(), "unseen");
    ASSERT_EQ(file->scene().instances, 0u);
    ASSERT_EQ(file->scene().lights.size(), 4u);
    support::TestOptions options;
    options.spp = 4;
    uint64_t hash = 0;
    for (const Traversal traversal : support::traversals()) {
        options.tuning.traversal = traversal;
        const auto rendered = render(*file, options, {});
        ASSERT_TRUE(rendered.ok()) << rendered.status().message();
        EXPECT_GT(*std::ranges::max_element(rendered->image.values), 0.1f);
        if (hash == 0) hash = rendered->report.film_hash;
        EXPECT_EQ(rendered->report.film_hash, hash);
    }
}

struct CopiesCase {
    const char* name;
    Scene (*make)();
};
const CopiesCase copies_cases[] = {
    {"strewn",
     [] {
         return reference::strewn(120, {64, 48}, true);
     }},
    {"hedge",
     [] {
         return reference::instanced_hedge(60, {64, 48});
     }},
    {"overridden_hedge",
     [] {
         return reference::overridden_hedge(60, {64, 48}, false);
     }},
    {"lanterns",
     [] {
         return reference::strewn_lanterns(60, {64, 48});
     }},
    {"groves",
     [] {
         return reference::groves(9, {64, 48}, 0, false);
     }},
};
void PrintTo(const CopiesCase& c, std::ostream* out) { *out << c.name; }

class InstancePictures : public Instances, public testing::WithParamInterface<CopiesCase> {};

// Random numbers are the same, so that most paths are the same, too, but for last bits; glass and mirrors make more of these. Far less than the
// noise: that is what other random numbers differ by.
TEST_P(InstancePictures, are_those_of_copies) {
    const Scene scene = GetParam().make();
    support::TestOptions options;
    options.spp = 16;
    const auto instances = render(*baked(scene, "instances"), options, {});
    ASSERT_TRUE(instances.ok()) << instances.status().message();
    const auto file = baked(reference::written_out(scene), "copies");
    const auto copies = render(*file, options, {});
    ASSERT_TRUE(copies.ok()) << copies.status().message();
    options.seed = 77;
    const auto others = render(*file, options, {});
    ASSERT_TRUE(others.ok()) << others.status().message();
    const auto difference = [&](const Image& image) {
        double sum = 0;
        for (size_t i = 0; i < image.values.size(); i++) sum += std::min(std::abs(image.values[i] - copies->image.values[i]), 1.0f);
        return sum / static_cast<double>(image.values.size());
    };
    const double found = difference(instances->image), noise = difference(others->image);
    std::printf("%s: %.5f, of noise of %.5f\n", GetParam().name, found, noise);
    EXPECT_LT(found, noise / 4);
    EXPECT_NE(instances->report.film_hash, copies->report.film_hash) << "the same film twice";
}

INSTANTIATE_TEST_SUITE_P(scenes, InstancePictures, testing::ValuesIn(copies_cases), [](const auto& param) { return std::string(param.param.name); });

}  // namespace
}  // namespace raypager
