#include "bake/bake_instances.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <future>

#include "base/huge_pages.hpp"
#include "base/parallel.hpp"
#include "base/words.hpp"
#include "scene/placement_transform.hpp"
#include "world/placement.hpp"

namespace raypager {
namespace {

constexpr uint64_t instance_limit = RP_NONE;  // there are fewer
// Placements that are looked at together, by each thread some of them at a time.
constexpr size_t min_at_once = size_t{1} << 12, max_at_once = size_t{1} << 16, placements_of_thread = size_t{1} << 9;
// Of the memory for buffers: what records wait in until they are written, and what those that are looked at take.
constexpr uint64_t spill_buffer_share = 8, at_once_share = 16;

class InstanceGatherer {
public:
    InstanceGatherer(std::span<const ObjectBounds> objects, InstanceTraits* traits, uint64_t first_number, const InstanceGathering& settings,
                     uint64_t expected)
        : objects_(objects),
          traits_(traits),
          first_number_(first_number),
          settings_(settings),
          expected_(expected),
          at_once_(std::clamp<size_t>(settings.memory.buffers / at_once_share / sizeof(WorldInstance), min_at_once, max_at_once)) {}

    Status begin() {
        RAYPAGER_TRY(check_count(expected_));
        if (!fit(expected_)) return begin_spilling();
        reserve_huge(out_.world.instances, expected_);
        return {};
    }

    Status take(std::span<const Placement> placements, const std::string& source) {
        while (!placements.empty()) {
            if (settings_.stop && *settings_.stop) return Status::interrupted("stopped by a signal; nothing was written");
            const auto some = placements.first(std::min(placements.size(), at_once_));
            RAYPAGER_TRY(check_count(out_.count + some.size()));
            RAYPAGER_TRY(add(some, source));
            placements = placements.subspan(some.size());
            settings_.progress(std::min(1.0, static_cast<double>(seen_) / static_cast<double>(std::max<uint64_t>(expected_, 1))));
        }
        return {};
    }

    Result<GatheredInstances> finish(MeshIssues& issues) {
        if (dropped_ > 0)
            issues.warn("instances dropped",
                        fmt::format("{}: {} flattened or out of range: dropped", first_with_dropped_, counted(dropped_, "instance")));
        if (writer_) {
            RAYPAGER_TRY(wait_until_written());
            auto spilled = writer_->finish();
            if (!spilled) return spilled.status();
            out_.spilled = std::move(*spilled);
        }
        resize_huge(out_.world.primitives, out_.world.instances.size());
        parallel_for(out_.world.primitives.size(), max_at_once, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++) out_.world.primitives[i] = World::instance_entry(i);
        });
        return std::move(out_);
    }

private:
    Status check_count(uint64_t count) const {
        if (first_number_ + count < instance_limit) return {};
        return Status::failed(fmt::format("the scene has more than {} instances; leave some out", instance_limit - 1));
    }

    bool fit(uint64_t count) const { return count <= settings_.memory.gather / instance_memory; }

    Status begin_spilling() {
        auto file = SpillFile::create(settings_.spill_beside);
        if (!file) return file.status();
        writer_.emplace(std::move(*file), settings_.memory.buffers / spill_buffer_share);
        RAYPAGER_TRY(writer_->add(instance_records, std::as_bytes(std::span(out_.world.instances))));
        out_.world = {};
        return {};
    }

