#include "bake/nesting.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <span>

#include "raypager/abi/types.h"
#include "scene/placement_transform.hpp"

namespace raypager {
namespace {

constexpr size_t placements_in_a_piece = 4096;

template <class Take>
Status for_each_placement(const InstanceSources& sources, const Take& take) {
    for (const auto& source : sources) {
        const auto take_some = [&](std::span<const Placement> placements) -> Status {
            for (const Placement& placement : placements) RAYPAGER_TRY(take(placement));
            return {};
        };
        RAYPAGER_TRY(source->stream(take_some));
    }
    return {};
}

// What an object places, wherever some sources place the object.
class PlacedInstances final : public InstanceSource {
public:
    PlacedInstances(InstanceSources outer, uint32_t object, InstanceSources inner, uint64_t count)
        : outer_(std::move(outer)), object_(object), inner_(std::move(inner)), count_(count) {}

    Status stream(const std::function<Status(std::span<const Placement>)>& take) const override {
        std::vector<Placement> some;
        const auto put_out = [&]() -> Status {
            if (some.empty()) return {};
            RAYPAGER_TRY(take(some));
            some.clear();
            return {};
        };
        const auto place = [&](const Transform& to_world) {
            return for_each_placement(inner_, [&](const Placement& inner) -> Status {
                const Transform placed = to_world * transform_of(inner);
                some.push_back(inner);
                std::copy_n(placed.m.begin(), 3, some.back().to_world.begin());
                return some.size() < placements_in_a_piece ? Status() : put_out();
            });
        };
        RAYPAGER_TRY(
            for_each_placement(outer_, [&](const Placement& outer) { return outer.object == object_ ? place(transform_of(outer)) : Status(); }));
        return put_out();
    }
    uint64_t count() const override { return count_; }
    std::string name() const override { return inner_.front()->name(); }
    uint64_t fingerprint() const override {
        uint64_t sum = object_;
        for (const auto& source : outer_) sum = sum * 0x9e3779b97f4a7c15 + source->fingerprint();
        for (const auto& source : inner_) sum = sum * 0x9e3779b97f4a7c15 + source->fingerprint();
        return sum;
    }

private:
    const InstanceSources outer_;
    const uint32_t object_;
    const InstanceSources inner_;
    const uint64_t count_;
};

// A source, and how often it places which object.
struct CountedSource {
    std::shared_ptr<const InstanceSource> source;
    std::map<uint32_t, uint64_t> placed;
};

class Planner {
public:
    Planner(const Scene& scene, uint64_t few)
        : scene_(scene), few_(few), world_(static_cast<uint32_t>(scene.objects.size())), sources_(world_ + 1), owners_(world_) {}

    Result<Nesting> run(uint32_t max_levels) {
        for (uint32_t object = 0; object < world_; object++) RAYPAGER_TRY(count(object, scene_.objects[object].instances));
        RAYPAGER_TRY(count(world_, scene_.instances));
        find_lights();
        // From the outermost on: what is written out here may be so once more further out.
        for (uint32_t object = world_; object-- > 0;)
            if (!sources_[object].empty() && is_to_be_written_out(object)) RAYPAGER_TRY(write_out(object));
        while (levels() > max_levels) RAYPAGER_TRY(write_out(cheapest()));
        Nesting nesting;
        nesting.of_world = plain(sources_[world_]);
        for (uint32_t object = 0; object < world_; object++) nesting.of_objects.push_back(plain(sources_[object]));
        return nesting;
    }

private:
    Status count(uint32_t owner, const InstanceSources& sources) {
        for (const auto& source : sources) {
            CountedSource counted = {source, {}};
            const auto take = [&](const Placement& placement) -> Status {
                if (placement.object >= world_) return {};  // said when it is gathered
                if (placement.object >= owner)
                    return Status::failed(fmt::format("object {} (\"{}\") places object {} (\"{}\"), which does not come before it", owner,
                                                      scene_.objects[owner].name, placement.object, scene_.objects[placement.object].name));
                if (has_look(placement) && (owner != world_ || !scene_.objects[placement.object].instances.empty()))
                    return Status::failed(
                        fmt::format("{}: an instance of object \"{}\" has a material or a colour of its own; instances in objects, and "
                                    "those of objects that place others, cannot",
                                    source->name(), scene_.objects[placement.object].name));
                counted.placed[placement.object]++;
                owners_[placement.object].insert(owner);
                return {};
            };
            RAYPAGER_TRY(for_each_placement({source}, take));
            sources_[owner].push_back(std::move(counted));
        }
        return {};
    }

    static bool has_look(const Placement& placement) { return placement.material != RP_NONE || !(placement.color == Float3{1, 1, 1}); }

    // What shines is placed in the world alone, where its lights are.
    void find_lights() {
        shines_.assign(world_, false);
        places_lights_.assign(world_, false);
        for (uint32_t object = 0; object < world_; object++) {
            for (const CountedSource& source : sources_[object])
                for (const auto& [inner, n] : source.placed)
                    places_lights_[object] = places_lights_[object] || shines_[inner] || places_lights_[inner];
            shines_[object] = std::ranges::any_of(scene_.objects[object].shapes, [](const Shape& shape) { return shape.area_light.has_value(); });
        }
    }

