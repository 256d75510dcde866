#include "raypager/bake.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <memory>
#include <new>
#include <optional>

#include "bake/append_tree.hpp"
#include "bake/bake_images.hpp"
#include "bake/bake_instances.hpp"
#include "bake/build_blocks.hpp"
#include "bake/instance_traits.hpp"
#include "bake/restyle.hpp"
#include "bake/scene_size.hpp"
#include "base/memory.hpp"
#include "base/words.hpp"
#include "block/block_coding.hpp"
#include "cut/distribute.hpp"
#include "cut/top_tree.hpp"
#include "cut/world_cut.hpp"
#include "gather/gather.hpp"
#include "gather/lights.hpp"
#include "store/block_file.hpp"
#include "store/memory_blocks.hpp"
#include "world/bake_memory.hpp"
#include "world/instance_record.hpp"

namespace raypager {
namespace {

constexpr uint64_t min_block_bytes = 16 << 10, min_automatic = uint64_t{128} << 10, max_automatic = uint64_t{4} << 20;

// About a thousand blocks a scene page best: smaller ones are chosen more exactly, larger ones cost less a byte to move. Below 128 KiB a
// transfer costs more than its bytes; above 4 MiB nothing is gained.
uint64_t automatic_block_bytes(uint64_t scene_bytes, uint64_t host_limit) {
    return std::min(std::clamp(std::bit_ceil(scene_bytes / 1024), min_automatic, max_automatic), BakeMemory::largest_block(host_limit));
}

Status check_options(const BakeOptions& options) {
    if (options.block_bytes != 0 && (options.block_bytes < min_block_bytes || options.block_bytes > RP_MAX_BLOCK_BYTES))
        return Status::usage(fmt::format("block size {}: must be from {} to {}", format_bytes(options.block_bytes), format_bytes(min_block_bytes),
                                         format_bytes(RP_MAX_BLOCK_BYTES)));
    if (options.block_entries < 1 || options.block_entries > RP_MAX_BLOCK_ENTRIES)
        return Status::usage(fmt::format("{} sub-boxes per block: must be from 1 to {}", options.block_entries, RP_MAX_BLOCK_ENTRIES));
    if (options.position_error != 0 && !(options.position_error >= min_position_error && options.position_error <= max_position_error))
        return Status::usage(fmt::format("position error {}: must be from {} to {}", options.position_error, min_position_error, max_position_error));
    return {};
}

void set_bounds(BakedScene& baked, const Box& bounds) {
    if (bounds.empty()) return;
    std::copy_n(bounds.lower, 3, baked.lower);
    std::copy_n(bounds.upper, 3, baked.upper);
}

BakedScene describe(const Scene& scene, Gathered& gathered) {
    BakedScene baked;
    take_settings(scene, baked);
    baked.lights = std::move(gathered.lights);
    baked.ranges = std::move(gathered.ranges);
    baked.spheres = gathered.spheres;
    baked.triangles = gathered.triangles;
    set_bounds(baked, gathered.bounds);
    return baked;
}

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

// The tree over the blocks of an object, and what holds the object, in its own space.
struct ObjectTree {
    TopTree tree;
    uint64_t first_block_entry = 0;
    Box box;
    std::vector<Box> parts;  // as ObjectBounds has it
    ObjectLights lights;
    uint32_t first_range = 0;
};

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

class Bake {
public:
    // beside: where scratch files go, in the folder of that path.
    Bake(const Scene& scene, const BakeOptions& options, const std::filesystem::path& beside) : scene_(scene), options_(options), beside_(beside) {
        if (options_.host_limit != 0) return;
        limit_ = default_limit(total_memory() / 2, available_memory());
        options_.host_limit = std::max(limit_.bytes, BakeMemory::smallest_limit(options_.block_bytes));
    }