    Status add(std::span<const Placement> placements, const std::string& source) {
        made_.resize(placements.size());
        pieces_.assign((placements.size() + placements_of_thread - 1) / placements_of_thread, {});
        RAYPAGER_TRY(parallel_try(placements.size(), placements_of_thread, [&](size_t begin, size_t end) -> Status {
            Piece& piece = pieces_[begin / placements_of_thread];
            for (size_t i = begin; i < end; i++) RAYPAGER_TRY(make(placements[i], source, i, made_[begin + piece.kept], piece));
            return {};
        }));
        if (traits_) RAYPAGER_TRY(add_traits(placements, source));
        seen_ += placements.size();
        uint64_t kept = 0;
        for (Piece& piece : pieces_) {
            piece.first = kept;
            kept += piece.kept;
            if (dropped_ == 0 && piece.dropped > 0) first_with_dropped_ = source;
            dropped_ += piece.dropped;
            out_.levels = std::max(out_.levels, piece.levels);
            // How the object is cut must not change pictures, which depend on the size of the scene.
            out_.bounds.grow(piece.whole);
        }
        return keep(kept);
    }

    // In the order of the placements, which decides how traits are numbered.
    Status add_traits(std::span<const Placement> placements, const std::string& source) {
        for (size_t p = 0; p < pieces_.size(); p++)
            for (const Special& special : pieces_[p].special) {
                const Placement& placement = placements[special.placement];
                rp_instance* const record = special.kept == not_kept ? nullptr : &made_[p * placements_of_thread + special.kept].record;
                const Transform to_world = record ? placement_of(*record, objects_[placement.object].box) : transform_of(placement);
                const auto traits = traits_->add(placement, to_world);
                if (!traits) return traits.status().at(fmt::format("{}: instance {}", source, seen_ + special.placement));
                if (record) record->path_high = *traits << RP_INSTANCE_TRAITS_SHIFT;
            }
        return {};
    }

    // What pieces_ say of made_, numbered behind all before.
    Status keep(uint64_t kept) {
        if (!writer_ && !fit(out_.count + kept)) RAYPAGER_TRY(begin_spilling());
        std::vector<WorldInstance>& instances = writer_ ? records_ : out_.world.instances;
        const uint64_t before = writer_ ? 0 : instances.size();
        grow_huge(instances, before + kept);
        instances.resize(before + kept);
        parallel_for(pieces_.size(), 1, [&](size_t p, size_t) {
            for (uint64_t i = 0; i < pieces_[p].kept; i++) {
                WorldInstance& instance = instances[before + pieces_[p].first + i];
                instance = made_[p * placements_of_thread + i];
                instance.number = static_cast<uint32_t>(first_number_ + out_.count + pieces_[p].first + i);
            }
        });
        out_.count += kept;
        return writer_ ? write() : Status();
    }

    // While the next ones are made.
    Status write() {
        RAYPAGER_TRY(wait_until_written());
        records_.swap(written_);
        writing_ = std::async(std::launch::async | std::launch::deferred,
                              [this] { return writer_->add(instance_records, std::as_bytes(std::span(written_))); });
        return {};
    }
    Status wait_until_written() { return writing_.valid() ? writing_.get() : Status(); }

    // A placement that has, or may have, traits; and which of those that are kept of its piece it is. Lights that are not seen are no instance.
    static constexpr uint64_t not_kept = UINT64_MAX;
    struct Special {
        size_t placement;
        uint64_t kept;
    };
    // What became of some placements: those that are kept lie at the front of the piece's place in made_.
    struct Piece {
        uint64_t kept = 0, dropped = 0;
        uint64_t first = 0;  // among all that were kept at the same time
        Box whole;           // around the boxes of their objects
        uint32_t levels = 0;
        std::vector<Special> special;
    };
    // index: of the placement, among those that came at once.
    Status make(const Placement& placement, const std::string& source, size_t index, WorldInstance& made, Piece& piece) const {
        if (placement.object >= objects_.size())
            return Status::failed(fmt::format("{}: instance {}: object {} does not exist", source, seen_ + index, placement.object));
        const Transform to_world = transform_of(placement);
        for (const auto& row : to_world.m)
            for (const double x : row)
                if (!std::isfinite(x)) return Status::failed(fmt::format("{}: instance {}: its transform is not finite", source, seen_ + index));
        const ObjectBounds& object = objects_[placement.object];
        const bool special = traits_ && traits_->may_have_any(placement);
        if (object.box.empty()) {
            if (special) piece.special.push_back({index, not_kept});
            return {};
        }
        const auto placed = place_instance(to_world, object.box);
        const auto near_enough = [](float x) { return std::abs(x) <= static_cast<float>(largest_coordinate); };
        if (placed) made.box = bounds_of(*placed, object);
        if (!placed || !std::ranges::all_of(made.box.lower, near_enough) || !std::ranges::all_of(made.box.upper, near_enough)) {
            piece.dropped++;
            return {};
        }
        made.record = placed->record;
        made.record.object = placement.object;
        piece.whole.grow(object.parts.empty() ? made.box : bounds_of(*placed, {object.box, {}, 0}));
        piece.levels = std::max(piece.levels, object.levels + 1);
        if (special) piece.special.push_back({index, piece.kept});
        piece.kept++;
        return {};
    }

