// Objects are baked once, in a space of their own; their instances stand where they were put, each found by its own path.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <set>

#include "block/grid.hpp"
#include "support/temporary_folder.hpp"
#include "unit/bake_instanced_scene.hpp"
#include "world/instance_record.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

// Steps of a path, the first one first.
std::vector<int> steps_of(uint64_t path) {
    std::vector<int> steps;
    for (int bit = std::bit_width(path) - 2; bit >= 0; bit--) steps.push_back(static_cast<int>(path >> bit & 1));
    return steps;
}

bool holds(const Grid& grid, const rp_child& child, const std::array<double, 3>& p) {
    const rp_u32 words[3] = {child.x, child.y, child.z};
    for (int a = 0; a < 3; a++) {
        const Interval interval = decode_interval(grid, a, words[a]);
        if (!(interval.lower <= p[static_cast<size_t>(a)] && p[static_cast<size_t>(a)] <= interval.upper)) return false;
    }
    return true;
}

Grid grid_of(const float (&origin)[3], const float (&cell)[3]) {
    Grid grid;
    std::copy_n(origin, 3, grid.origin);
    std::copy_n(cell, 3, grid.cell);
    return grid;
}

Grid grid_of(const rp_block_header& header) {
    Grid grid;
    std::copy_n(header.origin, 3, grid.origin);
    std::copy_n(header.cell, 3, grid.cell);
    return grid;
}

std::vector<Placement> placements_of(const Scene& scene) {
    std::vector<Placement> all;
    for (const auto& source : scene.instances)
        EXPECT_TRUE(source->stream([&](std::span<const Placement> some) { return all.insert(all.end(), some.begin(), some.end()), Status(); }).ok());
    return all;
}

World world_of_object(const Scene& scene, size_t object) {
    Scene part = scene;
    part.shapes = scene.objects[object].shapes;
    return gathered(part).world;
}

class BakeInstances : public testing::Test {
protected:
    void bake_scene() { file_ = bake_and_open(scene_, folder_ / "scene.rpb", 16 << 10, 8); }

    // take(block index, block) of all blocks of instances.
    template <class Take>
    void for_each_block_of_instances(const Take& take) {
        for (uint32_t block = 0; block < file_->scene().blocks.size(); block++) {
            if (file_->scene().blocks[block].instances == 0) continue;
            AlignedBytes bytes = read_block(*file_, block);
            ASSERT_TRUE(file_->check_block(block, bytes.span()).ok()) << file_->check_block(block, bytes.span()).message();
            take(block, InstanceBlock(bytes.span()));
        }
    }

    TemporaryFolder folder_;
    Scene scene_ = instanced_scene();
    std::shared_ptr<const BlockFile> file_;
};

TEST_F(BakeInstances, EachIsReachedOnceByItsPath) {
    bake_scene();
    const std::vector<Placement> placements = placements_of(scene_);
    const Box boxes[2] = {world_of_object(scene_, 0).bounds, world_of_object(scene_, 1).bounds};
    std::set<uint32_t> numbers;
    uint32_t blocks = 0;
    for_each_block_of_instances([&](uint32_t block, const InstanceBlock& view) {
        blocks++;
        ASSERT_EQ(view.header.block_entry_count, 1u);
        const auto entry = std::ranges::find(file_->scene().block_entries, block, &rp_block_entry::block);
        for (uint32_t i = 0; i < view.records.size(); i++) {
            rp_u32 ref = entry->root;
            for (const int side : steps_of(path_of(view.records[i]))) {
                ASSERT_LT(ref, view.nodes.size());
                ref = view.nodes[ref].child[side].ref;
            }
            ASSERT_EQ(ref, RP_REF_LEAF | i << RP_LEAF_INDEX_SHIFT | RP_LEAF_INSTANCE);
            ASSERT_TRUE(numbers.insert(view.numbers[i]).second);
            const Placement& placed = placements.at(view.numbers[i]);
            ASSERT_EQ(view.records[i].object, placed.object);
            auto expected = *make_instance(transform_of(placed), boxes[placed.object]);
            expected.object = placed.object;
            expected.path_low = view.records[i].path_low;
            expected.path_high = view.records[i].path_high;
            ASSERT_EQ(std::memcmp(&expected, &view.records[i], sizeof expected), 0);
        }
    });
    EXPECT_GT(blocks, 1u);
    EXPECT_EQ(numbers.size(), 1000u);
    EXPECT_EQ(*numbers.rbegin(), 999u);
    EXPECT_EQ(file_->scene().instances, 1000u);
}