    // open: makes the sink, once it is clear that there is something to bake.
    template <class Open>
    Result<BakeSummary> run(const Open& open) {
        const auto start = std::chrono::steady_clock::now();
        BakeSummary summary;
        RAYPAGER_TRY(check_options(options_));
        RAYPAGER_TRY(validate(scene_));
        const auto fingerprint = bake_fingerprint(scene_, options_);
        if (!fingerprint) return fingerprint.status();
        // Blocks of objects are made before all is known of the rest.
        if (!scene_.objects.empty() || !scene_.instances.empty()) settle_block_size(estimated_bytes(scene_));
        const auto memory = plan_memory();
        if (!memory) return memory.status();
        auto images = plan_images(scene_, options_);
        if (!images) return images.status();
        const Result<BlockSink*> sink = open();
        if (!sink) return sink.status();

        const GatherLimits limits = {*memory, beside_, options_.stop};
        auto gathered = gather(
            scene_, limits, [this](const char* name, double fraction) { report(name, fraction); }, options_.points, cell());
        if (!gathered) return gathered.status();
        BakedScene baked = describe(scene_, *gathered);
        baked.fingerprint = *fingerprint;
        baked.position_cell = cell();
        RAYPAGER_TRY(bake_geometry(*gathered, **sink, baked, summary));
        RAYPAGER_TRY(add_images(std::move(*images), **sink, baked));
        RAYPAGER_TRY((*sink)->finish(baked));

        if (summary.buckets > 0 && limit_.reduced()) {
            summary.reduced_limit = limit_.bytes;
            summary.usual_limit = limit_.usual;
        }
        count(baked, summary);
        summary.points_culled = gathered->points_culled;
        summary.points_merged = gathered->points_merged;
        summary.issues = gathered->issues;
        summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        return summary;
    }

private:
    float cell() const { return options_.position_error > 0 ? position_cell(options_.position_error) : 0; }

    static void count(const BakedScene& baked, BakeSummary& summary) {
        summary.triangles = baked.triangles;
        summary.spheres = baked.spheres;
        summary.objects = baked.objects.size();
        summary.instances = baked.instances;
        summary.blocks = baked.blocks.size();
        summary.stored_bytes = baked.stored_bytes();
        summary.images = baked.images.size();
        summary.pages = baked.pages.size();
        summary.texture_bytes = baked.texture_bytes();
    }

    void report(const char* stage, double fraction) const {
        if (options_.progress) options_.progress(stage, fraction);
    }

    Status add_images(ImagePlan plan, BlockSink& sink, BakedScene& baked) {
        const ImageBaking settings = {options_.host_limit, options_.stop, [this](double fraction) { report("images", fraction); }};
        return bake_images(scene_, std::move(plan), settings, sink, baked);
    }

    BlockBuilding building(const BakeMemory& memory) const { return {options_.block_bytes, options_.block_entries, memory.builders, options_.stop}; }

    // Chooses the size of blocks where that is left to us, and with it how many are made at a time.
    void settle_block_size(uint64_t scene_bytes) {
        if (options_.block_bytes == 0) options_.block_bytes = automatic_block_bytes(scene_bytes, options_.host_limit);
    }

    // For shapes. Where there are objects, the scene's own shapes are gathered before, so that ids of primitives are known, and keep one half of it,
    // in memory or not, while each object has the other.
    Result<BakeMemory> plan_memory() const {
        auto memory = BakeMemory::plan(options_.host_limit, options_.block_bytes ? options_.block_bytes : min_automatic);
        if (!memory || scene_.objects.empty()) return memory;
        for (uint64_t BakeMemory::*part : {&BakeMemory::gather, &BakeMemory::bucket, &BakeMemory::buffers, &BakeMemory::cut}) *memory.*part /= 2;
        memory->chunk_triangles = std::max<size_t>(memory->chunk_triangles / 2, 1);
        return memory;
    }

