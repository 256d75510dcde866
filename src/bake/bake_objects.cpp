#include "bake/bake_objects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <new>

#include "bake/bake_instances.hpp"
#include "bake/scene_size.hpp"
#include "base/parallel.hpp"
#include "gather/gather.hpp"

namespace raypager {
namespace {

// While a small object is made: of what its file has; and whatever is in it.
constexpr uint64_t memory_of_file = 8, memory_at_least = uint64_t{64} << 10;

// What shapes are gathered by, besides themselves.
Scene without_shapes(const Scene& scene) {
    Scene bare;
    bare.camera = scene.camera;
    bare.width = scene.width;
    bare.height = scene.height;
    bare.materials = scene.materials;
    bare.area_lights = scene.area_lights;
    bare.texture_ops = scene.texture_ops;
    bare.texture_maps = scene.texture_maps;
    return bare;
}

// Boxes around neighbours among many.
std::vector<Box> some_boxes(std::span<const BlockEntryBox> boxes) {
    const size_t each = (boxes.size() + ObjectBounds::max_parts - 1) / ObjectBounds::max_parts;
    std::vector<Box> some;
    for (size_t i = 0; i < boxes.size(); i++) {
        if (i % each == 0) some.emplace_back();
        some.back().grow(boxes[i].box);
    }
    return some;
}

// Blocks of instances are not looked at: how far these reach follows from what they place.
ObjectTree tree_over(std::span<const BlockEntryBox> block_entry_boxes, std::span<const BlockRecord> blocks) {
    ObjectTree object;
    for (const BlockRecord& block : blocks) {
        if (block.instances > 0) continue;
        Box box;
        std::copy_n(block.lower, 3, box.lower);
        std::copy_n(block.upper, 3, box.upper);
        object.bounds.box.grow(box);
    }
    object.tree = build_top_tree(block_entry_boxes);
    object.bounds.parts = some_boxes(block_entry_boxes);
    return object;
}

Status check_count(const Object& object, uint64_t primitives) {
    if (primitives < RP_NONE) return {};
    return Status::failed(fmt::format("{}: the scene has more than {} primitives with it; leave some objects out", object.name, RP_NONE - 1));
}

// Its primitives follow those that are there.
void add_ranges(const Gathered& object, BakedScene& baked) {
    for (rp_primitive_range range : object.ranges) {
        range.first_primitive += object.world.first_id;
        baked.ranges.push_back(range);
    }
    baked.triangles += object.triangles;
    baked.spheres += object.spheres;
}

// Blocks that wait for their numbers.
class WaitingBlocks final : public BlockSink {
public:
    Status append(std::span<const std::byte> stored, BlockRecord&) override {
        blocks_.emplace_back(stored.begin(), stored.end());
        return {};
    }
    Status reserve_pages(uint32_t) override { return {}; }
    Status put_page(uint32_t, std::span<const std::byte>, PageRecord&) override { return {}; }
    Status finish(const BakedScene&) override { return {}; }

    // scene: what was baked with them.
    Status append_to(BlockSink& sink, const BakedScene& scene, BakedScene& baked) {
        const auto first = static_cast<rp_u32>(baked.blocks.size());
        for (size_t i = 0; i < blocks_.size(); i++) {
            rp_block_header header;
            std::memcpy(&header, blocks_[i].data(), sizeof header);
            header.block_index = first + static_cast<rp_u32>(i);
            std::memcpy(blocks_[i].data(), &header, sizeof header);
            BlockRecord record = scene.blocks[i];
            RAYPAGER_TRY(sink.append(blocks_[i], record));
            baked.blocks.push_back(record);
        }
        for (rp_block_entry entry : scene.block_entries) {
            entry.block += first;
            baked.block_entries.push_back(entry);
        }
        baked.wide_roots.insert(baked.wide_roots.end(), scene.wide_roots.begin(), scene.wide_roots.end());
        return {};
    }

private:
    std::vector<std::vector<std::byte>> blocks_;
};

class ObjectsBake {
public:
    ObjectsBake(const ObjectBaking& baking, BlockSink& sink, BakedScene& baked, MeshIssues& issues, uint64_t& buckets)
        : baking_(baking), objects_(baking.scene.objects), sink_(sink), baked_(baked), issues_(issues), buckets_(buckets) {
        baking_.points.cull_to_camera = baking_.points.filter_to_image = false;  // nobody knows where the camera will be
    }

    Result<std::vector<ObjectTree>> run() {
        while (made_.size() < objects_.size()) {
            size_t end = made_.size();
            while (end < objects_.size() && is_small(end)) end++;
            if (end - made_.size() >= 2) RAYPAGER_TRY(bake_side_by_side(end));
            if (made_.size() < objects_.size()) RAYPAGER_TRY(bake_alone(objects_[made_.size()]));
        }
        return std::move(made_);
    }

private:
    class SideBySide;