TEST_F(BakeInstances, BoxesHoldWhatIsPlaced) {
    bake_scene();
    const std::vector<Placement> placements = placements_of(scene_);
    const World worlds[2] = {world_of_object(scene_, 0), world_of_object(scene_, 1)};
    const BakedScene& baked = file_->scene();
    const Grid top_grid = grid_of(baked.top_grid.origin, baked.top_grid.cell);
    size_t tested = 0;
    for_each_block_of_instances([&](uint32_t block, const InstanceBlock& view) {
        const auto entry = static_cast<size_t>(std::ranges::find(baked.block_entries, block, &rp_block_entry::block) - baked.block_entries.begin());
        for (uint32_t i = 0; i < view.records.size(); i++) {
            const Placement& placed = placements.at(view.numbers[i]);
            const World& world = worlds[placed.object];
            for (size_t v = 0; v < world.positions.size(); v += 37) {
                const Float3& p = world.positions[v];
                const auto at = transform_of(placed).point(p.x, p.y, p.z);
                for (size_t a = 0; a < 3; a++) ASSERT_TRUE(baked.lower[a] <= at[a] && at[a] <= baked.upper[a]);
                rp_u32 ref = baked.top_grid.root;
                for (const int side : steps_of(baked.block_entry_paths[entry])) {
                    ASSERT_TRUE(holds(top_grid, baked.top_nodes[ref].child[side], at));
                    ref = baked.top_nodes[ref].child[side].ref;
                }
                ASSERT_EQ(ref, RP_REF_BLOCK_ENTRY | entry);
                ref = baked.block_entries[entry].root;
                for (const int side : steps_of(path_of(view.records[i]))) {
                    ASSERT_TRUE(holds(grid_of(view.header), view.nodes[ref].child[side], at));
                    ref = view.nodes[ref].child[side].ref;
                }
                tested++;
            }
        }
    });
    EXPECT_GT(tested, 10000u);
}

// Ids of primitives go on behind those of the scene's own shapes; each object has a tree over its own blocks.
TEST_F(BakeInstances, ObjectsHaveTreesOfTheirOwn) {
    bake_scene();
    const BakedScene& baked = file_->scene();
    ASSERT_EQ(baked.objects.size(), 2u);
    uint64_t first_id = gathered(scene_).world.primitives.size(), first_entry = 0;
    ASSERT_EQ(first_id, 321u);
    size_t first_node = baked.top_nodes.size() - (baked.objects[0].top.block_entry_count - 1) - (baked.objects[1].top.block_entry_count - 1);
    for (size_t object = 0; object < 2; object++) {
        SCOPED_TRACE(object);
        const World world = world_of_object(scene_, object);
        const rp_object& of = baked.objects[object];
        for (size_t a = 0; a < 3; a++) EXPECT_EQ(of.base[a], static_cast<float>(middle_of(world.bounds)[a]));
        const size_t end_node = first_node + of.top.block_entry_count - 1;
        std::set<uint32_t> blocks, ids;
        for (uint64_t entry = first_entry; entry < first_entry + of.top.block_entry_count; entry++) {
            rp_u32 ref = of.top.root;
            for (const int side : steps_of(baked.block_entry_paths[entry])) {
                ASSERT_TRUE(ref >= first_node && ref < end_node);
                ref = baked.top_nodes[ref].child[side].ref;
            }
            ASSERT_EQ(ref, RP_REF_BLOCK_ENTRY | entry);
            blocks.insert(baked.block_entries[entry].block);
            AlignedBytes bytes = read_block(*file_, baked.block_entries[entry].block);
            const DecodedLeaf found = decode_subtree(BlockView(bytes.span()), baked.block_entries[entry].root);
            for (const DecodedTriangle& t : found.triangles) {
                ASSERT_TRUE(ids.insert(t.id).second);
                const Triangle& expected = world.primitives.at(t.id - first_id);
                for (const Float3& v : t.vertices) ASSERT_TRUE(std::ranges::any_of(expected, [&](uint32_t e) { return world.positions[e] == v; }));
            }
            for (const DecodedSphere& s : found.spheres) {
                ASSERT_TRUE(ids.insert(s.id).second);
                ASSERT_EQ(world.sphere(static_cast<uint32_t>(s.id - first_id)).center, s.center);
            }
        }
        EXPECT_EQ(ids.size(), world.primitives.size());
        EXPECT_EQ(*ids.begin(), first_id);
        EXPECT_EQ(*ids.rbegin(), first_id + world.primitives.size() - 1);
        EXPECT_EQ(blocks.size() > 1, object == 1);
        first_id += world.primitives.size();
        first_entry += of.top.block_entry_count;
        first_node = end_node;
    }
    EXPECT_EQ(first_id, baked.triangles + baked.spheres);
    EXPECT_EQ(first_node, baked.top_nodes.size());
    std::vector<uint32_t> starts;
    for (const rp_primitive_range& range : baked.ranges) starts.push_back(range.first_primitive);
    EXPECT_EQ(starts, (std::vector<uint32_t>{0, 321, 401, 402}));
}

