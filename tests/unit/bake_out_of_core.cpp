// A scene that does not fit into the host limit goes over the disk: what comes out must be the same primitives with the same ids.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstring>
#include <set>

#include "base/files.hpp"
#include "base/parallel.hpp"
#include "cut/distribute.hpp"
#include "gather/gather.hpp"
#include "support/failing_file_system.hpp"
#include "unit/bake_scenes.hpp"
#include "world/bake_memory.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

// Small enough that every scene here is spilled, and large ones of its meshes are taken in chunks.
GatherLimits tight(const std::filesystem::path& beside) {
    GatherLimits limits;
    limits.memory.limit = 1 << 20;
    limits.memory.gather = 100 << 10;
    limits.memory.chunk_triangles = 1000;
    limits.memory.buffers = 80 << 10;
    limits.memory.sample = 500;
    limits.spill_beside = beside;
    return limits;
}

Gathered gather_tightly(const Scene& scene, const TemporaryFolder& folder, const PointOptions& points = {}, float position_cell = 0) {
    auto gathered = gather(
        scene, tight(folder / "scene.rpb"), [](const char*, double) {}, points, position_cell);
    if (!gathered) throw std::runtime_error(gathered.status().message());
    return std::move(*gathered);
}

Gathered gather_in_memory(const Scene& scene, const PointOptions& points = {}, float position_cell = 0) {
    auto gathered = gather(
        scene, GatherLimits(), [](const char*, double) {}, points, position_cell);
    if (!gathered) throw std::runtime_error(gathered.status().message());
    return std::move(*gathered);
}

// What a primitive is, in the order in which its vertices are listed, normals included.
using Description = std::vector<uint32_t>;

Description describe(const World& world, uint32_t i) {
    Description words;
    const auto add = [&words](const auto& value) {
        const auto bits = std::bit_cast<std::array<uint32_t, sizeof value / 4>>(value);
        words.insert(words.end(), bits.begin(), bits.end());
    };
    if (world.is_sphere(i)) {
        add(world.sphere(i));
    } else {
        for (const uint32_t v : world.primitives[i]) add(world.vertex(v));
    }
    return words;
}

std::map<uint32_t, Description> describe_all(const std::vector<World>& worlds) {
    std::map<uint32_t, Description> all;
    for (const World& world : worlds)
        for (uint32_t i = 0; i < world.primitives.size(); i++)
            EXPECT_TRUE(all.try_emplace(world.id(i), describe(world, i)).second) << "primitive " << world.id(i) << " is there twice";
    return all;
}

std::vector<World> load_all(const std::vector<Bucket>& buckets) {
    std::vector<World> worlds;
    for (const Bucket& bucket : buckets) {
        auto world = load_bucket(bucket);
        if (!world) throw std::runtime_error(world.status().message());
        worlds.push_back(std::move(*world));
    }
    return worlds;
}

std::vector<Shape> lamps(uint32_t seed) {
    std::vector<Shape> shapes = random_spheres(20, seed);
    shapes.push_back(mesh_shape(icosphere(3)));
    shapes.back().to_world = Transform::scale(0.1, -0.2, 0.3);
    for (Shape& shape : shapes) shape.area_light = 0;
    return shapes;
}

// Meshes that stay whole and such that do not, with normals and without, spheres, lamps, and triangles that no ray can hit.
Scene varied_scene(uint32_t seed) {
    Scene scene = mixed_scene(seed);
    scene.area_lights = {AreaLight{{1, 2, 3}, false}};
    scene.materials.push_back(gray());
    for (Shape& shape : lamps(seed + 7)) scene.shapes.push_back(std::move(shape));
    TriangleMesh damaged = soup(4000, seed + 9);
    std::mt19937 random(seed);
    for (int i = 0; i < 50; i++) {
        damaged.triangles[random() % 4000][random() % 3] = 12000 + random() % 5;
        damaged.positions[random() % 12000].y = std::numeric_limits<float>::quiet_NaN();
        Triangle& t = damaged.triangles[random() % 4000];
        t[1] = t[2];
    }
    scene.shapes.push_back(mesh_shape(std::move(damaged)));
    scene.shapes.back().material = 1;
    scene.shapes.push_back(mesh_shape(painted(terrain(75))));
    scene.shapes.push_back(mesh_shape(painted(terrain(50, true))));
    scene.shapes.push_back(mesh_shape(painted(terrain(20))));
    scene.shapes.back().vertex_colors = false;
    scene.shapes.push_back(mesh_shape(terrain(70, true)));
    scene.shapes.back().to_world = Transform::translate(1, 0, 3) * Transform::rotate(30, 1, 2, 3);
    return scene;
}

