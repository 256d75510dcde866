// All kernels on a scene so small that a simulator such as oclgrind gets through it: two slabs, a pool for a fraction of the blocks,
// every material, every kind of light.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "cut/top_tree.hpp"
#include "raypager/materials.hpp"
#include "render/render.hpp"
#include "support/device_scene.hpp"
#include "support/failing_device.hpp"
#include "support/interrupted_render.hpp"
#include "support/small_scene.hpp"
#include "support/test_options.hpp"
#include "support/textured_scene.hpp"
#include "support/thorough.hpp"
#include "unit/bake_scenes.hpp"

namespace raypager {
namespace {

using support::small_scene;

// By persistent threads, too, whose kernels are further ones.
void draw_paged(const Scene& scene, bool by_persistent_threads = support::thorough()) {
    const support::TemporaryFolder folder;
    BakeOptions bake_options;
    bake_options.block_bytes = 16 << 10;
    auto file = support::bake_and_open(scene, bake_options, folder.path(), "small");
    ASSERT_TRUE(file.ok()) << file.status().message();
    ASSERT_GE((*file)->scene().blocks.size(), 4u);
    support::TestOptions options;
    options.spp = 1;
    options.tuning.paths = 64;
    const auto resident = render(**file, options, {});
    ASSERT_TRUE(resident.ok()) << resident.status().message();
    options.geometry_limit_percent = 60;
    for (const Traversal traversal : support::traversals()) {
        const BlockForm form = traversal == Traversal::stream ? BlockForm::wide : BlockForm::stored;
        options.tuning.traversal = traversal;
        options.instruments.slab_bytes = (*file)->scene().largest_block(form) + 64;
        const auto paged = render(**file, options, {});
        ASSERT_TRUE(paged.ok()) << paged.status().message();
        EXPECT_EQ(paged->report.form, form);
        EXPECT_GT(paged->report.paging.evictions, 0u);
        EXPECT_EQ(paged->report.film_hash, resident->report.film_hash);
        EXPECT_EQ(paged->report.clamped_samples, 0u);
    }
    if (!by_persistent_threads) return;
    options.tuning.traversal = Traversal::ray;
    options.instruments.slab_bytes = (*file)->scene().largest_block(BlockForm::stored) + 64;
    options.instruments.device_hooks = std::make_shared<support::PersistentDevice>();
    const auto persistent = render(**file, options, {});
    ASSERT_TRUE(persistent.ok()) << persistent.status().message();
    EXPECT_EQ(persistent->report.film_hash, resident->report.film_hash);
}

TEST(SmallRender, pages_every_stage_and_matches_the_resident_picture) { draw_paged(small_scene(40), true); }

TEST(SmallRender, pages_meshes_with_colors_as_well) { draw_paged(small_scene(40, true)); }

TEST(SmallRender, pages_meshes_with_coordinates_of_textures_as_well) {
    Scene scene = small_scene(40, true);
    support::set_grey_program(scene);
    scene.materials[0].flags |= 1u << RP_MATERIAL_PROGRAM_SHIFT;
    draw_paged(scene);
}

// Everything that kernels for layered materials have, and a mix.
TEST(SmallRender, pages_layered_materials_as_well) {
    Scene scene = small_scene(40);
    rp_material leaf = dielectric_material(1.5f, 0.3f, {1, 1, 1}, {0.5f, 0.5f, 0.5f});
    leaf.transmittance[1] = 0.4f;
    leaf.mirror[0] = 0.2f;
    scene.materials = {coated_diffuse_material({0.6f, 0.6f, 0.6f}, 1.5f, 0.2f),
                       coated_conductor_material({0.2f, 0.9f, 1.1f}, {3.9f, 2.5f, 2.4f}, 0.3f, 1.5f, 0), leaf,
                       glossy_material({0.5f, 0.5f, 0.5f}, {0.04f, 0.04f, 0.04f}, 0.3f), mix_material(2, 3, 0.5f)};
    for (Shape& shape : scene.shapes)
        if (shape.material == 3) shape.material = 4;
    draw_paged(scene);
}

// Positions that are coded with this error: all ways of tracing draw what they draw of the same positions as floats. Adds the strides of the blocks.
void draw_coded(float error, std::initializer_list<double> percents, std::set<uint32_t>& strides) {
    const support::TemporaryFolder folder;
    Scene scene = small_scene(40);
    BakeOptions bake_options;
    bake_options.block_bytes = 16 << 10;
    bake_options.position_error = error;
    const auto coded = support::bake_and_open(scene, bake_options, folder.path(), "coded");
    ASSERT_TRUE(coded.ok()) << coded.status().message();
    EXPECT_EQ((*coded)->scene().position_cell, 2 * error);
    for (uint32_t block = 0; block < (*coded)->scene().blocks.size(); block++) {
        blocks_test::AlignedBytes bytes = blocks_test::read_block(**coded, block);
        const rp_block_header header = BlockView(bytes.span()).header;
        if (header.vertex_count > 0) strides.insert(RP_POSITION_STRIDE(header.flags));
    }
    for (Shape& shape : scene.shapes) {
        if (!shape.mesh) continue;
        TriangleMesh mesh = dynamic_cast<const MeshInMemory&>(*shape.mesh).mesh();
        for (Float3& p : mesh.positions)
            for (float* coordinate : {&p.x, &p.y, &p.z}) *coordinate = std::nearbyint(*coordinate / (2 * error)) * (2 * error) + 0.0f;
        shape.mesh = std::make_shared<MeshInMemory>(shape.mesh->name(), mesh);
    }
    bake_options.position_error = 0;
    const auto moved = support::bake_and_open(scene, bake_options, folder.path(), "moved");
    ASSERT_TRUE(moved.ok()) << moved.status().message();
    support::TestOptions options;
    options.spp = 1;
    options.tuning.paths = 64;
    const auto expected = render(**moved, options, {});
    ASSERT_TRUE(expected.ok()) << expected.status().message();
    for (const Traversal traversal : support::traversals())
        for (const double percent : percents) {
            options.tuning.traversal = traversal;
            options.geometry_limit_percent = percent;
            const auto drawn = render(**coded, options, {});
            ASSERT_TRUE(drawn.ok()) << drawn.status().message();
            EXPECT_EQ(drawn->report.film_hash, expected->report.film_hash) << error << ", " << percent << " %";
        }
}

TEST(SmallRender, coded_blocks_show_the_picture_of_what_they_code) {
    std::set<uint32_t> strides;
    draw_coded(0x1p-11f, {60}, strides);
    EXPECT_TRUE(strides.contains(5)) << "the one at odd bytes";
}

TEST(CodedBlocks, show_the_picture_of_what_they_code) {
    std::set<uint32_t> strides;
    for (const float error : {0x1p-8f, 0x1p-11f, 0x1p-14f, 0x1p-20f, 0x1p-30f}) draw_coded(error, {100, 60}, strides);
    EXPECT_EQ(strides, (std::set<uint32_t>{0, 4, 5, 6, 8}));
}

TEST(SmallRender, records_what_rays_enter) {
    const support::TemporaryFolder folder;
    BakeOptions bake_options;
    bake_options.block_bytes = 16 << 10;
    auto file = support::bake_and_open(small_scene(30), bake_options, folder.path(), "small");
    ASSERT_TRUE(file.ok()) << file.status().message();
    support::TestOptions options;
    options.spp = 1;
    options.tuning.paths = 64;  // so few slots have a log that is full now and then
    const auto plain = render(**file, options, {});
    ASSERT_TRUE(plain.ok()) << plain.status().message();
    EXPECT_FALSE(plain->trace);
    options.instruments.record_paths = 1 << 20;
    options.geometry_limit_percent = 60;
    const auto recorded = render(**file, options, {});
    ASSERT_TRUE(recorded.ok()) << recorded.status().message();
    EXPECT_EQ(recorded->report.film_hash, plain->report.film_hash);
    ASSERT_TRUE(recorded->trace);
    EXPECT_EQ(recorded->trace->path_count(), plain->report.rays.camera);
    EXPECT_EQ(recorded->trace->rays.size(), plain->report.rays.total());
    EXPECT_GT(recorded->trace->visits.size(), 0u);
}

// A log that is full all the time stops rays wherever they are, in the middle of a block too.
TEST(SmallRender, records_the_same_in_a_log_without_room) {
    const support::TemporaryFolder folder;
    BakeOptions bake_options;
    bake_options.block_bytes = 16 << 10;
    Scene scene = small_scene(30);
    scene.shapes.push_back(blocks_test::mesh_shape(blocks_test::soup(3000, 5)));  // rays go through many block entries of a block here
    auto file = support::bake_and_open(scene, bake_options, folder.path(), "small");
    ASSERT_TRUE(file.ok()) << file.status().message();
    support::TestOptions options;
    options.width = 12;
    options.height = 8;
    options.spp = 1;
    options.max_depth = 0;  // no shadow rays, which need more room
    options.tuning.paths = 1;
    options.instruments.record_paths = 1 << 20;
    options.geometry_limit_percent = 60;
    const auto usual = render(**file, options, {});
    ASSERT_TRUE(usual.ok()) << usual.status().message();
    for (const uint32_t events : {2u, 3u, 5u}) {
        SCOPED_TRACE(events);
        options.instruments.visit_events = events;
        const auto stopped = support::render_rounds(**file, options, 5000);
        ASSERT_TRUE(stopped.ok()) << stopped.status().message();
        EXPECT_TRUE(stopped->report.complete);
        EXPECT_EQ(stopped->report.film_hash, usual->report.film_hash);
        EXPECT_EQ(stopped->trace->rays.size(), usual->trace->rays.size());
        EXPECT_EQ(stopped->trace->visits.size(), usual->trace->visits.size());
    }
}

TEST(SmallRender, records_paths_in_the_order_in_which_they_begin) {
    const support::TemporaryFolder folder;
    auto file = support::bake_and_open(small_scene(30), {}, folder.path(), "small");
    ASSERT_TRUE(file.ok()) << file.status().message();
    support::TestOptions options;
    options.width = 8;
    options.height = 4;
    options.spp = 32;
    options.tuning.paths = 16;
    options.instruments.record_paths = 1 << 20;
    const auto chosen = render(**file, options, {});
    ASSERT_TRUE(chosen.ok()) << chosen.status().message();
    ASSERT_GT(chosen->report.region, 0u);
    options.tuning.region = chosen->report.region;
    const auto same = render(**file, options, {});
    ASSERT_TRUE(same.ok()) << same.status().message();
    EXPECT_EQ(chosen->trace->path_rays, same->trace->path_rays);
    options.tuning.region = 0;
    const auto other = render(**file, options, {});
    ASSERT_TRUE(other.ok()) << other.status().message();
    EXPECT_NE(chosen->trace->path_rays, other->trace->path_rays);
}

TEST(SmallRender, goes_on_from_a_checkpoint) {
    const support::TemporaryFolder folder;
    BakeOptions bake_options;
    bake_options.block_bytes = 16 << 10;
    auto file = support::bake_and_open(small_scene(40), bake_options, folder.path(), "small");
    ASSERT_TRUE(file.ok()) << file.status().message();
    ASSERT_GT((*file)->scene().blocks.size(), 4u);
    support::Turns turns(0, 3);
    for (const Traversal traversal : support::traversals()) {
        for (const uint32_t percent : {100u, 60u}) {
            // Rounds after which paths are in different states.
            for (const uint32_t rounds : {2u, 5u}) {
                if (!turns.take()) continue;
                SCOPED_TRACE(testing::Message() << (traversal == Traversal::ray ? "rays, " : "streams, ") << percent << " %, " << rounds
                                                << " rounds");
                RenderOptions options;
                options.spp = 2;
                options.tuning.paths = 64;
                options.tuning.traversal = traversal;
                options.geometry_limit_percent = percent;
                const auto whole = render(**file, options, {});
                ASSERT_TRUE(whole.ok()) << whole.status().message();
                EXPECT_EQ(whole->report.paging.evictions > 0, percent < 100);
                options.checkpoint.file = folder.path() / fmt::format("{}-{}-{}.ckpt", int(traversal), percent, rounds);
                const auto stopped = support::render_rounds(**file, options, rounds);
                ASSERT_TRUE(stopped.ok()) << stopped.status().message();
                ASSERT_FALSE(stopped->report.complete);
                options.checkpoint.resume = true;
                const auto resumed = render(**file, options, {});
                ASSERT_TRUE(resumed.ok()) << resumed.status().message();
                EXPECT_EQ(resumed->report.film_hash, whole->report.film_hash);
            }
        }
    }
}

// Where the log has been full, there are camera rays that have not been traced at all.
TEST(SmallRender, goes_on_from_a_checkpoint_of_a_recorded_render) {
    const support::TemporaryFolder folder;
    auto file = support::bake_and_open(small_scene(12), {}, folder.path(), "small");
    ASSERT_TRUE(file.ok()) << file.status().message();
    support::TestOptions options;
    options.width = 12;
    options.height = 8;
    options.spp = 2;
    options.max_depth = 0;
    options.tuning.paths = 16;
    options.tuning.traversal = Traversal::ray;
    const auto whole = render(**file, options, {});
    ASSERT_TRUE(whole.ok()) << whole.status().message();
    for (const uint32_t rounds : {14u, 150u}) {  // in the first and in the second pass over the picture
        SCOPED_TRACE(rounds);
        options.checkpoint = {};
        options.checkpoint.file = folder.path() / fmt::format("{}.ckpt", rounds);
        options.instruments.record_paths = 1 << 20;
        options.instruments.visit_events = 2;
        const auto stopped = support::render_rounds(**file, options, rounds);
        ASSERT_TRUE(stopped.ok()) << stopped.status().message();
        ASSERT_FALSE(stopped->report.complete);
        options.instruments.record_paths = 0;
        options.checkpoint.resume = true;
        const auto resumed = render(**file, options, {});
        ASSERT_TRUE(resumed.ok()) << resumed.status().message();
        EXPECT_EQ(resumed->report.film_hash, whole->report.film_hash);
    }
}

TEST(SmallRender, an_empty_scene_is_its_background) {
    Scene scene = small_scene(2);
    scene.shapes.clear();
    const support::TemporaryFolder folder;
    auto file = support::bake_and_open(scene, {}, folder.path(), "empty");
    ASSERT_TRUE(file.ok()) << file.status().message();
    support::TestOptions options;
    options.spp = 2;
    options.tuning.paths = 64;
    const auto result = render(**file, options, {});
    ASSERT_TRUE(result.ok()) << result.status().message();
    for (const float value : result->image.values) EXPECT_NEAR(value, 0.3f, 1e-6);
    options.tuning.traversal = Traversal::ray;
    options.instruments.device_hooks = std::make_shared<support::PersistentDevice>();  // whose walks end where they begin
    const auto persistent = render(**file, options, {});
    ASSERT_TRUE(persistent.ok()) << persistent.status().message();
    EXPECT_EQ(persistent->report.film_hash, result->report.film_hash);
}

class SmallProbe : public testing::TestWithParam<Traversal> {};

TEST_P(SmallProbe, traces_resident_blocks) {
    if (GetParam() == Traversal::stream && support::traversals().size() == 1) GTEST_SKIP() << "this device does not trace in streams";
    const support::TemporaryFolder folder;
    BakeOptions bake_options;
    bake_options.block_bytes = 16 << 10;
    auto file = support::bake_and_open(small_scene(30), bake_options, folder.path(), "small");
    ASSERT_TRUE(file.ok()) << file.status().message();
    auto device = support::DeviceScene::create(*file, 0, GetParam());
    ASSERT_TRUE(device.ok()) << device.status().message();
    auto hits = (*device)->trace({{{-1.2f, 5, 0}, INFINITY, {0, -1, 0}}, {{0, 5, 0}, 1, {0, -1, 0}}, {{0, 5, 0}, INFINITY, {0, 1, 0}}});
    ASSERT_TRUE(hits.ok()) << hits.status().message();
    // The first sphere from above: its id follows those of the waves.
    EXPECT_EQ((*hits)[0].primitive, 2 * 30 * 30u);
    EXPECT_NEAR((*hits)[0].t, 5 - 0.95f, 1e-5);
    EXPECT_TRUE((*hits)[0].occluded);
    EXPECT_EQ((*hits)[1].primitive, RP_NONE);
    EXPECT_EQ((*hits)[2].primitive, RP_NONE);
}

// The boxes of all block entries, as if each were a block of its own: the tree over these keeps none of the real blocks together.
std::vector<BlockEntryBox> loose_block_entries(const BlockFile& file) {
    std::vector<BlockEntryBox> boxes;
    for (const rp_block_entry& block_entry : file.scene().block_entries) {
        blocks_test::AlignedBytes bytes = blocks_test::read_block(file, block_entry.block);
        Box box;
        for (const DecodedTriangle& t : decode_subtree(BlockView(bytes.span()), block_entry.root).triangles)
            for (const Float3& v : t.vertices) box.grow(v);
        boxes.push_back({box, 0});
    }
    return boxes;
}

// Rays enter blocks as a whole only where their block entries are a subtree of the top tree. What they hit does not depend on it.
TEST_P(SmallProbe, finds_the_same_below_any_top_tree) {
    if (GetParam() == Traversal::stream && support::traversals().size() == 1) GTEST_SKIP() << "this device does not trace in streams";
    constexpr uint32_t seed = 7;
    const support::TemporaryFolder folder;
    BakeOptions bake_options;
    bake_options.block_bytes = 32 << 10;
    auto file = support::bake_and_open(blocks_test::scene_of({blocks_test::mesh_shape(blocks_test::soup(6000, seed, 0.2f))}), bake_options,
                                       folder.path(), "soup");
    ASSERT_TRUE(file.ok()) << file.status().message();
    const TopTree loose = build_top_tree(loose_block_entries(**file));
    BakedScene other = (*file)->scene();
    other.top_grid = loose.grid;
    other.top_nodes = loose.nodes;
    other.block_entry_paths = loose.paths;
    ASSERT_NE(other.block_entry_paths, (*file)->scene().block_entry_paths);
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> place(-1.5f, 1.5f);
    std::vector<support::ProbeRay> rays;
    for (int i = 0; i < 2000; i++)
        rays.push_back({{place(random), place(random), place(random)}, INFINITY, {place(random), place(random), place(random)}});
    const auto trace = [&](const BakedScene* with) {
        auto device = support::DeviceScene::create(*file, 0, GetParam(), with);
        return device.ok() ? (*device)->trace(rays) : Result<std::vector<support::ProbeHit>>(device.status());
    };
    const auto expected = trace(nullptr), found = trace(&other);
    ASSERT_TRUE(expected.ok()) << expected.status().message();
    ASSERT_TRUE(found.ok()) << found.status().message();
    uint32_t hits = 0;
    for (size_t i = 0; i < rays.size(); i++) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", ray " << i);
        EXPECT_EQ((*found)[i].t, (*expected)[i].t);
        EXPECT_EQ((*found)[i].primitive, (*expected)[i].primitive);
        EXPECT_EQ((*found)[i].occluded, (*expected)[i].occluded);
        EXPECT_EQ((*found)[i].position, (*expected)[i].position);
        hits += (*expected)[i].primitive != RP_NONE ? 1u : 0u;
    }
    EXPECT_GT(hits, 500u);
}

INSTANTIATE_TEST_SUITE_P(traversals, SmallProbe, testing::Values(Traversal::ray, Traversal::stream),
                         [](const auto& param) { return std::string(param.param == Traversal::ray ? "ray" : "stream"); });

}  // namespace
}  // namespace raypager
