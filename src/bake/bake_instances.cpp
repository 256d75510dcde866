#include "bake/bake_instances.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"
#include "base/words.hpp"
#include "world/instance_record.hpp"
#include "world/placement.hpp"

namespace raypager {
namespace {

constexpr uint64_t instance_limit = RP_NONE;  // there are fewer
// Placements that are looked at between two looks at whether to stop.
constexpr size_t placements_at_once = size_t{1} << 14;

Transform transform_of(const Placement& placement) {
    Transform to_world;
    std::ranges::copy(placement.to_world, to_world.m.begin());
    return to_world;
}

class InstanceGatherer {
public:
    InstanceGatherer(std::span<const ObjectBounds> objects, const InstanceGathering& settings, InstanceTraits& traits, uint64_t expected)
        : objects_(objects), settings_(settings), traits_(traits), expected_(expected) {}

    Status check_room(uint64_t count) const {
        if (count >= instance_limit) return Status::failed(fmt::format("the scene has more than {} instances; leave some out", instance_limit - 1));
        if (count > settings_.memory_bytes / instance_memory)
            return Status::failed(fmt::format("{} take {} of memory to bake; give a larger --host-limit", counted(count, "instance"),
                                              format_bytes(count * instance_memory)));
        return {};
    }

    void reserve() {
        world_.instances.reserve(expected_);
        world_.primitives.reserve(expected_);
    }

    Status take(std::span<const Placement> placements, const std::string& source) {
        while (!placements.empty()) {
            if (settings_.stop && *settings_.stop) return Status::interrupted("stopped by a signal; nothing was written");
            const auto some = placements.first(std::min(placements.size(), placements_at_once));
            RAYPAGER_TRY(check_room(world_.instances.size() + some.size()));
            RAYPAGER_TRY(add(some, source));
            placements = placements.subspan(some.size());
            settings_.progress(std::min(1.0, static_cast<double>(seen_) / static_cast<double>(std::max<uint64_t>(expected_, 1))));
        }
        return {};
    }

    World finish(MeshIssues& issues) {
        if (dropped_ > 0) issues.warn("instances dropped", fmt::format("{} flattened or out of range: dropped", counted(dropped_, "instance")));
        return std::move(world_);
    }

private:
    Status add(std::span<const Placement> placements, const std::string& source) {
        made_.assign(placements.size(), {});
        constexpr size_t at_once = 512;
        RAYPAGER_TRY(parallel_try(placements.size(), at_once, [&](size_t begin, size_t end) -> Status {
            for (size_t i = begin; i < end; i++) RAYPAGER_TRY(make(placements[i], source, seen_ + i, made_[i]));
            return {};
        }));
        for (size_t i = 0; i < made_.size(); i++) {
            Made& made = made_[i];
            dropped_ += made.dropped;
            if (made.dropped) continue;
            const Box& box = objects_[placements[i].object].box;
            const auto traits = traits_.add(placements[i], box.empty() ? transform_of(placements[i]) : placement_of(made.record, box));
            if (!traits) return traits.status().at(fmt::format("{}: instance {}", source, seen_ + i));
            if (made.box.empty()) continue;
            made.record.path_high = *traits << RP_INSTANCE_TRAITS_SHIFT;
            const size_t number = world_.instances.size();
            world_.instances.push_back({made.record, made.box, static_cast<uint32_t>(number)});
            world_.primitives.push_back(World::instance_entry(number));
            // How the object is cut must not change pictures, which depend on the size of the scene.
            world_.bounds.grow(made.whole);
        }
        seen_ += placements.size();
        return {};
    }

    struct Made {
        rp_instance record;
        Box box;    // empty: there is nothing to be seen
        Box whole;  // around the object's box
        bool dropped = false;
    };
    Status make(const Placement& placement, const std::string& source, uint64_t index, Made& made) const {
        if (placement.object >= objects_.size())
            return Status::failed(fmt::format("{}: instance {}: object {} does not exist", source, index, placement.object));
        const Transform to_world = transform_of(placement);
        for (const auto& row : to_world.m)
            for (const double x : row)
                if (!std::isfinite(x)) return Status::failed(fmt::format("{}: instance {}: its transform is not finite", source, index));
        const ObjectBounds& object = objects_[placement.object];
        if (object.box.empty()) return {};
        const auto record = make_instance(to_world, object.box);
        const Box box = record ? bounds_of(*record, object) : Box();
        const auto near_enough = [](float x) { return std::abs(x) <= static_cast<float>(largest_coordinate); };
        if (!record || !std::ranges::all_of(box.lower, near_enough) || !std::ranges::all_of(box.upper, near_enough)) {
            made.dropped = true;
            return {};
        }
        made.record = *record;
        made.record.object = placement.object;
        made.box = box;
        made.whole = bounds_of(*record, {object.box, {}});
        return {};
    }

    const std::span<const ObjectBounds> objects_;
    const InstanceGathering& settings_;
    InstanceTraits& traits_;
    const uint64_t expected_;
    World world_;
    std::vector<Made> made_;  // of some placements
    uint64_t seen_ = 0, dropped_ = 0;
};

}  // namespace

Result<World> gather_instances(const Scene& scene, std::span<const ObjectBounds> objects, const InstanceGathering& settings, InstanceTraits& traits,
                               MeshIssues& issues) {
    uint64_t expected = 0;
    for (const auto& source : scene.instances) expected += source->count();
    InstanceGatherer gatherer(objects, settings, traits, expected);
    if (auto status = gatherer.check_room(expected); !status.ok()) return status;
    gatherer.reserve();
    for (const auto& source : scene.instances) {
        const auto take = [&](std::span<const Placement> placements) { return gatherer.take(placements, source->name()); };
        if (auto status = source->stream(take); !status.ok()) return status;
    }
    return gatherer.finish(issues);
}

}  // namespace raypager