TEST(OutOfCore, StreamsTheSamePrimitives) {
    for (uint32_t seed = 1; seed <= 3; seed++) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        const TemporaryFolder folder;
        const Scene scene = varied_scene(seed);
        const float cell = seed == 2 ? 0x1p-12f : 0;
        const Gathered expected = gather_in_memory(scene, {}, cell);
        const Gathered spilled = gather_tightly(scene, folder, {}, cell);
        ASSERT_TRUE(spilled.spilled.has_value());
        ASSERT_FALSE(expected.spilled.has_value());
        EXPECT_EQ(spilled.triangles, expected.triangles);
        EXPECT_EQ(spilled.spheres, expected.spheres);
        EXPECT_EQ(spilled.issues.not_finite, expected.issues.not_finite);
        EXPECT_EQ(spilled.issues.bad_index, expected.issues.bad_index);
        EXPECT_EQ(spilled.issues.degenerate, expected.issues.degenerate);
        EXPECT_GT(spilled.issues.not_compared, 0u) << "no mesh was taken in chunks";
        EXPECT_EQ(std::memcmp(&spilled.world.bounds, &expected.world.bounds, sizeof(Box)), 0);
        ASSERT_EQ(spilled.lights.size(), expected.lights.size());
        EXPECT_EQ(std::memcmp(spilled.lights.data(), expected.lights.data(), expected.lights.size() * sizeof(rp_light)), 0);
        ASSERT_EQ(spilled.ranges.size(), expected.ranges.size());
        EXPECT_EQ(std::memcmp(spilled.ranges.data(), expected.ranges.data(), expected.ranges.size() * sizeof(rp_primitive_range)), 0);
        EXPECT_EQ(describe_all(load_all({*spilled.spilled})), describe_all({expected.world}));
    }
}

// Points of several densities, a few far from all others, and some that lie in one place: more than a cell holds that is looked at as a whole.
std::vector<CloudPoint> uneven_points(uint32_t count, uint32_t seed) {
    std::vector<CloudPoint> points = random_points(count, seed);
    std::mt19937 random(seed);
    std::normal_distribution<float> spread(0, 1);
    for (uint32_t i = 0; i < count; i++) {
        Float3& p = points[i].position;
        if (i % 4 == 1) p = {3 + 0.01f * spread(random), 0.01f * spread(random), 0.01f * spread(random)};
        if (i % 100 == 3) p = {10 * spread(random), 10 * spread(random), 10 * spread(random)};
        if (i % 10 == 7) p = {0.5f, 0.5f, 0.5f};
        if (i % 1000 == 9) p.x = std::numeric_limits<float>::infinity();
    }
    return points;
}

// The cloud goes over the disk in cells of a thousand points, and all points must get what they get in memory.
TEST(OutOfCore, StreamsTheSameClouds) {
    const std::pair<const char*, PointOptions> options[] = {{"own radii and spacing", {}},
                                                            {"given", {.radius = 0.01f}},
                                                            {"spacing", {.radius_from_spacing = true, .radius_scale = 1.5f}},
                                                            {"culled", {.cull_to_camera = true}},
                                                            {"filtered", {.filter_to_image = true}},
                                                            {"all", {.radius_from_spacing = true, .cull_to_camera = true, .filter_to_image = true}}};
    // From far away, whole cells that are too large for memory lie within a pixel.
    for (const auto& [seed, distance] : {std::pair(1u, 4.0f), std::pair(2u, 300.0f)}) {
        Scene scene = scene_of({mesh_shape(soup(3000, seed)), cloud_shape(uneven_points(20000, seed)), sphere_shape({1, 2, 3}, 4),
                                cloud_shape(uneven_points(15000, seed + 10), false), mesh_shape(terrain(20))});
        scene.shapes[1].to_world = Transform::rotate(20, 1, 2, 3) * Transform::scale(2, 2, 2);
        scene.area_lights = {AreaLight{{1, 1, 1}, false}};
        scene.shapes[3].area_light = 0;
        scene.width = scene.height = 400;
        scene.camera = *make_camera({0, 0, -distance}, {0, 0, 1}, {0, 1, 0}, 70, 400, 400);
        for (const auto& [name, points] : options) {
            SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << name);
            const TemporaryFolder folder;
            const Gathered expected = gather_in_memory(scene, points), spilled = gather_tightly(scene, folder, points);
            ASSERT_TRUE(spilled.spilled.has_value());
            EXPECT_EQ(spilled.spheres, expected.spheres);
            EXPECT_EQ(spilled.points_culled, expected.points_culled);
            EXPECT_EQ(spilled.points_merged, expected.points_merged);
            EXPECT_EQ(points.filter_to_image, expected.points_merged > 0);
            EXPECT_EQ(spilled.issues.not_finite, expected.issues.not_finite);
            EXPECT_EQ(spilled.issues.changed_radius, expected.issues.changed_radius);
            ASSERT_EQ(spilled.lights.size(), expected.lights.size());
            EXPECT_EQ(std::memcmp(spilled.lights.data(), expected.lights.data(), expected.lights.size() * sizeof(rp_light)), 0);
            EXPECT_EQ(describe_all(load_all({*spilled.spilled})), describe_all({expected.world}));
        }
    }
}