TEST_F(BakeInstances, TwiceIsTheSame) {
    for (const char* name : {"a.rpb", "b.rpb"}) ASSERT_TRUE(bake(scene_, BakeOptions(), folder_ / name).ok());
    EXPECT_EQ(support::read_file(folder_ / "a.rpb"), support::read_file(folder_ / "b.rpb"));
    const auto in_memory = bake(scene_, BakeOptions());
    ASSERT_TRUE(in_memory.ok()) << in_memory.status().message();
    EXPECT_EQ(in_memory->blocks.source().scene().identity(), (*BlockFile::open(folder_ / "a.rpb"))->scene().identity());
    EXPECT_EQ(in_memory->summary.instances, 1000u);
    EXPECT_EQ(in_memory->summary.objects, 2u);
}

// The blocks of the scene's own shapes are what they are without objects, but for their numbers.
TEST_F(BakeInstances, TheRestStaysAsItIs) {
    bake_scene();
    Scene without = scene_;
    without.objects.clear();
    without.instances.clear();
    const auto file = bake_and_open(without, folder_ / "without.rpb", 16 << 10, 8);
    EXPECT_TRUE(file->scene().objects.empty());
    const auto number = static_cast<uint32_t>(file->scene().blocks.size());
    uint64_t of_objects = 0;
    for (const rp_object& object : file_->scene().objects) of_objects += object.top.block_entry_count;
    const uint32_t first_block = file_->scene().block_entries[of_objects].block;
    for (uint32_t block = 0; block < number; block++) {
        AlignedBytes alone = read_block(*file, block), among = read_block(*file_, first_block + block);
        rp_block_header header;
        std::memcpy(&header, among.span().data(), sizeof header);
        header.block_index = block;
        std::memcpy(among.span().data(), &header, sizeof header);
        EXPECT_TRUE(std::ranges::equal(alone.span(), among.span())) << block;
    }
}

TEST_F(BakeInstances, WhatCannotBeMetIsDropped) {
    std::vector<Placement> placements = random_placements(10, 2, 5);
    placements.push_back(placement(0, Transform::scale(1, 0, 1)));
    placements.push_back(placement(1, Transform::translate(2e12, 0, 0)));
    scene_.objects.push_back({"nothing", {}});
    placements.push_back(placement(2, Transform()));
    scene_.instances = {std::make_shared<InstancesInMemory>("here", placements)};
    const auto baked = bake(scene_, BakeOptions());
    ASSERT_TRUE(baked.ok()) << baked.status().message();
    EXPECT_EQ(baked->summary.instances, 10u);
    EXPECT_EQ(baked->blocks.source().scene().objects[2].top.root, RP_REF_EXIT);
    ASSERT_EQ(baked->summary.issues.warnings.size(), 1u);
    EXPECT_NE(baked->summary.issues.warnings[0].text.find(": 2 instances flattened or out of range: dropped"), std::string::npos);
}

