// Promises 1 to 3: the film is the same to the bit for every memory limit, policy, number of paths, slab size and block size; the pool
// never exceeds its limit; and every render ends, with room for just the largest block.
#include <gtest/gtest.h>

#include <algorithm>
#include <string_view>

#include "raypager/sky.hpp"
#include "reference/instanced_scenes.hpp"
#include "reference/scenes.hpp"
#include "reference/textured_scenes.hpp"
#include "render/render.hpp"
#include "support/device_scene.hpp"
#include "support/failing_device.hpp"
#include "support/recorded_films.hpp"
#include "support/test_options.hpp"
#include "support/thorough.hpp"

namespace raypager {
namespace {

struct PictureCase {
    const char* name;
    Scene (*make)();
    bool paged_sky = false;  // although it is small
    bool nested = false;     // instances stay in objects, few as they are
};

const PictureCase picture_cases[] = {
    {"cornell",
     [] {
         return reference::cornell_small({.subdivisions = 4, .wall_divisions = 16}, {48, 48});
     }},  // diffuse, mirror, glass, rough metal, area light
    {"terrain",
     [] {
         return reference::terrain_small(64, true, {64, 48});
     }},  // sun and sky, shading normals
    {"clutter",
     [] {
         return reference::clutter_small(60, 3, {64, 48});
     }},  // all materials, several area lights
    {"shells",
     [] {
         return reference::overlapping_shells(8, 3, {48, 48});
     }},  // every bound overlaps every other
    {"cloud",
     [] {
         return reference::cloud_small(10000, false, 1, {48, 36});
     }},  // coloured points and nothing else
    {"cloud_among_meshes",
     [] {
         return reference::cloud_small(5000, true, 2, {48, 36});
     }},  // points with and without colour, spheres and triangles in the same blocks
    {"painted",
     [] {
         return reference::painted_small(40, {48, 36});
     }},  // meshes with colours at their vertices, with normals and without, beside ones without colours
    {"clear_balls",
     [] {
         return reference::clear_balls({48, 36});
     }},  // layered materials, and mixes of them
    {"lens",
     [] {
         return reference::balls_on_a_floor(reference::ViewKind::lens, {PixelFilter::Kind::gaussian, 1.5f, 1.5f, 2}, {48, 36});
     }},  // camera rays that begin in different places, and samples that a filter places
    {"sky",
     [] {
         return reference::sky_small(64, {64, 48});
     }},  // a sky that is an image
    {"lamps",
     [] {
         Scene scene = reference::lamps_small({48, 48});
         const Scene hills = reference::sky_small(64);
         scene.shapes.push_back(hills.shapes[0]);  // enough to page
         scene.shapes.back().material = 0;
         scene.shapes.back().to_world = Transform::translate(0, -0.5, 0) * Transform::rotate(-90, 1, 0, 0) * Transform::scale(0.2, 0.2, 0.2);
         return scene;
     }},  // lights that shine in cones and through images, among which a tree chooses
    {"textures",
     [] {
         return reference::textured_hills(60, {48, 36});
     }},  // images in pages, of which a path looks up several
    {"cutouts",
     [] {
         return reference::hedge(60, {48, 36}, true);
     }},  // rays of all kinds pass what images cut away, also just before what stops them
    {"brushed",
     [] {
         return reference::brushed_small(90, {48, 36});
     }},  // roughness that goes along u, which no texture reads
    {"paged_sky",
     [] {
         Scene scene = reference::hedge(40, {48, 36});
         if (!set_sky(scene, reference::spotted_sky(200)).ok()) scene.shapes.clear();
         return scene;
     },
     true},  // and paths wait for the sky as well
    {"instances",
     [] {
         return reference::strewn(200, {32, 24}, false);
     }},  // of all kinds of primitives, in each other, mirrored, uneven, sheared and tiny
    {"instanced_hedge",
     [] {
         return reference::instanced_hedge(150, {32, 24});
     }},  // with cut-outs, textures and directions of roughness
    {"lanterns",
     [] {
         return reference::strewn_lanterns(150, {32, 24});
     }},  // that shine, and have colours and materials of their own
    {"groves",
     [] {
         return reference::groves(9, {32, 24});
     },
     false, true},  // instances in each other, three levels deep
    {"overridden_hedge",
     [] {
         return reference::overridden_hedge(150, {32, 24});
     }},  // whose materials come from its instances
};

void PrintTo(const PictureCase& c, std::ostream* out) { *out << c.name; }

class SamePicture : public testing::TestWithParam<PictureCase> {
protected:
    static constexpr uint64_t block_bytes = 16 << 10;