TEST(OutOfCore, EveryPrimitiveGoesToOneBucketThatFits) {
    for (uint32_t seed = 1; seed <= 3; seed++) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        const TemporaryFolder folder;
        const Scene scene = varied_scene(seed);
        const Gathered expected = gather_in_memory(scene);
        Gathered gathered = gather_tightly(scene, folder);
        DistributeSettings settings;
        settings.memory.bucket = 200 << 10;
        settings.memory.buffers = 12 << 20;
        settings.memory.sample = 3000;
        settings.spill_beside = folder / "scene.rpb";
        settings.progress = [](double fraction) { EXPECT_LE(fraction, 1); };
        const auto buckets = distribute(*gathered.spilled, settings);
        ASSERT_TRUE(buckets.ok()) << buckets.status().message();
        EXPECT_GT(buckets->size(), 10u);
        for (const Bucket& bucket : *buckets) {
            EXPECT_GT(bucket.primitives(), 0u);
            // The sample may mislead by some: its parts hold about a hundred primitives each.
            EXPECT_LT(bucket.memory_bytes(), settings.memory.bucket * 13 / 10);
        }
        const std::vector<World> worlds = load_all(*buckets);
        EXPECT_EQ(describe_all(worlds), describe_all({expected.world}));
        // As they came, whatever threads there are: triangles of each kind by their ids, one kind of records after the other.
        for (const World& world : worlds) {
            size_t falls = 0;
            for (uint32_t i = 1; i < world.ids.size() && !world.is_sphere(i); i++) falls += world.ids[i] < world.ids[i - 1];
            EXPECT_LE(falls, size_t{colored_records});
        }
    }
}

// A world stays in memory until what it takes when it is cut would be too much: arrays that have room ahead are not taken for ones that must move.
TEST(OutOfCore, WorldsStayInMemoryWhileThereIsRoom) {
    const TemporaryFolder folder;
    std::vector<Shape> shapes;
    for (int i = 0; i < 100; i++) shapes.push_back(mesh_shape(icosphere(3)));
    const Scene scene = scene_of(std::move(shapes));
    const uint64_t triangles = 100 * 1280, vertices = 100 * 642;
    const uint64_t needed = triangles * (sizeof(Triangle) + cut_memory) + vertices * (sizeof(Float3) + 4 + 1);
    GatherLimits limits = tight(folder / "scene.rpb");
    for (const double share : {0.9, 1.1}) {
        // A quarter and a thirty-second part are for meshes that are read.
        limits.memory.gather = static_cast<uint64_t>(share * static_cast<double>(needed) * 32 / 23);
        const auto gathered = gather(
            scene, limits, [](const char*, double) {}, {}, 0);
        ASSERT_TRUE(gathered.ok()) << gathered.status().message();
        EXPECT_EQ(gathered->triangles, triangles);
        EXPECT_EQ(gathered->spilled.has_value(), share < 1) << share;
    }
}

// Everything in one place, so that only ids tell the primitives apart.
TEST(OutOfCore, SplitsWhatLiesInOnePlace) {
    TriangleMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles.assign(50000, {0, 1, 2});
    const TemporaryFolder folder;
    const Scene scene = scene_of({mesh_shape(std::move(mesh))});
    const Gathered gathered = gather_tightly(scene, folder);
    DistributeSettings settings;
    settings.memory.bucket = 400 << 10;
    settings.memory.buffers = 4 << 20;
    settings.memory.sample = 1000;
    settings.spill_beside = folder / "scene.rpb";
    settings.progress = [](double) {};
    const auto buckets = distribute(*gathered.spilled, settings);
    ASSERT_TRUE(buckets.ok()) << buckets.status().message();
    EXPECT_GE(buckets->size(), 9u);
    uint64_t count = 0;
    for (const Bucket& bucket : *buckets) count += bucket.primitives();
    EXPECT_EQ(count, 50000u);
}

