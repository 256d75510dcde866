// Damaged blocks of instances, and damaged trees above objects, are refused even where checksums are right.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "block/check_block.hpp"
#include "block/instanced_count.hpp"
#include "store/check_scene.hpp"
#include "unit/bake_instanced_scene.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

class DamagedInstances : public testing::Test {
protected:
    void SetUp() override {
        file_ = bake_and_open(instanced_scene(300), folder_ / "scene.rpb", 16 << 10, 8);
        scene_ = file_->scene();
        while (scene_.blocks[block_].instances == 0) block_++;
        AlignedBytes bytes = read_block(*file_, block_);
        good_.assign(bytes.span().begin(), bytes.span().end());
        std::memcpy(&header_, good_.data(), sizeof header_);
        ASSERT_TRUE(check_block_bytes(scene_, block_, good_).ok());
        ASSERT_TRUE(check_scene(scene_, file_->file_bytes()).ok());
    }

    // What the check says of the block with one item changed.
    template <class T>
    std::string with_item(size_t section_at, size_t index, const std::function<void(T&)>& change) const {
        std::vector<std::byte> bytes = good_;
        T item;
        std::memcpy(&item, bytes.data() + section_at + index * sizeof item, sizeof item);
        change(item);
        std::memcpy(bytes.data() + section_at + index * sizeof item, &item, sizeof item);
        return check_block_bytes(scene_, block_, bytes).message();
    }
    std::string with_record(const std::function<void(rp_instance&)>& change) const { return with_item(header_.leaves_at, 3, change); }
    std::string with_header(const std::function<void(rp_block_header&)>& change) const { return with_item(0, 0, change); }

    std::string with_scene(const std::function<void(BakedScene&)>& change) const {
        BakedScene scene = scene_;
        change(scene);
        return check_scene(scene, file_->file_bytes()).message();
    }

    TemporaryFolder folder_;
    std::shared_ptr<const BlockFile> file_;
    BakedScene scene_;
    uint32_t block_ = 0;
    std::vector<std::byte> good_;
    rp_block_header header_ = {};
};

TEST_F(DamagedInstances, Records) {
    EXPECT_EQ(with_record([](rp_instance& r) { r.object = 2; }), "instance 3 is of an object that does not exist, or has nothing in it");
    for (const float bad : {float(NAN), float(INFINITY), 1e20f}) {
        if (bad != 1e20f) {
            EXPECT_EQ(with_record([&](rp_instance& r) { r.to_object[4] = bad; }), "instance 3 is not finite, or too far away");
        }
        EXPECT_EQ(with_record([&](rp_instance& r) { r.center[2] = bad; }), "instance 3 is not finite, or too far away");
        EXPECT_EQ(with_record([&](rp_instance& r) { r.reach = bad; }), "instance 3 is not finite, or too far away");
    }
    EXPECT_EQ(with_record([](rp_instance& r) { r.reach = -1; }), "instance 3 is not finite, or too far away");
    EXPECT_EQ(with_record([](rp_instance& r) { std::fill_n(r.to_object, 9, 0.0f); }), "instance 3 is flat");
    EXPECT_EQ(with_record([](rp_instance& r) { std::copy_n(r.to_object, 3, r.to_object + 6); }), "instance 3 is flat");
    EXPECT_EQ(with_record([](rp_instance& r) { r.path_low ^= 1; }), "the path of instance 3 leads elsewhere");
    EXPECT_EQ(with_record([](rp_instance& r) { r.path_high ^= 1; }), "the path of instance 3 leads elsewhere");
    const size_t numbers_at = header_.leaves_at + header_.leaf_count * sizeof(rp_instance);
    EXPECT_EQ(with_item<rp_u32>(numbers_at, 5, [](rp_u32& number) { number = 300; }), "instance 5 has a number that does not exist");
    scene_.objects[0].top.root = RP_REF_EXIT;
    EXPECT_FALSE(check_block_bytes(scene_, block_, good_).ok());
}

