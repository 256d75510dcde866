// Small objects are baked side by side: what comes out is what it is when they are baked one after the other.
#include <gtest/gtest.h>

#include <atomic>

#include "base/parallel.hpp"
#include "support/temporary_folder.hpp"
#include "unit/bake_instanced_scene.hpp"

namespace raypager {
namespace {

using namespace blocks_test;

// A mesh that says it is small.
class UnderstatedMesh final : public MeshSource {
public:
    explicit UnderstatedMesh(TriangleMesh mesh) : mesh_("understated", std::move(mesh)) {}
    Status load(TriangleMesh& mesh, MeshIssues& issues) const override { return mesh_.load(mesh, issues); }
    Status stream(MeshSink& sink, MeshIssues& issues) const override { return mesh_.stream(sink, issues); }
    std::string name() const override { return mesh_.name(); }
    uint64_t bytes_to_read() const override { return 100; }

private:
    MeshInMemory mesh_;
};

class BakeObjects : public testing::Test {
protected:
    // Of all sizes, some of several shapes, some with nothing in them.
    BakeObjects() {
        for (uint32_t i = 0; i < 60; i++) {
            Object object{"object " + std::to_string(i), {}};
            if (i % 7 != 3) object.shapes.push_back(mesh_shape(i % 5 == 0 ? terrain(20 + i, i % 2 == 0) : icosphere(static_cast<int>(i % 4))));
            if (i % 3 == 0) object.shapes.push_back(sphere_shape({0, 2, 0}, 0.5f));
            if (i % 4 == 1) object.shapes.push_back(mesh_shape(soup(50 * i, i)));
            for (Shape& shape : object.shapes) shape.material = i % 2;
            scene_.objects.push_back(object);
        }
        scene_.materials.push_back(gray());
        scene_.instances = {std::make_shared<InstancesInMemory>("here", random_placements(500, 60, 9))};
    }

    static BakeOptions options(uint64_t host_limit) {
        BakeOptions options;
        options.block_bytes = 16 << 10;
        options.host_limit = host_limit;
        return options;
    }

    void expect_the_same(uint64_t host_limit) {
        const auto together = bake(scene_, options(host_limit), folder_ / "together.rpb");
        ASSERT_TRUE(together.ok()) << together.status().message();
        const WorkersAtMost one(1);
        const auto alone = bake(scene_, options(host_limit), folder_ / "alone.rpb");
        ASSERT_TRUE(alone.ok()) << alone.status().message();
        EXPECT_TRUE(support::read_file(folder_ / "together.rpb") == support::read_file(folder_ / "alone.rpb"));
        EXPECT_EQ(together->buckets, alone->buckets);
        EXPECT_EQ(together->issues.degenerate, alone->issues.degenerate);
        const auto file = *BlockFile::open(folder_ / "together.rpb");
        for (uint32_t block = 0; block < file->scene().blocks.size(); block++) {
            AlignedBytes bytes = read_block(*file, block);
            ASSERT_TRUE(file->check_block(block, bytes.span()).ok()) << file->check_block(block, bytes.span()).message();
        }
    }

    TemporaryFolder folder_;
    Scene scene_ = scene_of({mesh_shape(icosphere(2))});
};

TEST_F(BakeObjects, SideBySideAreTheSameBytes) { expect_the_same(uint64_t{256} << 20); }

TEST_F(BakeObjects, SomeAreTooLargeForThat) {
    scene_.objects[20].shapes[0] = mesh_shape(icosphere(7));
    scene_.objects[21].shapes.push_back(mesh_shape(terrain(150)));
    scene_.objects[59].shapes = {mesh_shape(icosphere(6))};
    expect_the_same(smallest_bake_limit());
}

TEST_F(BakeObjects, SomeAreNotAsSmallAsTheySay) {
    for (const size_t object : {0, 30, 31, 59}) {
        scene_.objects[object].shapes.resize(1, sphere_shape({0, 0, 0}, 1));
        scene_.objects[object].shapes[0].mesh = std::make_shared<UnderstatedMesh>(icosphere(object == 30 ? 7 : 6));
    }
    expect_the_same(smallest_bake_limit());
}

// Whichever thread comes first.
TEST_F(BakeObjects, TheFirstBadOneIsTheError) {
    for (const size_t object : {50, 17, 16}) {
        scene_.objects[object].shapes = {mesh_shape(icosphere(object == 16 ? 4 : 0))};
        scene_.objects[object].shapes[0].to_world = Transform::scale(1e13, 1e13, 1e13);
        scene_.objects[object].shapes[0].name = "bad " + std::to_string(object);
    }
    for (int i = 0; i < 5; i++) {
        const auto baked = bake(scene_, options(uint64_t{256} << 20), folder_ / "a.rpb");
        ASSERT_FALSE(baked.ok());
        EXPECT_NE(baked.status().message().find("bad 16"), std::string::npos) << baked.status().message();
        EXPECT_TRUE(folder_.files().empty());
    }
}

TEST_F(BakeObjects, StopWhenAsked) {
    std::atomic<bool> stop = false;
    BakeOptions stopped = options(uint64_t{256} << 20);
    stopped.stop = &stop;
    stopped.progress = [&](const char* stage, double fraction) {
        if (stage == std::string_view("objects") && fraction > 0.2) stop = true;
    };
    const auto baked = bake(scene_, stopped, folder_ / "a.rpb");
    ASSERT_TRUE(stop);
    ASSERT_FALSE(baked.ok());
    EXPECT_NE(baked.status().message().find("stopped"), std::string::npos) << baked.status().message();
}

}  // namespace
}  // namespace raypager