    static BakeOptions bake_options(uint64_t bytes) {
        BakeOptions options;
        options.block_bytes = bytes;
        if (GetParam().paged_sky) {
            options.resident_sky_bytes = 0;
            options.scattered_sky_size = 100;
        }
        if (GetParam().nested) options.flatten_limit = 0;
        return options;
    }

    void SetUp() override {
        const BakeOptions options = bake_options(block_bytes);
        auto file = support::bake_and_open(GetParam().make(), options, folder_.path(), "scene");
        ASSERT_TRUE(file.ok()) << file.status().message();
        file_ = *file;
        base_.spp = 4;
        base_.tuning.paths = 3000;
        const auto result = run(base_);
        ASSERT_TRUE(result.ok()) << result.status().message();
        hash_ = result->report.film_hash;
        rays_ = result->report.rays.total();
        ASSERT_GT(file_->scene().blocks.size(), 8u) << "too few blocks to page";
        ASSERT_EQ(result->report.paging.evictions, 0u);
    }

    Result<MeasuredRender> run(const support::TestOptions& options) const { return render(*file_, options, {}); }

    // Instances of instances are traced ray by ray.
    std::vector<Traversal> traversals() const { return file_->scene().instance_levels() > 1 ? std::vector{Traversal::ray} : support::traversals(); }
    BlockForm form() const { return file_->scene().instance_levels() > 1 ? BlockForm::stored : support::default_form(); }

    // Whether this scene is to be drawn with the next combination of options: a third of them, so that all come with some of the scenes.
    bool is_its_turn() { return turns_.take(); }
    // The same where combinations take kernels of their own, which take longer to compile than pictures to draw: all scenes have those of the default
    // policy, and some those of one that has the device note other things of blocks (BlockNotes).
    static bool has_kernels_of(PolicyKind policy) {
        return policy == PolicyKind::aged_wants || is_one_of(4, policy == PolicyKind::most_wanted ? 1 : 3);
    }
    static bool has_slabs() { return is_one_of(4, 2); }
    static bool has_host_pool() { return is_one_of(10, 3); }

    // Whether this scene is one of those that have something, or all are tried: every n-th, from one of them on.
    static bool is_one_of(uint64_t every, uint64_t first) { return number_of_scene() % every == first || support::thorough(); }

    static uint64_t number_of_scene() {
        return static_cast<uint64_t>(std::find_if(std::begin(picture_cases), std::end(picture_cases),
                                                  [](const PictureCase& c) { return std::string_view(c.name) == GetParam().name; }) -
                                     std::begin(picture_cases));
    }

    void expect_same(const support::TestOptions& options, const std::string& what) const {
        SCOPED_TRACE(what);
        const auto result = run(options);
        ASSERT_TRUE(result.ok()) << result.status().message();
        const RenderReport& report = result->report;
        EXPECT_EQ(report.film_hash, hash_);
        EXPECT_EQ(report.rays.total(), rays_);
        EXPECT_LE(report.peak.memory_bytes, report.limits.memory_bytes);
        EXPECT_LE(report.peak.geometry_bytes, report.limits.geometry_bytes);
        if (options.geometry_limit) {
            EXPECT_LE(report.limits.geometry_bytes, options.geometry_limit);
        }
    }