    const std::span<const ObjectBounds> objects_;
    InstanceTraits* const traits_;  // or null
    const uint64_t first_number_;
    const InstanceGathering& settings_;
    const uint64_t expected_;
    const size_t at_once_;
    GatheredInstances out_;
    std::optional<BucketWriter> writer_;            // from when there are too many
    std::vector<WorldInstance> made_;               // of some placements
    std::vector<Piece> pieces_;                     // of these
    std::vector<WorldInstance> records_, written_;  // of these, on the way to the disk, and of those before
    uint64_t seen_ = 0, dropped_ = 0;
    std::string first_with_dropped_;  // the source
    std::future<Status> writing_;     // of written_; the first to go
};

}  // namespace

Result<GatheredInstances> gather_instances(const InstanceSources& sources, std::span<const ObjectBounds> objects, InstanceTraits* traits,
                                           uint64_t first_number, const InstanceGathering& settings, MeshIssues& issues) {
    uint64_t expected = 0;
    for (const auto& source : sources) expected += source->count();
    InstanceGatherer gatherer(objects, traits, first_number, settings, expected);
    RAYPAGER_TRY(gatherer.begin());
    for (const auto& source : sources) {
        const auto take = [&](std::span<const Placement> placements) { return gatherer.take(placements, source->name()); };
        RAYPAGER_TRY(source->stream(take));
    }
    return gatherer.finish(issues);
}

Result<InstanceBlocks> bake_instances(const InstanceSources& sources, std::span<const ObjectBounds> objects, InstanceTraits* traits,
                                      const WorldBuilding& building, const std::function<void(double fraction)>& progress, BlockSink& sink,
                                      BakedScene& baked, MeshIssues& issues, uint64_t& buckets) {
    InstanceBlocks result;
    if (sources.empty()) return result;
    const InstanceGathering settings = {building.memory, building.spill_beside, building.blocks.stop,
                                        [&](double fraction) { progress(fraction / 2); }};
    auto instances = gather_instances(sources, objects, traits, baked.instances, settings, issues);
    if (!instances) return instances.status();
    if (instances->count == 0) return result;
    WorldBuilding of_instances = building;
    of_instances.blocks.max_entries = 1;
    const auto settle = [&](uint64_t) -> Result<WorldBuilding> { return of_instances; };
    const GatherProgress build_progress = [&](const char* stage, double fraction) {
        if (stage == std::string_view("build")) progress((1 + fraction) / 2);
    };
    const size_t first_block = baked.blocks.size();
    auto boxes = instances->spilled ? build_from_disk(std::move(*instances->spilled), 0, instances->count * instance_weight, settle, build_progress,
                                                      sink, baked, buckets)
                                    : build_in_memory(instances->world, settle, build_progress, sink, baked);
    if (!boxes) return boxes.status();
    for (BlockRecord& block : std::span(baked.blocks).subspan(first_block)) block.levels = instances->levels;
    baked.instances += instances->count;
    result.block_entry_boxes = std::move(*boxes);
    result.bounds = instances->bounds;
    result.levels = instances->levels;
    return result;
}

}  // namespace raypager