    // How often an owner places an object, or any.
    uint64_t times(uint32_t owner, uint32_t object) const {
        uint64_t sum = 0;
        for (const CountedSource& source : sources_[owner])
            if (const auto found = source.placed.find(object); found != source.placed.end()) sum += found->second;
        return sum;
    }
    uint64_t contents(uint32_t owner) const {
        uint64_t sum = 0;
        for (const CountedSource& source : sources_[owner])
            for (const auto& [object, n] : source.placed) sum += n;
        return sum;
    }
    uint64_t placements(uint32_t object) const {
        uint64_t sum = 0;
        for (const uint32_t owner : owners_[object]) sum += times(owner, object);
        return sum;
    }
    static uint64_t product(uint64_t a, uint64_t b) {
        return a != 0 && b > std::numeric_limits<uint64_t>::max() / a ? std::numeric_limits<uint64_t>::max() : a * b;
    }
    bool is_to_be_written_out(uint32_t object) const {
        if (places_lights_[object]) return true;
        const uint64_t inside = contents(object), outside = placements(object);
        return product(inside, outside) <= std::max(few_, inside + outside);
    }

    Status write_out(uint32_t object) {
        const uint64_t inside = contents(object);
        std::map<uint32_t, uint64_t> placed;
        for (const CountedSource& source : sources_[object])
            for (const auto& [inner, n] : source.placed) placed[inner] += n;
        for (const uint32_t owner : owners_[object]) {
            const uint64_t outside = times(owner, object);
            if (product(inside, outside) >= RP_NONE)
                return Status::failed(
                    fmt::format("{}: object \"{}\": {} instances in it, placed {} times, are more than {}; nest them less deeply, or leave "
                                "some out",
                                sources_[object].front().source->name(), scene_.objects[object].name, inside, outside, RP_NONE - 1));
            InstanceSources outer;
            for (const CountedSource& source : sources_[owner])
                if (source.placed.contains(object)) outer.push_back(source.source);
            CountedSource written = {std::make_shared<PlacedInstances>(std::move(outer), object, plain(sources_[object]), inside * outside), placed};
            for (auto& [inner, n] : written.placed) {
                n *= outside;
                owners_[inner].insert(owner);
            }
            // What is small is kept as it comes out, so that not each of many levels goes through all around it.
            if (inside * outside <= few_) RAYPAGER_TRY(keep_in_memory(written));
            sources_[owner].push_back(std::move(written));
        }
        for (const auto& [inner, n] : placed) owners_[inner].erase(object);
        sources_[object].clear();
        return {};
    }

    static Status keep_in_memory(CountedSource& source) {
        std::vector<Placement> placements;
        RAYPAGER_TRY(for_each_placement({source.source}, [&](const Placement& placement) {
            placements.push_back(placement);
            return Status();
        }));
        source.source = std::make_shared<InstancesInMemory>(source.source->name(), std::move(placements));
        return {};
    }

    // Of each object, and of the world: in how many instances something can be there.
    uint32_t levels() const {
        std::vector<uint32_t> of(sources_.size(), 0);
        for (uint32_t owner = 0; owner <= world_; owner++)
            for (const CountedSource& source : sources_[owner])
                for (const auto& [object, n] : source.placed) of[owner] = std::max(of[owner], of[object] + 1);
        return of[world_];
    }

    // Of the objects that place others, the one that takes the fewest instances to write out.
    uint32_t cheapest() const {
        uint32_t best = world_;
        uint64_t least = std::numeric_limits<uint64_t>::max();
        for (uint32_t object = 0; object < world_; object++) {
            if (sources_[object].empty() || owners_[object].empty()) continue;
            const uint64_t size = product(contents(object), placements(object));
            if (best == world_ || size < least) best = object, least = size;
        }
        return best;
    }

    static InstanceSources plain(const std::vector<CountedSource>& sources) {
        InstanceSources plain;
        for (const CountedSource& source : sources) plain.push_back(source.source);
        return plain;
    }

    const Scene& scene_;
    const uint64_t few_;
    const uint32_t world_;                             // stands for the world among owners
    std::vector<std::vector<CountedSource>> sources_;  // of each owner
    std::vector<std::set<uint32_t>> owners_;           // of each object: who places it
    std::vector<bool> shines_, places_lights_;         // objects of which a part does; that place such, or place what does
};

}  // namespace

Result<Nesting> plan_nesting(const Scene& scene, uint32_t max_levels, uint64_t few) {
    const bool nested = std::ranges::any_of(scene.objects, [](const Object& object) { return !object.instances.empty(); });
    if (!nested) return Nesting{scene.instances, std::vector<InstanceSources>(scene.objects.size())};
    return Planner(scene, few).run(max_levels);
}

}  // namespace raypager