    void expect_recorded_film() const {
        const auto result = run(base_);
        ASSERT_TRUE(result.ok()) << result.status().message();
        const RenderReport::DeviceFacts& device = result->report.device;
        const std::string key = support::film_device(device.name, device.driver);
        const std::optional<uint64_t> recorded = support::recorded_film(key, GetParam().name);
        const std::string line = support::film_line(key, GetParam().name, hash_);
        if (!recorded) GTEST_SKIP() << "tests/golden/films.txt has no film of this kind of device; it would be: " << line;
        EXPECT_EQ(hash_, *recorded) << "if the change is meant to change pictures, the line is now: " << line;
    }

    support::TemporaryFolder folder_;
    std::shared_ptr<const BlockFile> file_;
    support::TestOptions base_;
    uint64_t hash_ = 0, rays_ = 0;

private:
    support::Turns turns_{number_of_scene(), 3};
};

// What a part of the scenes have; the rest is not even baked. The numbers of those scenes leave all remainders by three, for the turns of
// combinations.
template <uint64_t every, uint64_t first>
class SomePictures : public SamePicture {
protected:
    void SetUp() override {
        if (!is_one_of(every, first)) GTEST_SKIP() << "other scenes are drawn so, and all with RAYPAGER_THOROUGH";
        SamePicture::SetUp();
    }
};

using SamePictureInRegions = SomePictures<5, 2>;
using SamePictureWithRoomAhead = SomePictures<5, 3>;
using SamePictureByPersistentThreads = SomePictures<4, 0>;
using SamePictureWithRoulette = SomePictures<5, 1>;
using OptimisedPicture = SomePictures<3, 0>;
using OnePicture = SomePictures<std::size(picture_cases), 0>;

// The other tests say that no option changes this film; these, that no change of the code did without meaning to. Where one means to, record the
// films again and say so in the commit (tests/golden/films.txt).
TEST_P(SamePicture, is_the_recorded_one) { expect_recorded_film(); }

// By kernels as users have them; all others here are compiled without optimisation (tests/CMakeLists.txt).
TEST_P(OptimisedPicture, is_the_recorded_one) { expect_recorded_film(); }

TEST_P(SamePicture, at_every_geometry_limit_and_policy) {
    for (const PolicyName& policy : policy_names)
        for (const double percent : {100.0, 50.0, 25.0, 10.0, 3.0}) {
            if (!has_kernels_of(policy.kind) || !is_its_turn()) continue;
            support::TestOptions options = base_;
            options.tuning.policy = policy.kind;
            options.geometry_limit_percent = percent;
            expect_same(options, std::string(policy.name) + " at " + std::to_string(percent) + " %");
        }
}

TEST_P(SamePicture, with_room_for_one_block) {
    for (const PolicyName& policy : policy_names) {
        if (!has_kernels_of(policy.kind) || (policy.kind != PolicyKind::aged_wants && !is_its_turn())) continue;
        support::TestOptions options = base_;
        options.tuning.policy = policy.kind;
        options.geometry_limit = file_->scene().largest_pageable(form());
        expect_same(options, std::string(policy.name) + " with one block");
    }
}

TEST_P(SamePicture, for_every_number_of_paths_in_flight) {
    for (const uint32_t paths : {64u, 1000u, 20000u})
        for (const double percent : {100.0, 20.0}) {
            if (!is_its_turn()) continue;
            support::TestOptions options = base_;
            options.tuning.paths = paths;
            options.geometry_limit_percent = percent;
            expect_same(options, std::to_string(paths) + " paths");
        }
}

TEST_P(SamePictureInRegions, for_regions_of_any_size) {
    for (const uint32_t region : {0u, 7u, 500u})
        for (const double percent : {100.0, 20.0, 3.0})
            for (const Traversal traversal :
                 {Traversal::automatic, Traversal::ray}) {  // ray by ray slots are given out in ones, twos, fours or eights
                if (!is_its_turn()) continue;
                support::TestOptions options = base_;
                options.tuning.region = region;
                options.tuning.paths = 200;
                options.geometry_limit_percent = percent;
                options.tuning.traversal = traversal;
                expect_same(options, (traversal == Traversal::ray ? "rays one by one, regions of " : "regions of ") + std::to_string(region) +
                                         " at " + std::to_string(percent) + " %");
            }
}

TEST_P(SamePicture, for_other_slabs_and_loads_in_flight) {
    const uint64_t small = std::max<uint64_t>(40 << 10, file_->scene().largest_pageable(form()));
    for (const uint64_t slab : {uint64_t{0}, small})
        for (const uint32_t loads : {1u, 4u}) {
            if (!is_its_turn() || (slab != 0 && !has_slabs())) continue;
            support::TestOptions options = base_;
            options.geometry_limit_percent = 30;
            options.instruments.slab_bytes = slab;
            options.tuning.loads_in_flight = loads;
            expect_same(options, std::to_string(slab) + " byte slabs, " + std::to_string(loads) + " loads in flight");
        }
}

TEST_P(SamePicture, with_one_or_two_rounds_under_way) {
    for (const uint32_t rounds : {1u, 2u})
        for (const double percent : {100.0, 10.0, 1.0}) {
            if (!is_its_turn()) continue;
            support::TestOptions options = base_;
            options.instruments.rounds_under_way = rounds;
            options.geometry_limit_percent = percent;
            options.connection = Connection::queue;
            expect_same(options, std::to_string(rounds) + " rounds under way");
        }
}

// As on GPUs: blocks come into places that rounds under way have nothing to do with, beside others that rounds may still read.
TEST_P(SamePictureWithRoomAhead, with_room_made_ahead) {
    for (const Traversal traversal : traversals())
        for (const double percent : {100.0, 40.0, 5.0, 0.001}) {
            if (!is_its_turn()) continue;
            support::TestOptions options = base_;
            options.tuning.traversal = traversal;
            options.geometry_limit_percent = percent;
            options.instruments.rounds_under_way = 2;
            options.instruments.evict_ahead = 3;
            expect_same(options, "room ahead for three at " + std::to_string(percent) + " %");
        }
    if (!has_host_pool()) return;
    support::TestOptions options = base_;
    options.tuning.pool_place = PoolPlace::host;
    options.instruments.evict_ahead = 3;
    expect_same(options, "the pool in host memory");
}

// Everything else here is traced in the way that the device likes best.
TEST_P(SamePicture, ray_by_ray_and_in_streams) {
    for (const Traversal traversal : traversals())
        for (const double percent : {100.0, 20.0, 0.001}) {  // the last: room for the largest block
            if (!is_its_turn()) continue;
            support::TestOptions options = base_;
            options.tuning.traversal = traversal;
            options.geometry_limit_percent = percent;
            options.instruments.rounds_under_way = percent < 100 ? 2 : 1;
            expect_same(options, (traversal == Traversal::ray ? "ray by ray at " : "in streams at ") + std::to_string(percent) + " %");
        }
}

// As on devices whose lanes can vote, with vectors of one lane, and the lowest entries of stacks in local memory.
TEST_P(SamePictureByPersistentThreads, by_persistent_threads) {
    for (const double percent : {100.0, 20.0, 0.001}) {
        if (!is_its_turn()) continue;
        support::TestOptions options = base_;
        options.tuning.traversal = Traversal::ray;
        options.geometry_limit_percent = percent;
        options.instruments.rounds_under_way = percent < 100 ? 2 : 1;
        options.instruments.device_hooks = std::make_shared<support::PersistentDevice>();
        expect_same(options, "by persistent threads at " + std::to_string(percent) + " %");
    }
}

TEST_P(SamePicture, for_other_block_sizes) {
    for (const uint64_t bytes : {uint64_t{40} << 10, uint64_t{4} << 20}) {
        auto file = support::bake_and_open(GetParam().make(), bake_options(bytes), folder_.path(), "other");
        ASSERT_TRUE(file.ok()) << file.status().message();
        EXPECT_LT((*file)->scene().blocks.size(), file_->scene().blocks.size());
        const auto result = render(**file, base_, {});
        ASSERT_TRUE(result.ok()) << result.status().message();
        EXPECT_EQ(result->report.film_hash, hash_) << bytes << " byte blocks";
    }
}

TEST_P(SamePictureWithRoulette, roulette_connection_too) {
    support::TestOptions options = base_;
    options.connection = Connection::roulette;
    const auto resident = run(options);
    ASSERT_TRUE(resident.ok()) << resident.status().message();
    EXPECT_NE(resident->report.film_hash, hash_) << "the option does nothing";
    for (const Traversal traversal : traversals()) {
        options.tuning.traversal = traversal;
        const auto other = run(options);
        ASSERT_TRUE(other.ok()) << other.status().message();
        EXPECT_EQ(other->report.film_hash, resident->report.film_hash);
    }
    options.geometry_limit_percent = 10;
    options.tuning.policy = PolicyKind::most_wanted;
    const auto paged = run(options);
    ASSERT_TRUE(paged.ok()) << paged.status().message();
    EXPECT_EQ(paged->report.film_hash, resident->report.film_hash);
    EXPECT_GT(paged->report.paging.evictions, 0u);
}

TEST_P(SamePicture, another_seed_is_another_picture) {
    support::TestOptions options = base_;
    options.seed = 1;
    const auto result = run(options);
    ASSERT_TRUE(result.ok()) << result.status().message();
    EXPECT_NE(result->report.film_hash, hash_);
}

TEST_P(SamePicture, a_limit_too_small_names_the_smallest_that_does) {
    support::TestOptions options = base_;
    options.memory_limit = 100000;
    const auto refused = run(options);
    ASSERT_FALSE(refused.ok());
    const std::string& message = refused.status().message();
    const std::string key = "the smallest that would do is ";
    const size_t at = message.find(key);
    ASSERT_NE(at, std::string::npos) << message;
    const uint64_t smallest = std::stoull(message.substr(at + key.size()));
    options.memory_limit = smallest - 1;
    EXPECT_FALSE(run(options).ok());
    options.memory_limit = smallest;
    expect_same(options, "smallest memory limit");
}

TEST_P(OnePicture, a_refusal_names_both_limits_that_are_too_small) {
    support::TestOptions options = base_;
    options.tuning.pool_place = PoolPlace::host;
    options.memory_limit = 1000;
    options.host_limit = 1000;
    const auto refused = run(options);
    ASSERT_FALSE(refused.ok());
    for (const char* part : {"the smallest that would do is ", "--host-limit"})
        EXPECT_NE(refused.status().message().find(part), std::string::npos) << refused.status().message();
}

std::string name_of(const testing::TestParamInfo<PictureCase>& info) { return info.param.name; }

INSTANTIATE_TEST_SUITE_P(scenes, SamePicture, testing::ValuesIn(picture_cases), name_of);
INSTANTIATE_TEST_SUITE_P(scenes, SamePictureInRegions, testing::ValuesIn(picture_cases), name_of);
INSTANTIATE_TEST_SUITE_P(scenes, SamePictureWithRoomAhead, testing::ValuesIn(picture_cases), name_of);
INSTANTIATE_TEST_SUITE_P(scenes, SamePictureByPersistentThreads, testing::ValuesIn(picture_cases), name_of);
INSTANTIATE_TEST_SUITE_P(scenes, SamePictureWithRoulette, testing::ValuesIn(picture_cases), name_of);
INSTANTIATE_TEST_SUITE_P(scenes, OnePicture, testing::ValuesIn(picture_cases), name_of);
INSTANTIATE_TEST_SUITE_P(scenes, OptimisedPicture, testing::ValuesIn(picture_cases), name_of);

}  // namespace
}  // namespace raypager