    // Everything that is made of blocks: objects, the scene's own shapes, instances, and the trees above them.
    Status bake_geometry(Gathered& gathered, BlockSink& sink, BakedScene& baked, BakeSummary& summary) {
        std::vector<ObjectTree> objects;
        RAYPAGER_TRY(add_objects(gathered, sink, baked, objects, summary.buckets));
        if (options_.position_error > 0 && baked.triangles == 0 && gathered.issues.degenerate > 0)
            return Status::failed(
                fmt::format("no triangle is left of the scene if vertices move by {}; give a smaller --position-error", options_.position_error));
        const uint64_t of_objects = baked.block_entries.size();
        std::vector<BlockEntryBox> block_entry_boxes;
        const GatherProgress progress = [this](const char* stage, double fraction) { report(stage, fraction); };
        RAYPAGER_TRY(build_shapes(gathered, progress, sink, baked, block_entry_boxes, summary.buckets));
        // Its memory is for instances now, and then for images.
        gathered.world = World();
        RAYPAGER_TRY(add_instances(gathered, objects, sink, baked, block_entry_boxes));

        const TopTree top = build_top_tree(block_entry_boxes);
        baked.top_grid = append_tree(top, of_objects, baked);
        baked.top_grid.block_entry_count = static_cast<rp_u32>(baked.block_entries.size());
        for (const ObjectTree& object : objects) add_object_tree(object, baked);
        baked.block_entry_paths.insert(baked.block_entry_paths.end(), top.paths.begin(), top.paths.end());
        return {};
    }

    static void add_object_tree(const ObjectTree& object, BakedScene& baked) {
        rp_object added = {};
        added.top = append_tree(object.tree, object.first_block_entry, baked);
        added.first_range = object.first_range;
        if (!object.box.empty())
            for (size_t a = 0; a < 3; a++) added.base[a] = static_cast<float>(middle_of(object.box)[a]);
        baked.objects.push_back(added);
        baked.block_entry_paths.insert(baked.block_entry_paths.end(), object.tree.paths.begin(), object.tree.paths.end());
    }

    // One after the other. What the scene's camera sees of a cloud is no matter: nobody knows where it will be.
    Status add_objects(Gathered& gathered, BlockSink& sink, BakedScene& baked, std::vector<ObjectTree>& objects, uint64_t& buckets) {
        if (scene_.objects.empty()) return {};
        Scene part = without_shapes(scene_);
        PointOptions points = options_.points;
        points.cull_to_camera = points.filter_to_image = false;
        const auto memory = plan_memory();
        if (!memory) return memory.status();
        const auto all = static_cast<double>(scene_.objects.size());
        for (const Object& object : scene_.objects) {
            if (options_.stop && *options_.stop) return Status::interrupted("stopped by a signal; nothing was written");
            const auto done = static_cast<double>(objects.size());
            const auto progress = [&, this](double fraction) { report("objects", (done + fraction) / all); };
            part.shapes = seen_shapes(scene_, static_cast<uint32_t>(objects.size()));
            auto placed = gather(
                part, {*memory, beside_, options_.stop}, [&](const char*, double fraction) { progress(fraction / 2); }, points, cell());
            if (!placed) return placed.status();
            const uint64_t first = baked.triangles + baked.spheres;
            if (first + placed->triangles + placed->spheres >= RP_NONE)
                return Status::failed(
                    fmt::format("{}: the scene has more than {} primitives with it; leave some objects out", object.name, RP_NONE - 1));
            gathered.issues.add(placed->issues);
            placed->world.first_id = static_cast<uint32_t>(first);
            RAYPAGER_TRY(add_object(*placed, progress, sink, baked, objects, buckets));
            RAYPAGER_TRY(add_unseen_lights(scene_, object.shapes, objects.back().lights, gathered.issues));
        }
        return {};
    }

    // Its primitives follow those that are there.
    Status add_object(Gathered& object, const std::function<void(double)>& progress, BlockSink& sink, BakedScene& baked,
                      std::vector<ObjectTree>& objects, uint64_t& buckets) {
        ObjectTree added;
        added.lights = lights_of_primitives(object);
        added.first_range = static_cast<uint32_t>(baked.ranges.size());
        for (rp_primitive_range range : object.ranges) {
            range.first_primitive += object.world.first_id;
            baked.ranges.push_back(range);
        }
        baked.triangles += object.triangles;
        baked.spheres += object.spheres;
        added.first_block_entry = baked.block_entries.size();
        const size_t first_block = baked.blocks.size();
        std::vector<BlockEntryBox> block_entry_boxes;
        const GatherProgress building = [&](const char* stage, double fraction) {
            if (stage == std::string_view("build")) progress((1 + fraction) / 2);
        };
        RAYPAGER_TRY(build_shapes(object, building, sink, baked, block_entry_boxes, buckets));
        for (size_t block = first_block; block < baked.blocks.size(); block++) {
            Box box;
            std::copy_n(baked.blocks[block].lower, 3, box.lower);
            std::copy_n(baked.blocks[block].upper, 3, box.upper);
            added.box.grow(box);
        }
        added.tree = build_top_tree(block_entry_boxes);
        added.parts = some_boxes(block_entry_boxes);
        objects.push_back(std::move(added));
        return {};
    }

