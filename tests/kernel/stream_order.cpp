// Streams of rays wait at the first absent block entry in the order (distance at which the ray enters the block entry's bounds, block entry number),
// go on from there, and end with the hit that they have when everything is resident: with one block at a time, in any order of blocks and rays.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>
#include <set>

#include "block/wide_top.hpp"
#include "support/device_scene.hpp"
#include "support/probe_kernels.hpp"
#include "support/small_scene.hpp"

namespace raypager {
namespace {

using support::ProbeRay;

struct Place {
    float entry;
    uint32_t block_entry;
    bool operator<(const Place& other) const { return entry < other.entry || (entry == other.entry && block_entry < other.block_entry); }
};

// Of rp_probe_stream_waits: what it takes and what it returns.
struct RayState {
    uint32_t block_entry = RP_NONE;
    float entry = INFINITY;
    float t = INFINITY;
    uint32_t primitive = RP_NONE;
};
static_assert(sizeof(RayState) == 16);

TriangleMesh shell(float radius, uint32_t rows) {
    TriangleMesh mesh;
    const uint32_t columns = 2 * rows;
    for (uint32_t i = 0; i <= rows; i++)
        for (uint32_t j = 0; j <= columns; j++) {
            const float a = std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(rows);
            const float b = std::numbers::pi_v<float> * static_cast<float>(j % columns) / static_cast<float>(rows);
            mesh.positions.push_back({radius * std::sin(a) * std::cos(b), radius * std::sin(a) * std::sin(b), radius * std::cos(a)});
        }
    for (uint32_t i = 0; i < rows; i++)
        for (uint32_t j = 0; j < columns; j++) {
            const uint32_t k = i * (columns + 1) + j, below = k + columns + 1;
            if (i > 0) mesh.triangles.push_back({k, below, k + 1});
            if (i + 1 < rows) mesh.triangles.push_back({k + 1, below, below + 1});
        }
    return mesh;
}

// Triangles with the bounds [2, 3]^3 and no other: no cut in space parts them, so blocks with the same bounds follow each other.
TriangleMesh pile(const std::array<Float3, 3>& corners, uint32_t count) {
    TriangleMesh mesh;
    mesh.positions.assign(corners.begin(), corners.end());
    mesh.triangles.assign(count, {0, 1, 2});
    return mesh;
}

// Large triangles across everything.
TriangleMesh splinters(std::mt19937& random, uint32_t count) {
    std::uniform_real_distribution<float> place(-2, 2);
    TriangleMesh mesh;
    for (uint32_t k = 0; k < count; k++) {
        const Float3 at = {place(random), place(random), place(random)};
        mesh.positions.insert(mesh.positions.end(), {at, {-at.x, place(random), at.z}, {at.x + 0.05f, at.y, place(random)}});
        mesh.triangles.push_back({3 * k, 3 * k + 1, 3 * k + 2});
    }
    return mesh;
}

Scene overlapping_scene(std::mt19937& random) {
    Scene scene = support::small_scene(2);
    scene.shapes.clear();
    const auto add = [&](const char* name, TriangleMesh mesh) {
        Shape shape;
        shape.mesh = std::make_shared<MeshInMemory>(name, std::move(mesh));
        scene.shapes.push_back(shape);
    };
    for (const float radius : {0.5f, 0.8f, 0.85f, 1.5f}) add("shell", shell(radius, 12));
    add("splinters", splinters(random, 100));
    add("pile", pile({{{2, 2, 2}, {3, 2, 3}, {2, 3, 3}}}, 1000));
    add("other pile", pile({{{3, 3, 3}, {2, 3, 2}, {3, 2, 2}}}, 1000));
    return scene;
}

float coordinate(const Float3& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }
float& coordinate(Float3& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

bool contains(const rp_wide_block_entry& block_entry, const Float3& p) {
    for (int a = 0; a < 3; a++)
        if (coordinate(p, a) < block_entry.lower[a] || coordinate(p, a) > block_entry.upper[a]) return false;
    return true;
}

class Rays {
public:
    Rays(std::mt19937& random, std::span<const rp_wide_block_entry> block_entries) : random_(random), block_entries_(block_entries) {}

    std::vector<ProbeRay> make(uint32_t count) {
        std::vector<ProbeRay> rays;
        for (uint32_t k = 0; k < count; k++) {
            ProbeRay ray = {k % 3 == 1 ? inside_several() : anywhere(), INFINITY, {}};
            ray.direction = towards(ray.origin, point_in(any_block_entry()));
            if (k % 3 == 2) align(ray);
            if (k % 4 == 3) ray.t_max = between(0.1f, 3);
            rays.push_back(ray);
        }
        return rays;
    }

private:
    float between(float low, float high) { return std::uniform_real_distribution<float>(low, high)(random_); }
    const rp_wide_block_entry& any_block_entry() { return block_entries_[random_() % block_entries_.size()]; }
    Float3 anywhere() { return {between(-3, 4), between(-3, 4), between(-3, 4)}; }

    Float3 point_in(const rp_wide_block_entry& block_entry) {
        Float3 point;
        for (int a = 0; a < 3; a++) coordinate(point, a) = between(block_entry.lower[a], block_entry.upper[a]);
        return point;
    }

    Float3 inside_several() {
        Float3 best;
        int64_t most = -1;
        for (int k = 0; k < 8; k++) {
            const Float3 point = point_in(any_block_entry());
            const int64_t inside =
                std::ranges::count_if(block_entries_, [&](const rp_wide_block_entry& block_entry) { return contains(block_entry, point); });
            if (inside > most) best = point;
            most = std::max(most, inside);
        }
        return best;
    }

    static Float3 towards(const Float3& from, const Float3& to) {
        const Float3 d = {to.x - from.x, to.y - from.y, to.z - from.z};
        const float length = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
        if (!(length > 0)) return {0, 0, 1};
        return {d.x / length, d.y / length, d.z / length};
    }

    // One or two components of the direction become zero, of either sign, and the origin comes to lie in planes of block entries or in corners.
    void align(ProbeRay& ray) {
        const int along = static_cast<int>(random_() % 3), other = (along + 1 + static_cast<int>(random_() % 2)) % 3;
        const bool both = random_() % 2;
        for (int a = 0; a < 3; a++) {
            const rp_wide_block_entry& block_entry = any_block_entry();
            if (a != along && (both || a == other)) coordinate(ray.direction, a) = random_() % 2 ? 0.0f : -0.0f;
            const float plane = random_() % 2 ? block_entry.lower[a] : block_entry.upper[a];
            const bool whole = random_() % 2;  // of the meshes; bounds lie slightly outside
            if (a != along || random_() % 2) coordinate(ray.origin, a) = whole ? std::round(plane) : plane;
        }
        if (coordinate(ray.direction, along) == 0) coordinate(ray.direction, along) = 1;
        if (both) coordinate(ray.direction, along) = std::copysign(1.0f, coordinate(ray.direction, along));
    }

    std::mt19937& random_;
    std::span<const rp_wide_block_entry> block_entries_;
};

// Where a ray enters and leaves the bounds of a block entry: what rp_prepare_stream and rp_enter_block_entry compute.
struct Passage {
    float enter, leave;
};
Passage pass(const ProbeRay& ray, float t, const rp_wide_block_entry& block_entry) {
    Passage passage = {0, t};
    for (int a = 0; a < 3; a++) {
        const float d = coordinate(ray.direction, a), inverse = 1 / (std::abs(d) < 1e-18f ? std::copysign(1e-18f, d) : d);
        const float shift = coordinate(ray.origin, a) * inverse, slack = std::abs(shift) * 0x1p-22f;
        const bool negative = std::signbit(inverse);
        passage.enter = std::max(passage.enter, std::fma(negative ? block_entry.upper[a] : block_entry.lower[a], inverse, -shift - slack));
        passage.leave = std::min(passage.leave, std::fma(negative ? block_entry.lower[a] : block_entry.upper[a], inverse, slack - shift));
    }
    return passage;
}

// The device's reciprocals may be rounded in another way. Where two entries are equal here, they are equal there: the same planes gave them, or 0.
float tolerance(float entry) { return 1e-5f * std::max(1.0f, entry); }
bool surely_before(const Place& a, const Place& b) {
    return a.entry + tolerance(a.entry) < b.entry || (a.entry == b.entry && a.block_entry < b.block_entry);
}

class StreamOrder : public testing::Test {
protected:
    void SetUp() override {
        if (support::traversals().size() == 1) GTEST_SKIP() << "this device does not trace in streams";
        SCOPED_TRACE(seed_);
        auto file = bake();
        ASSERT_TRUE(file.ok()) << file.status().message();
        auto scene = support::DeviceScene::create(*file, 0, Traversal::stream);
        ASSERT_TRUE(scene.ok()) << scene.status().message();
        scene_ = std::move(*scene);
        const BakedScene& baked = scene_->scene();
        block_entries_ = make_wide_top(baked.top_grid, {}, baked.top_nodes, baked.block_entries, baked.wide_roots).block_entries;
        pages_.resize(baked.blocks.size());
        ASSERT_TRUE(queue().read_now(scene_->geometry().pages(), 0, std::as_writable_bytes(std::span(pages_))).ok());
        auto kernel = support::probe_kernel(scene_->device(), "stream/probe", "rp_probe_stream_waits", scene_->geometry().definitions());
        ASSERT_TRUE(kernel.ok()) << kernel.status().message();
        kernel_ = std::move(*kernel);
        rays_ = Rays(random_, block_entries_).make(ray_count);
        states_ = fresh_states();
    }

    Result<std::shared_ptr<const BlockFile>> bake() {
        BakeOptions options;
        options.block_bytes = 16 << 10;
        options.block_entries = 8;
        return support::bake_and_open(overlapping_scene(random_), options, folder_.path(), "order");
    }

    Queue& queue() { return scene_->device().kernels(); }

    // This block alone.
    void make_resident(uint32_t block) {
        std::vector<rp_page> pages = pages_;
        for (uint32_t k = 0; k < pages.size(); k++)
            if (k != block) pages[k] = {RP_NONE, 0, 0, 0};
        ASSERT_TRUE(queue().write_now(scene_->geometry().pages(), 0, bytes_of(pages)).ok());
    }

    // Traces these rays, side by side, from the states that they are in.
    std::vector<RayState> trace(const std::vector<uint32_t>& which, const std::vector<RayState>& states) {
        std::vector<ProbeRay> rays;
        std::vector<RayState> before, after(which.size());
        for (const uint32_t r : which) {
            rays.push_back(rays_[r]);
            before.push_back(states[r]);
        }
        Device& device = scene_->device();
        auto ray_buffer = device.upload(bytes_of(rays), "rays"), before_buffer = device.upload(bytes_of(before), "states");
        auto after_buffer = device.allocate(after.size() * sizeof(RayState), "results");
        EXPECT_TRUE(ray_buffer.ok() && before_buffer.ok() && after_buffer.ok());
        const auto count = static_cast<uint32_t>(which.size());
        EXPECT_TRUE(scene_->geometry().set(kernel_, *ray_buffer, *before_buffer, count, *after_buffer).ok());
        EXPECT_TRUE(scene_->geometry().launch(device, device.kernels(), kernel_, count, nullptr).ok());
        EXPECT_TRUE(queue().read_now(*after_buffer, 0, std::as_writable_bytes(std::span(after))).ok());
        return after;
    }

    std::vector<RayState> fresh_states() const {
        std::vector<RayState> states(rays_.size());
        for (size_t r = 0; r < rays_.size(); r++) states[r].t = rays_[r].t_max;
        return states;
    }

    static std::vector<uint32_t> all_rays() {
        std::vector<uint32_t> all(ray_count);
        std::iota(all.begin(), all.end(), 0u);
        return all;
    }

    // RP_NONE: it meets none.
    uint32_t some_block_entry_met_by(uint32_t ray) {
        std::vector<uint32_t> met;
        for (uint32_t k = 0; k < block_entries_.size(); k++) {
            const Passage passage = pass(rays_[ray], rays_[ray].t_max, block_entries_[k]);
            if (passage.enter < passage.leave) met.push_back(k);
        }
        return met.empty() ? RP_NONE : met[random_() % met.size()];
    }

    Place place_of(uint32_t ray, uint32_t block_entry) const {
        if (block_entry == RP_NONE) return {INFINITY, RP_NONE};
        return {pass(rays_[ray], INFINITY, block_entries_[block_entry]).enter, block_entry};
    }

    // No absent block entry that the ray meets before its hit lies between the place where it went on and the one where it waits.
    bool waits_too_late(uint32_t ray, const RayState& before, const RayState& after, uint32_t resident) const {
        const Place from = before.block_entry == RP_NONE ? Place{0, 0} : place_of(ray, before.block_entry), wait = place_of(ray, after.block_entry);
        for (uint32_t k = 0; k < block_entries_.size(); k++) {
            const Passage passage = pass(rays_[ray], after.t, block_entries_[k]);
            const Place place = {passage.enter, k};
            const bool meets = passage.enter + tolerance(passage.enter) < passage.leave;
            const bool after_from = (place.block_entry == from.block_entry && place.entry == from.entry) || surely_before(from, place);
            if (block_entries_[k].block != resident && meets && after_from && surely_before(place, wait)) return true;
        }
        return false;
    }

    // A step of a ray from where it was to where it is now.
    void check_step(uint32_t ray, const RayState& before, const RayState& after, uint32_t resident) {
        EXPECT_LE(after.t, before.t);
        EXPECT_FALSE(waits_too_late(ray, before, after, resident)) << "waits at " << after.block_entry << ", not at an earlier one";
        if (after.block_entry == RP_NONE) return;
        ASSERT_LT(after.block_entry, block_entries_.size());
        const float entry = place_of(ray, after.block_entry).entry;
        EXPECT_NE(block_entries_[after.block_entry].block, resident) << "waits for a block that is there";
        EXPECT_NEAR(after.entry, entry, tolerance(entry));
        EXPECT_LE(after.entry, after.t + tolerance(entry)) << "waits behind its hit";
        if (before.block_entry == RP_NONE) return;
        const Place from = {before.entry, before.block_entry}, wait = {after.entry, after.block_entry};
        EXPECT_TRUE(from < wait) << "from (" << from.entry << ", " << from.block_entry << ") to (" << wait.entry << ", " << wait.block_entry << ")";
        ties_ += from.entry == wait.entry ? 1 : 0;
        if (std::ranges::equal(block_entries_[from.block_entry].lower, block_entries_[wait.block_entry].lower) &&
            std::ranges::equal(block_entries_[from.block_entry].upper, block_entries_[wait.block_entry].upper))
            same_bounds_++;
    }

    // One for each ray that waits.
    std::vector<uint32_t> blocks_requested() const {
        std::vector<uint32_t> blocks;
        for (const RayState& state : states_)
            if (state.block_entry != RP_NONE) blocks.push_back(block_entries_[state.block_entry].block);
        return blocks;
    }

    uint32_t pick_block() {
        const std::vector<uint32_t> wanted = blocks_requested();
        return wanted.empty() ? static_cast<uint32_t>(random_() % pages_.size()) : wanted[random_() % wanted.size()];
    }

    // Rays that wait for the block go on, and some others begin.
    void run_round(uint32_t block) {
        std::vector<uint32_t> traced;
        for (uint32_t r = 0; r < ray_count; r++)
            if (states_[r].block_entry != RP_NONE && block_entries_[states_[r].block_entry].block == block) traced.push_back(r);
        for (uint32_t k = 0; k < fresh_a_round && begun_ < ray_count; k++) traced.push_back(order_[begun_++]);
        std::shuffle(traced.begin(), traced.end(), random_);
        make_resident(block);
        const std::vector<RayState> after = trace(traced, states_);
        for (size_t k = 0; k < traced.size(); k++) {
            SCOPED_TRACE(traced[k]);
            RayState& state = states_[traced[k]];
            check_step(traced[k], state, after[k], block);
            state = after[k];
            EXPECT_TRUE(state.block_entry == RP_NONE || waited_[traced[k]].insert(state.block_entry).second)
                << "waits twice at block entry " << state.block_entry;
        }
    }

    void check_hits(const std::vector<RayState>& expected, const std::vector<support::ProbeHit>& probed) const {
        uint32_t hits = 0, cut_short = 0;
        for (uint32_t r = 0; r < ray_count; r++) {
            SCOPED_TRACE(r);
            const bool hit = expected[r].primitive != RP_NONE;
            EXPECT_EQ(expected[r].block_entry, RP_NONE);
            EXPECT_EQ(states_[r].t, expected[r].t);
            EXPECT_EQ(states_[r].primitive, expected[r].primitive);
            EXPECT_EQ(probed[r].primitive, expected[r].primitive);
            EXPECT_EQ(probed[r].t, hit ? expected[r].t : INFINITY);
            hits += hit;
            cut_short += !hit && std::isfinite(expected[r].t);
        }
        EXPECT_GT(hits, ray_count / 4);
        EXPECT_GT(cut_short, 0u);
    }

    static constexpr uint32_t ray_count = 384, fresh_a_round = 24;
    const uint32_t seed_ = std::random_device{}();
    std::mt19937 random_{seed_};
    support::TemporaryFolder folder_;
    std::unique_ptr<support::DeviceScene> scene_;
    std::vector<rp_wide_block_entry> block_entries_;
    std::vector<rp_page> pages_;  // with all blocks
    std::vector<ProbeRay> rays_;
    std::vector<RayState> states_;
    std::vector<std::set<uint32_t>> waited_{ray_count};  // block entries that each ray has waited at
    std::vector<uint32_t> order_ = all_rays();           // in which rays begin
    uint32_t begun_ = 0;
    Kernel kernel_;
    uint64_t ties_ = 0, same_bounds_ = 0;  // steps between block entries that are entered at the same distance, or have the same bounds
};

TEST_F(StreamOrder, one_block_at_a_time_takes_rays_forward_to_the_hits_of_the_resident_scene) {
    SCOPED_TRACE(seed_);
    ASSERT_GE(pages_.size(), 10u);
    ASSERT_LE(pages_.size(), 30u);
    const std::vector<RayState> expected = trace(all_rays(), states_);
    const auto probed = scene_->trace(rays_);
    ASSERT_TRUE(probed.ok()) << probed.status().message();
    std::shuffle(order_.begin(), order_.end(), random_);
    const size_t enough = 20 * block_entries_.size() * pages_.size();
    for (size_t rounds = 0; begun_ < ray_count || !blocks_requested().empty(); rounds++) {
        ASSERT_LT(rounds, enough) << "rays wait forever";
        run_round(pick_block());
        if (HasFailure()) return;
    }
    check_hits(expected, *probed);
    EXPECT_GT(ties_, 0u);
    EXPECT_GT(same_bounds_, 0u);
}

TEST_F(StreamOrder, rays_that_go_on_leave_out_what_is_behind_them) {
    SCOPED_TRACE(seed_);
    const std::vector<RayState> expected = trace(all_rays(), states_);
    std::vector<RayState> states = states_;
    for (uint32_t r = 0; r < ray_count; r++) states[r].block_entry = some_block_entry_met_by(r);
    const std::vector<RayState> after = trace(all_rays(), states);
    uint32_t left_out = 0;
    for (uint32_t r = 0; r < ray_count; r++) {
        if (states[r].block_entry == RP_NONE) continue;
        SCOPED_TRACE(r);
        const float entry = place_of(r, states[r].block_entry).entry;
        EXPECT_EQ(after[r].block_entry, RP_NONE);
        EXPECT_GE(after[r].t, expected[r].t);
        // What a block entry holds is not hit before it is entered.
        EXPECT_GE(after[r].t + tolerance(entry), entry);
        left_out += expected[r].t + tolerance(entry) < entry;
    }
    EXPECT_GT(left_out, 0u);
}

}  // namespace
}  // namespace raypager