// So many records at once that they are sorted in several pieces, by several threads if there are, and by one alone.
TEST(OutOfCore, SortsRecordsAlikeWithAnyNumberOfThreads) {
    constexpr uint32_t seed = 11, count = 120000;
    const TemporaryFolder folder;
    const auto spill = [&]() -> Bucket {
        std::mt19937 random(seed);
        const auto coordinate = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
        auto file = SpillFile::create(folder / "scene.rpb");
        if (!file) throw std::runtime_error(file.status().message());
        BucketWriter writer(std::move(*file), 4 << 20);
        for (uint32_t i = 0; i < count; i++) {
            ShadedTriangleRecord record = {};
            const Float3 at = {coordinate(), coordinate(), coordinate()};
            for (int k = 0; k < 3; k++)
                record.vertices[k] = {at.x + 0.01f * coordinate(), at.y + 0.01f * coordinate(), at.z}, record.normals[k] = random();
            record.id = i;
            const SphereRecord sphere = {{at, 0.01f}, i};
            const RecordKind kind = i % 7 == 0 ? sphere_records : i % 3 == 0 ? triangle_records : shaded_records;
            const auto* const bytes =
                kind == sphere_records ? reinterpret_cast<const std::byte*>(&sphere) : reinterpret_cast<const std::byte*>(&record);
            EXPECT_TRUE(writer.add_one(kind, bytes).ok());
        }
        auto bucket = writer.finish();
        if (!bucket) throw std::runtime_error(bucket.status().message());
        return std::move(*bucket);
    };
    DistributeSettings settings;
    settings.memory.limit = 256 << 20;
    settings.memory.bucket = 3 << 20;
    settings.memory.buffers = 16 << 20;
    settings.memory.sample = 5000;
    settings.spill_beside = folder / "scene.rpb";
    settings.progress = [](double) {};
    const auto sorted = [&] {
        const auto buckets = distribute(spill(), settings);
        if (!buckets) throw std::runtime_error(buckets.status().message());
        return load_all(*buckets);
    };
    const std::vector<World> worlds = sorted();
    EXPECT_GT(worlds.size(), 3u);
    std::vector<World> of_one_thread;
    {
        const WorkersAtMost one(1);
        of_one_thread = sorted();
    }
    ASSERT_EQ(worlds.size(), of_one_thread.size());
    for (size_t i = 0; i < worlds.size(); i++) EXPECT_EQ(worlds[i].ids, of_one_thread[i].ids) << "seed " << seed << ", bucket " << i;
    const auto described = describe_all(worlds);
    EXPECT_EQ(described.size(), count);
    EXPECT_EQ(described, describe_all({load_all({spill()})}));
}

// Through the whole bake, at the smallest limit: a scene too large for it, so that it takes several buckets.
class BakeOutOfCore : public testing::Test {
protected:
    static Scene large_scene() {
        std::vector<Shape> shapes = random_spheres(1000, 5);
        shapes.push_back(mesh_shape(terrain(400)));
        shapes.push_back(mesh_shape(icosphere(6)));
        shapes.back().to_world = Transform::translate(0.5, 0, 0.5) * Transform::scale(0.2, 0.2, 0.2);
        return scene_of(std::move(shapes));
    }

    static Result<BakeSummary> bake_at(const Scene& scene, uint64_t limit, const std::filesystem::path& output) {
        BakeOptions options;
        options.block_bytes = 64 << 10;
        options.host_limit = limit;
        return bake(scene, options, output);
    }

    static std::set<uint32_t> ids_of(const BlockFile& file) {
        std::set<uint32_t> ids;
        for (uint32_t b = 0; b < file.scene().blocks.size(); b++) {
            AlignedBytes bytes = read_block(file, b);
            EXPECT_TRUE(file.check_block(b, bytes.span()).ok());
            const BlockView view(bytes.span());
            for (const rp_block_entry& block_entry : file.scene().block_entries) {
                if (block_entry.block != b) continue;
                const DecodedLeaf found = decode_subtree(view, block_entry.root);
                for (const auto& t : found.triangles) EXPECT_TRUE(ids.insert(t.id).second) << t.id;
                for (const auto& s : found.spheres) EXPECT_TRUE(ids.insert(s.id).second) << s.id;
            }
        }
        return ids;
    }