    Status add_instances(Gathered& gathered, const std::vector<ObjectTree>& objects, BlockSink& sink, BakedScene& baked,
                         std::vector<BlockEntryBox>& block_entry_boxes) {
        if (scene_.instances.empty()) return {};
        const auto memory = BakeMemory::plan(options_.host_limit, options_.block_bytes);
        if (!memory) return memory.status();
        std::vector<ObjectBounds> bounds_of_objects;
        std::vector<ObjectLights> lights_of_objects;
        std::vector<uint32_t> first_ranges;
        for (const ObjectTree& object : objects) {
            bounds_of_objects.push_back({object.box, object.parts});
            lights_of_objects.push_back(object.lights);
            first_ranges.push_back(object.first_range);
        }
        InstanceTraits traits(scene_, lights_of_objects, first_ranges, baked.lights.size());
        const InstanceGathering settings = {memory->gather, options_.stop, [this](double fraction) { report("instances", fraction / 2); }};
        const auto world = gather_instances(scene_, bounds_of_objects, settings, traits, gathered.issues);
        if (!world) return world.status();
        traits.finish(baked);
        if (world->instances.empty()) {
            const Box& bounds = gathered.bounds;
            set_probabilities(baked.lights, bounds.empty() ? radius_of_nothing : radius_of(bounds.lower, bounds.upper));
            return {};
        }
        const Weigher weigher(*world, Weigher::Sharing::by_index);
        const WorldParts parts = WorldCut(*world, weigher).run(options_.block_bytes, memory->cut);
        BlockBuilding settings_of_blocks = building(*memory);
        settings_of_blocks.max_entries = 1;
        BlockBuilder builder(settings_of_blocks, sink, baked);
        RAYPAGER_TRY(builder.build(*world, weigher, parts, [this](double fraction) { report("instances", (1 + fraction) / 2); }));
        block_entry_boxes.insert(block_entry_boxes.end(), builder.block_entry_boxes().begin(), builder.block_entry_boxes().end());
        baked.instances = world->instances.size();

        // Lights were weighed without them. A backdrop counted only as long as there was nothing else.
        Box bounds = world->bounds;
        if (!std::ranges::all_of(scene_.shapes, &Shape::backdrop)) bounds.grow(gathered.bounds);
        set_bounds(baked, bounds);
        set_probabilities(baked.lights, radius_of(baked.lower, baked.upper));
        return {};
    }

    // What was gathered becomes blocks. buckets: counts those that it took over the disk.
    Status build_shapes(Gathered& gathered, const GatherProgress& progress, BlockSink& sink, BakedScene& baked,
                        std::vector<BlockEntryBox>& block_entry_boxes, uint64_t& buckets) {
        return gathered.spilled ? build_from_disk(gathered, progress, sink, baked, block_entry_boxes, buckets)
                                : build_in_memory(gathered.world, progress, sink, baked, block_entry_boxes);
    }

    Status build_in_memory(const World& world, const GatherProgress& progress, BlockSink& sink, BakedScene& baked,
                           std::vector<BlockEntryBox>& block_entry_boxes) {
        progress("cut", 0);
        const Weigher weigher(world, Weigher::Sharing::by_index);
        WorldCut cut(world, weigher);
        settle_block_size(cut.weight());
        const auto memory = plan_memory();
        if (!memory) return memory.status();
        const WorldParts parts = std::move(cut).run(options_.block_bytes, memory->cut);
        progress("cut", 1);
        BlockBuilder builder(building(*memory), sink, baked);
        RAYPAGER_TRY(builder.build(world, weigher, parts, [&](double fraction) { progress("build", fraction); }));
        block_entry_boxes = builder.block_entry_boxes();
        return {};
    }