TEST_F(BakeInstances, AnObjectAloneIsAScene) {
    scene_.shapes.clear();
    scene_.instances = {std::make_shared<InstancesInMemory>("here", std::vector{placement(0, Transform::translate(5, 6, 7))})};
    bake_scene();
    EXPECT_GT(file_->scene().lower[0], 3.9f);
    scene_.instances.clear();
    const auto nowhere = bake(scene_, BakeOptions());
    ASSERT_TRUE(nowhere.ok()) << nowhere.status().message();
    EXPECT_EQ(nowhere->blocks.source().scene().top_grid.root, RP_REF_EXIT);
    EXPECT_GT(nowhere->blocks.source().scene().top_grid.block_entry_count, 0u);
}

// A source that says it has many.
class Endless final : public InstanceSource {
public:
    explicit Endless(uint64_t count) : count_(count) {}
    Status stream(const std::function<Status(std::span<const Placement>)>& take) const override {
        const std::vector<Placement> some(1000);
        for (;;) RAYPAGER_TRY(take(some));
    }
    uint64_t count() const override { return count_; }
    std::string name() const override { return "endless"; }
    uint64_t fingerprint() const override { return 0; }

private:
    uint64_t count_;
};

TEST_F(BakeInstances, BadOnesAreAnError) {
    const auto message = [&](Placement bad) {
        scene_.instances = {std::make_shared<InstancesInMemory>("here", std::vector{placement(0, Transform()), bad})};
        const auto baked = bake(scene_, BakeOptions());
        return baked ? "" : baked.status().message();
    };
    EXPECT_EQ(message(placement(2, Transform())), "here: instance 1: object 2 does not exist");
    EXPECT_EQ(message(placement(0, Transform::translate(NAN, 0, 0))), "here: instance 1: its transform is not finite");
    scene_.instances = {std::make_shared<Endless>(RP_NONE)};
    const auto baked = bake(scene_, BakeOptions());
    ASSERT_FALSE(baked.ok());
    EXPECT_EQ(baked.status().message(), "endless: the scene has more than 4294967294 instances with it");
}

TEST_F(BakeInstances, StopsWhenAsked) {
    std::atomic<bool> stop = false;
    scene_.instances = {std::make_shared<Endless>(1000)};
    BakeOptions options;
    options.stop = &stop;
    options.progress = [&](const char* stage, double) {
        if (stage == std::string_view("instances")) stop = true;
    };
    const auto baked = bake(scene_, options);
    ASSERT_FALSE(baked.ok());
    EXPECT_NE(baked.status().message().find("stopped"), std::string::npos) << baked.status().message();
}

// An object that is too large for the memory goes over the disk, and is the same primitives under the same ids.
TEST_F(BakeInstances, LargeObjectsGoOverTheDisk) {
    scene_.objects[0].shapes[0] = mesh_shape(icosphere(7));
    BakeOptions options;
    options.host_limit = 16 << 20;
    const auto summary = bake(scene_, options, folder_ / "scene.rpb");
    ASSERT_TRUE(summary.ok()) << summary.status().message();
    EXPECT_GT(summary->buckets, 1u);
    const auto file = *BlockFile::open(folder_ / "scene.rpb");
    const World world = world_of_object(scene_, 0);
    size_t triangles = 0;
    for (size_t entry = 0; entry < file->scene().objects[0].top.block_entry_count; entry++) {
        AlignedBytes bytes = read_block(*file, file->scene().block_entries[entry].block);
        for (const DecodedTriangle& t : decode_subtree(BlockView(bytes.span()), file->scene().block_entries[entry].root).triangles) {
            const Triangle& expected = world.primitives.at(t.id - 321);
            ASSERT_TRUE(std::ranges::any_of(expected, [&](uint32_t v) { return world.positions[v] == t.vertices[0]; }));
            triangles++;
        }
    }
    EXPECT_EQ(triangles, world.primitives.size() - 1);
}

}  // namespace
}  // namespace raypager