    // Sources of points need not let themselves be asked by several threads at once; instances need what they place.
    bool is_small(size_t index) const {
        const Object& object = objects_[index];
        if (!baking_.instances[index].empty()) return false;
        if (std::ranges::any_of(object.shapes, [](const Shape& shape) { return shape.points != nullptr; })) return false;
        return side_ > 1 && memory_of_file * estimated_bytes(object) + memory_at_least <= memory().gather / (2 * side_);
    }
    const BakeMemory& memory() const { return baking_.building.memory; }
    const std::atomic<bool>* stop() const { return baking_.building.blocks.stop; }
    uint64_t primitives() const { return baked_.triangles + baked_.spheres; }
    // fraction: of the object that is to be appended next.
    void report(double fraction) const { baking_.progress((static_cast<double>(made_.size()) + fraction) / static_cast<double>(objects_.size())); }

    Result<Gathered> gather_object(size_t index, const BakeMemory& memory, const GatherProgress& progress) {
        std::unique_ptr<Scene> part = take_part();
        part->shapes = seen_shapes(baking_.scene, static_cast<uint32_t>(index));
        auto gathered = gather(*part, {memory, baking_.building.spill_beside, stop()}, progress, baking_.points, baked_.position_cell);
        const std::lock_guard lock(parts_mutex_);
        parts_.push_back(std::move(part));
        return gathered;
    }
    std::unique_ptr<Scene> take_part() {
        {
            const std::lock_guard lock(parts_mutex_);
            if (!parts_.empty()) {
                auto part = std::move(parts_.back());
                parts_.pop_back();
                return part;
            }
        }
        return std::make_unique<Scene>(without_shapes(baking_.scene));
    }

    Status bake_alone(const Object& object) {
        if (stop() && *stop()) return Status::interrupted("stopped by a signal; nothing was written");
        auto gathered = gather_object(made_.size(), memory(), [this](const char*, double fraction) { report(fraction / 2); });
        if (!gathered) return gathered.status();
        RAYPAGER_TRY(check_count(object, primitives() + gathered->triangles + gathered->spheres));
        issues_.add(gathered->issues);
        gathered->world.first_id = static_cast<uint32_t>(primitives());
        ObjectLights lights = lights_of_primitives(*gathered);
        RAYPAGER_TRY(add_unseen_lights(baking_.scene, object.shapes, lights, issues_));
        const auto first_range = static_cast<uint32_t>(baked_.ranges.size());
        add_ranges(*gathered, baked_);
        const uint64_t first_block_entry = baked_.block_entries.size();
        const size_t first_block = baked_.blocks.size();
        const GatherProgress building = [&](const char* stage, double fraction) {
            if (stage == std::string_view("build")) report((1 + fraction) / 2);
        };
        const auto settle = [this](uint64_t) -> Result<WorldBuilding> { return baking_.building; };
        auto boxes = build_gathered(*gathered, settle, building, sink_, baked_, buckets_);
        if (!boxes) return boxes.status();
        gathered->world = World();
        const auto instances = add_instances(*boxes);
        if (!instances) return instances.status();
        ObjectTree made = tree_over(*boxes, std::span(baked_.blocks).subspan(first_block));
        made.bounds.box.grow(instances->bounds);
        made.bounds.levels = instances->levels;
        made.first_block_entry = first_block_entry;
        made.lights = std::move(lights);
        made.first_range = first_range;
        made_.push_back(std::move(made));
        return {};
    }

    // Of the object that comes next, behind its shapes.
    Result<InstanceBlocks> add_instances(std::vector<BlockEntryBox>& boxes) {
        const InstanceSources& sources = baking_.instances[made_.size()];
        if (sources.empty()) return InstanceBlocks();
        for (size_t i = bounds_.size(); i < made_.size(); i++) bounds_.push_back(made_[i].bounds);
        auto instances = bake_instances(
            sources, bounds_, nullptr, baking_.building, [](double) {}, sink_, baked_, issues_, buckets_);
        if (instances) boxes.insert(boxes.end(), instances->block_entry_boxes.begin(), instances->block_entry_boxes.end());
        return instances;
    }

    // Those up to end; or up to one that is not as small as it seemed.
    Status bake_side_by_side(size_t end);

    ObjectBaking baking_;
    const std::vector<Object>& objects_;
    BlockSink& sink_;
    BakedScene& baked_;
    MeshIssues& issues_;
    uint64_t& buckets_;
    const size_t side_ = std::min(memory().builders, helping_workers());  // so many at once
    std::vector<ObjectTree> made_;
    std::vector<ObjectBounds> bounds_;  // of the first of these
    std::mutex parts_mutex_;
    std::vector<std::unique_ptr<Scene>> parts_;  // those that nobody uses
};

// Objects are handed out in order. Each is gathered, waits until it is known how many primitives come before it, is built, and waits for its turn to
// be appended. The one that is to be appended next waits for nobody.
class ObjectsBake::SideBySide {
public:
    SideBySide(ObjectsBake& bake, size_t end) : bake_(bake), first_(bake.made_.size()), counted_(first_), end_(end), primitives_(bake.primitives()) {
        memory_.gather /= bake.side_;
        building_.blocks.builders = 1;
    }