    // Splits what is too large until it fits into memory, depth first: the blocks come in the order of the cuts.
    Status build_from_disk(Gathered& gathered, const GatherProgress& progress, BlockSink& sink, BakedScene& baked,
                           std::vector<BlockEntryBox>& block_entry_boxes, uint64_t& buckets) {
        settle_block_size(gathered.weight);
        const auto memory = plan_memory();
        if (!memory) return memory.status();
        const DistributeSettings settings = {*memory, beside_, options_.stop, [&](double fraction) { progress("distribute", fraction); }};
        BlockBuilder builder(building(*memory), sink, baked);
        std::vector<Bucket> stack;
        stack.push_back(std::move(*gathered.spilled));
        const double all = static_cast<double>(gathered.triangles + gathered.spheres);
        uint64_t built = 0;
        while (!stack.empty()) {
            const Bucket bucket = std::move(stack.back());
            stack.pop_back();
            const uint64_t count = bucket.primitives();
            if (bucket.memory_bytes() > memory->bucket && count >= 2) {
                auto split = distribute(bucket, settings);
                if (!split) return split.status();
                for (auto part = split->rbegin(); part != split->rend(); ++part) stack.push_back(std::move(*part));
                continue;
            }
            RAYPAGER_TRY(build_bucket(bucket, gathered.world.first_id, *memory, builder, [&](double fraction) {
                progress("build", (static_cast<double>(built) + fraction * static_cast<double>(count)) / all);
            }));
            built += count;
            buckets++;
        }
        block_entry_boxes = builder.block_entry_boxes();
        return {};
    }

    Status build_bucket(const Bucket& bucket, uint32_t first_id, const BakeMemory& memory, BlockBuilder& builder,
                        const std::function<void(double)>& progress) const {
        auto world = load_bucket(bucket);
        if (!world) return world.status();
        world->first_id = first_id;
        const Weigher weigher(*world, Weigher::Sharing::by_value);
        const WorldParts parts = WorldCut(*world, weigher).run(options_.block_bytes, memory.cut);
        return builder.build(*world, weigher, parts, progress);
    }

    const Scene& scene_;
    BakeOptions options_;
    DefaultLimit limit_;  // where none was given
    const std::filesystem::path& beside_;
};

}  // namespace

uint64_t smallest_bake_limit(uint64_t block_bytes) { return BakeMemory::smallest_limit(block_bytes); }

Result<BakeSummary> bake(const Scene& scene, const BakeOptions& options, const std::filesystem::path& output) {
    std::optional<BlockFileWriter> writer;
    try {
        return Bake(scene, options, output).run([&]() -> Result<BlockSink*> {
            auto created = BlockFileWriter::create(output);
            if (!created) return created.status();
            return &writer.emplace(std::move(*created));
        });
    } catch (const std::bad_alloc&) {
        return Status::failed(fmt::format("{}: not enough memory to bake the scene; give a smaller --host-limit", output.string()));
    }
}

Result<BakedInMemory> bake(const Scene& scene, const BakeOptions& options) {
    std::error_code error;
    const std::filesystem::path scratch = std::filesystem::temp_directory_path(error) / "raypager";
    if (error) return Status::failed("there is no folder for temporary files; set TMPDIR");
    const auto blocks = std::make_shared<MemoryBlocks>();
    try {
        auto summary = Bake(scene, options, scratch).run([&]() -> Result<BlockSink*> { return blocks.get(); });
        if (!summary) return summary.status();
        return BakedInMemory{Blocks(blocks), std::move(*summary)};
    } catch (const std::bad_alloc&) {
        return Status::failed("not enough memory to keep the baked scene; bake it into a file");
    }
}

Result<std::optional<Blocks>> open_baked(const std::filesystem::path& path, const Scene& scene, uint64_t fingerprint) {
    Result<bool> good = false;
    const auto file = BlockFile::open(path, [&](BakedScene& baked) {
        if (baked.fingerprint == fingerprint) good = restyle(scene, baked);
    });
    if (!file) return file.status();
    if (!good) return good.status();
    return *good ? std::optional(Blocks(*file)) : std::nullopt;
}

}  // namespace raypager