// An instance of an object that shines has its lights, and no other's.
TEST_F(DamagedInstances, TraitsOfRecords) {
    const auto with_traits = [&](uint32_t number) {
        return with_record([&](rp_instance& r) { r.path_high = (r.path_high & RP_INSTANCE_PATH_HIGH) | number << RP_INSTANCE_TRAITS_SHIFT; });
    };
    EXPECT_EQ(with_traits(1), "instance 3 has traits that do not exist");
    rp_instance record;
    std::memcpy(&record, good_.data() + header_.leaves_at + 3 * sizeof record, sizeof record);
    const rp_instance_traits plain = {{1, 1, 1}, RP_NONE, RP_NONE, 0, RP_NONE, 0};
    rp_instance_traits shining = plain;
    shining.first_light = 0, shining.light_count = 1, shining.object = record.object;
    scene_.instance_traits = {plain, shining};
    EXPECT_EQ(with_traits(1), "");
    EXPECT_EQ(with_traits(2), "");
    EXPECT_EQ(with_traits(3), "instance 3 has traits that do not exist");
    scene_.instance_traits[1].object ^= 1;
    EXPECT_EQ(with_traits(2), "instance 3 has the lights of another object");
    scene_.ranges[scene_.objects[record.object].first_range].first_light = 0;
    // Others of that object come before it.
    EXPECT_NE(with_traits(1).find("has no lights"), std::string::npos);
    EXPECT_NE(with_traits(0).find("has no lights"), std::string::npos);
}

TEST_F(DamagedInstances, Trees) {
    // The last node has two leaves, since nodes lie in depth-first order: the one that is met last.
    const auto last = [&](const std::function<void(rp_node&)>& change) { return with_item(header_.nodes_at, header_.node_count - 1, change); };
    EXPECT_EQ(last([](rp_node& n) { n.child[0].z = RP_BOX_ABSENT; }),
              "the boxes of node " + std::to_string(header_.node_count - 1) + " make no sense");
    const std::string twice = last([](rp_node& n) { n.child[1].ref = n.child[0].ref; });
    EXPECT_NE(twice.find("is absent or out of order"), std::string::npos) << twice;
    const std::string swapped = last([](rp_node& n) { std::swap(n.child[0].ref, n.child[1].ref); });
    EXPECT_NE(swapped.find("is absent or out of order"), std::string::npos) << swapped;
    for (const rp_u32 flag : {RP_LEAF_POINTS, RP_LEAF_SPHERES, 0x10u, 1u, RP_REF_BLOCK_ENTRY ^ RP_REF_LEAF}) {
        const std::string other = last([&](rp_node& n) { n.child[1].ref ^= flag; });
        EXPECT_NE(other.find("is no instance"), std::string::npos) << flag << other;
    }
    const std::string beyond = last([&](rp_node& n) { n.child[1].ref += 1u << RP_LEAF_INDEX_SHIFT; });
    EXPECT_NE(beyond.find("is absent or out of order"), std::string::npos) << beyond;
    const std::string circle = last([](rp_node& n) { n.child[1].ref = 0; });
    EXPECT_EQ(circle, "node 0 is absent or out of order");
    const std::string early = with_item<rp_node>(header_.nodes_at, 0, [](rp_node& n) { n.child[1].ref = RP_REF_LEAF | RP_LEAF_INSTANCE; });
    EXPECT_NE(early.find("is absent or out of order"), std::string::npos) << early;
}