    Status run() {
        parallel_for(
            end_ - first_, 1, [this](size_t i, size_t) { make(first_ + i); }, bake_.side_);
        return failure_;
    }

private:
    struct Made {
        Gathered gathered;  // its world is used up
        BakedScene scene;
        WaitingBlocks blocks;
        ObjectTree tree;
    };

    void make(size_t index) {
        const Object& object = bake_.objects_[index];
        try {
            if (!wait(index, [&] { return index < bake_.made_.size() + 2 * bake_.side_; })) return;
            auto gathered = bake_.gather_object(index, memory_, [](const char*, double) {});
            // What has gone to the disk would have stayed in memory, had it been alone: so it shall be.
            if (!gathered || gathered->spilled) return give_up(index, gathered ? Status() : gathered.status());
            if (!wait(index, [&] { return counted_ == index; })) return;
            auto made = std::make_unique<Made>();
            made->gathered = std::move(*gathered);
            if (const Status few = count(index, made->gathered); !few.ok()) return give_up(index, few);
            if (const Status built = build(object, *made); !built.ok()) return give_up(index, built);
            append(index, std::move(made));
        } catch (const std::bad_alloc&) {
            give_up(index, Status::failed(object.name + ": not enough memory to bake it; give a smaller --host-limit"));
        } catch (...) {
            give_up(index, Status());  // so that nobody waits for it
            throw;
        }
    }

    // False: it is not to be made.
    template <class Ready>
    bool wait(size_t index, const Ready& ready) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return index >= end_ || ready(); });
        return index < end_;
    }

    // The first of those that fail decides, whichever thread comes first.
    void give_up(size_t index, const Status& why) {
        const std::lock_guard lock(mutex_);
        if (index >= end_) return;
        end_ = index;
        failure_ = why;
        changed_.notify_all();
    }

    Status count(size_t index, Gathered& gathered) {
        const std::lock_guard lock(mutex_);
        gathered.world.first_id = static_cast<uint32_t>(primitives_);
        primitives_ += gathered.triangles + gathered.spheres;
        counted_++;
        changed_.notify_all();
        return check_count(bake_.objects_[index], primitives_);
    }

    Status build(const Object& object, Made& made) {
        ObjectLights lights = lights_of_primitives(made.gathered);
        RAYPAGER_TRY(add_unseen_lights(bake_.baking_.scene, object.shapes, lights, made.gathered.issues));
        made.scene.position_cell = bake_.baked_.position_cell;
        const auto settle = [this](uint64_t) -> Result<WorldBuilding> { return building_; };
        const auto boxes = build_in_memory(
            made.gathered.world, settle, [](const char*, double) {}, made.blocks, made.scene);
        if (!boxes) return boxes.status();
        const uint32_t first_id = made.gathered.world.first_id;
        made.gathered.world = World();
        made.gathered.world.first_id = first_id;
        made.tree = tree_over(*boxes, made.scene.blocks);
        made.tree.lights = std::move(lights);
        return {};
    }

    void append(size_t index, std::unique_ptr<Made> made) {
        const std::lock_guard lock(mutex_);
        waiting_[index] = std::move(made);
        auto& appended = bake_.made_;
        for (auto due = waiting_.find(appended.size()); due != waiting_.end() && appended.size() < end_; due = waiting_.find(appended.size())) {
            Made& next = *due->second;
            BakedScene& baked = bake_.baked_;
            next.tree.first_block_entry = baked.block_entries.size();
            next.tree.first_range = static_cast<uint32_t>(baked.ranges.size());
            if (const Status status = next.blocks.append_to(bake_.sink_, next.scene, baked); !status.ok()) {
                end_ = appended.size();
                failure_ = status;
                break;
            }
            bake_.issues_.add(next.gathered.issues);
            add_ranges(next.gathered, baked);
            appended.push_back(std::move(next.tree));
            waiting_.erase(due);
            bake_.report(0);
        }
        changed_.notify_all();
    }

    ObjectsBake& bake_;
    const size_t first_;
    BakeMemory memory_ = bake_.memory();
    WorldBuilding building_ = bake_.baking_.building;

    std::mutex mutex_;  // of what follows, and of what is baked
    std::condition_variable changed_;
    size_t counted_;       // objects up to here know their first primitive
    size_t end_;           // objects from here on are not made
    uint64_t primitives_;  // of those that are counted, and all before
    std::map<size_t, std::unique_ptr<Made>> waiting_;
    Status failure_;
};

Status ObjectsBake::bake_side_by_side(size_t end) { return SideBySide(*this, end).run(); }

}  // namespace

Result<std::vector<ObjectTree>> bake_objects(const ObjectBaking& baking, BlockSink& sink, BakedScene& baked, MeshIssues& issues, uint64_t& buckets) {
    return ObjectsBake(baking, sink, baked, issues, buckets).run();
}

}  // namespace raypager