    TemporaryFolder folder_;
};

TEST_F(BakeOutOfCore, HoldsEveryPrimitiveOnceInAsFewBytes) {
    const Scene scene = large_scene();
    const auto in_memory = bake_at(scene, uint64_t{4} << 30, folder_ / "a.rpb"), tight = bake_at(scene, smallest_bake_limit(), folder_ / "b.rpb");
    ASSERT_TRUE(in_memory.ok()) << in_memory.status().message();
    ASSERT_TRUE(tight.ok()) << tight.status().message();
    EXPECT_EQ(in_memory->buckets, 0u);
    EXPECT_GT(tight->buckets, 1u);
    EXPECT_EQ(tight->triangles, in_memory->triangles);
    EXPECT_EQ(tight->spheres, in_memory->spheres);
    // Blocks end where buckets do: a little more of headers and of vertices that two blocks share.
    EXPECT_LT(static_cast<double>(tight->stored_bytes), 1.03 * static_cast<double>(in_memory->stored_bytes));
    const auto file = BlockFile::open(folder_ / "b.rpb");
    ASSERT_TRUE(file.ok()) << file.status().message();
    EXPECT_EQ(ids_of(**file).size(), tight->triangles + tight->spheres);
}

TEST_F(BakeOutOfCore, ALimitTooSmallIsRefusedWithTheSmallest) {
    const Scene scene = scene_of({mesh_shape(terrain(10))});
    const auto refused = bake_at(scene, smallest_bake_limit(64 << 10) - 1, folder_ / "a.rpb");
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.status().exit_code(), 2);
    EXPECT_NE(refused.status().message().find(std::to_string(smallest_bake_limit(64 << 10))), std::string::npos) << refused.status().message();
    EXPECT_TRUE(bake_at(scene, smallest_bake_limit(64 << 10), folder_ / "a.rpb").ok());
}

// Nothing but the finished file may be left, whatever happens.
size_t files_in(const std::filesystem::path& folder) {
    return static_cast<size_t>(std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator()));
}

TEST_F(BakeOutOfCore, StopsAtAnyStageWithoutATrace) {
    const Scene scene = large_scene();
    for (const std::string_view stage : {"stream", "distribute", "build"}) {
        std::atomic<bool> stop = false;
        BakeOptions options;
        options.block_bytes = 64 << 10;
        options.host_limit = smallest_bake_limit();
        options.stop = &stop;
        options.progress = [&](const char* name, double) { stop = stop || name == stage; };
        const auto summary = bake(scene, options, folder_ / "a.rpb");
        ASSERT_TRUE(stop) << stage;
        ASSERT_FALSE(summary.ok()) << stage;
        EXPECT_NE(summary.status().message().find("stopped"), std::string::npos) << summary.status().message();
        EXPECT_EQ(files_in(folder_ / ""), 0u) << stage;
    }
}

// The disk fills up, or fails to be read, at any write or read.
TEST_F(BakeOutOfCore, AFailingDiskIsOneClearError) {
    const Scene scene = large_scene();
    support::FailingFileSystem disk;
    int met = 0;
    for (const bool write : {true, false}) {
        for (const int after : {1, 3, 20, 60}) {
            SCOPED_TRACE(testing::Message() << (write ? "write " : "read ") << after);
            disk.error_number = write ? ENOSPC : EIO;
            (write ? disk.fail_write_in : disk.fail_read_in) = after;
            const auto summary = bake_at(scene, smallest_bake_limit(), folder_ / "a.rpb");
            const bool failed = (write ? disk.fail_write_in : disk.fail_read_in) <= 0;
            disk.fail_read_in = disk.fail_write_in = 0;
            EXPECT_EQ(summary.ok(), !failed);
            met += failed;
            if (!failed) continue;
            EXPECT_EQ(summary.status().message().find('\n'), std::string::npos);
            EXPECT_NE(summary.status().message().find(std::filesystem::path(folder_ / "").parent_path().string()), std::string::npos)
                << summary.status().message();
            EXPECT_NE(summary.status().message().find(write ? "No space left" : "Input/output error"), std::string::npos)
                << summary.status().message();
            EXPECT_EQ(files_in(folder_ / ""), 0u);
        }
    }
    EXPECT_GT(met, 5) << "the faults did not happen";
}

}  // namespace
}  // namespace raypager