TEST_F(DamagedInstances, Headers) {
    EXPECT_NE(with_header([](rp_block_header& h) { h.attributes_at = 0; }), "");
    EXPECT_NE(with_header([](rp_block_header& h) { h.attributes_at |= RP_BLOCK_UVS; }), "");
    EXPECT_NE(with_header([](rp_block_header& h) { h.attributes_at |= 256; }), "");
    EXPECT_EQ(with_header([](rp_block_header& h) { h.leaf_count--; }), "the number of instances is wrong");
    EXPECT_EQ(with_header([](rp_block_header& h) { h.leaf_count = 1 << 20; }), "the section \"leaves\" does not lie within it");
    EXPECT_NE(with_header([](rp_block_header& h) { h.node_count--; }), "");
    EXPECT_EQ(with_header([](rp_block_header& h) { h.vertex_count = 1, h.vertices_at = h.leaves_at; }),
              "the section \"vertices\" does not lie within it");
    EXPECT_NE(with_header([](rp_block_header& h) { h.block_entry_count = 2; }), "");
    EXPECT_NE(with_header([](rp_block_header& h) { h.block_entry_count = 0; }), "");
    EXPECT_NE(with_header([](rp_block_header& h) { h.cell[0] *= 2; }), "");
    // A block of triangles does not become one of instances, nor has it any.
    block_ = 0;
    AlignedBytes bytes = read_block(*file_, 0);
    good_.assign(bytes.span().begin(), bytes.span().end());
    ASSERT_TRUE(check_block_bytes(scene_, 0, good_).ok());
    EXPECT_NE(with_header([](rp_block_header& h) { h.attributes_at |= RP_BLOCK_INSTANCES; }), "");
}

TEST_F(DamagedInstances, TreesOfObjects) {
    const uint64_t of_first = scene_.objects[0].top.block_entry_count;
    const auto damaged = [&](const std::function<void(BakedScene&)>& change, const std::string& words) {
        const std::string message = with_scene(change);
        EXPECT_NE(message.find(words), std::string::npos) << words << ": " << message;
    };
    damaged([](BakedScene& s) { std::swap(s.objects[0], s.objects[1]); }, "\"objects\": the ranges of object 0 are out of order");
    damaged([](BakedScene& s) { std::swap(s.objects[0].top, s.objects[1].top); }, "\"top tree\"");
    damaged([](BakedScene& s) { s.objects[1].top.block_entry_count--; }, "\"top tree\"");
    damaged([](BakedScene& s) { s.objects[0].top.block_entry_count = UINT32_MAX; }, "more block entries than there are");
    damaged([](BakedScene& s) { s.objects[1].top.root = 0; }, "node 0 is absent or out of order");
    damaged([](BakedScene& s) { s.objects[1].top.root = s.top_grid.root; }, "out of order");
    damaged([](BakedScene& s) { s.objects[0].top.root = RP_REF_EXIT; }, "is absent, of another tree, or reached twice");
    damaged([](BakedScene& s) { s.objects[0].top.root = RP_REF_BLOCK_ENTRY | static_cast<rp_u32>(s.block_entries.size() - 1); }, "\"top tree\"");
    damaged([&](BakedScene& s) { s.block_entry_paths[of_first] ^= 1; }, "leads elsewhere");
    damaged([](BakedScene& s) { s.objects[0].base[1] = NAN; }, "\"objects\"");
    damaged([](BakedScene& s) { s.objects[0].top.cell[1] = 0; }, "\"objects\"");
    damaged([](BakedScene& s) { s.objects.pop_back(); }, "\"top tree\"");
    damaged([](BakedScene& s) { s.objects.push_back(s.objects[1]), s.objects[2].top = s.objects[0].top, s.objects[2].top.block_entry_count = 0; },
            "there is a tree but no block entry");
    damaged([](BakedScene& s) { s.instances++; }, "\"block table\": the blocks do not hold as many instances");
    damaged([&](BakedScene& s) { s.blocks[block_].triangles = 1, s.triangles++; }, "holds more than instances");
    damaged([&](BakedScene& s) { std::swap(s.blocks[block_].instances, s.blocks[0].instances); }, "");
    damaged([](BakedScene& s) { s.wide_roots.back() = 0x7fffffff; }, "\"wide roots\"");
    damaged([](BakedScene& s) { s.objects[1].levels = RP_INSTANCE_MAX_LEVELS; }, "has the wrong number of levels");
    damaged([](BakedScene& s) { s.objects[1].levels = 1; }, "has the wrong number of levels");
    damaged([&](BakedScene& s) { s.blocks[block_].levels = 2; }, "has the wrong number of levels");
    damaged([](BakedScene& s) { s.blocks[0].levels = 1; }, "has the wrong number of levels");
}

// Objects that place others: no chain of instances goes round, and none is deeper than kernels go.
class NestedInstances : public testing::Test {
protected:
    void SetUp() override {
        Scene& scene = scene_;
        scene = instanced_scene(300);
        Object twice = {"twice", {}};
        twice.instances.push_back(std::make_shared<InstancesInMemory>("twice", std::vector<Placement>(40, Placement{0})));
        scene.objects.push_back(twice);
        Object four = {"four times", {}};
        four.instances.push_back(std::make_shared<InstancesInMemory>("four", std::vector<Placement>(30, Placement{2})));
        scene.objects.push_back(four);
        scene.instances.push_back(std::make_shared<InstancesInMemory>("here", std::vector<Placement>(20, Placement{3})));
        BakeOptions options;
        options.block_bytes = 16 << 10;
        options.flatten_limit = 0;
        const auto baked = bake(scene, options, folder_ / "scene.rpb");
        ASSERT_TRUE(baked.ok()) << baked.status().message();
        file_ = *BlockFile::open(folder_ / "scene.rpb");
    }
    // Triangles and spheres, each as often as it is placed, of the scene baked so.
    uint64_t shown(uint64_t flatten_limit) const {
        BakeOptions options;
        options.flatten_limit = flatten_limit;
        EXPECT_TRUE(bake(scene_, options, folder_ / "counted.rpb").ok());
        const auto file = *BlockFile::open(folder_ / "counted.rpb");
        InstancedCount count(file->scene());
        for (uint32_t block = 0; block < file->scene().blocks.size(); block++) count.add(block, read_block(*file, block).span());
        return count.primitives();
    }
    // Of instances of an object.
    uint32_t block_of(uint32_t object) const {
        uint64_t entry = 0;
        for (uint32_t i = 0; i < object; i++) entry += file_->scene().objects[i].top.block_entry_count;
        return file_->scene().block_entries[entry].block;
    }
    std::string with_object(uint32_t block, uint32_t object) const {
        AlignedBytes stored = read_block(*file_, block);
        std::vector<std::byte> bytes(stored.span().begin(), stored.span().end());
        rp_block_header header;
        std::memcpy(&header, bytes.data(), sizeof header);
        std::memcpy(bytes.data() + header.leaves_at + offsetof(rp_instance, object), &object, sizeof object);
        return check_block_bytes(file_->scene(), block, bytes).message();
    }
    TemporaryFolder folder_;
    Scene scene_;
    std::shared_ptr<const BlockFile> file_;
};

TEST_F(NestedInstances, RecordsPlaceObjectsOfFewerLevels) {
    const BakedScene& scene = file_->scene();
    ASSERT_EQ(scene.instance_levels(), 3u);
    EXPECT_EQ(scene.objects[2].levels, 1u);
    EXPECT_EQ(scene.objects[3].levels, 2u);
    for (const uint32_t object : {2u, 3u}) EXPECT_EQ(scene.blocks[block_of(object)].levels, scene.objects[object].levels);
    EXPECT_EQ(scene.blocks.back().levels, 3u);
    EXPECT_EQ(with_object(block_of(2), 1), "");
    EXPECT_EQ(with_object(block_of(2), 2), "instance 0 is of an object that may hold it");
    EXPECT_EQ(with_object(block_of(2), 3), "instance 0 is of an object that may hold it");
    EXPECT_EQ(with_object(block_of(3), 3), "instance 0 is of an object that may hold it");
    EXPECT_EQ(with_object(static_cast<uint32_t>(scene.blocks.size() - 1), 3), "");
}

TEST_F(NestedInstances, WhatIsShownDoesNotDependOnNesting) {
    EXPECT_EQ(shown(0), shown(1'000'000));
    // 20 times 30 times 40 times the first object, and what there is without these.
    EXPECT_GT(shown(0), 24'000u);
}

}  // namespace
}  // namespace raypager
