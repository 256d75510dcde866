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
#include "bake/bake_objects.hpp"
#include "bake/build_world.hpp"
#include "bake/instance_traits.hpp"
#include "bake/nesting.hpp"
#include "bake/restyle.hpp"
#include "bake/scene_size.hpp"
#include "base/memory.hpp"
#include "base/words.hpp"
#include "block/block_coding.hpp"
#include "cut/top_tree.hpp"
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
        auto nesting = plan_nesting(scene_, RP_INSTANCE_MAX_LEVELS, options_.flatten_limit);
        if (!nesting) return nesting.status();
        nesting_ = std::move(*nesting);
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

    BlockBuilding blocks(const BakeMemory& memory) const { return {options_.block_bytes, options_.block_entries, memory.builders, options_.stop}; }

    // Chooses the size of blocks where that is left to us, and with it how many are made at a time.
    void settle_block_size(uint64_t scene_bytes) {
        if (options_.block_bytes == 0) options_.block_bytes = automatic_block_bytes(scene_bytes, options_.host_limit);
    }

    // For those of the scene, and for those of objects. weight: of what is to be built.
    Result<WorldBuilding> building_of_shapes(uint64_t weight) {
        settle_block_size(weight);
        const auto memory = plan_memory();
        if (!memory) return memory.status();
        return WorldBuilding{blocks(*memory), *memory, beside_};
    }

    // For shapes. Where there are objects, the scene's own shapes are gathered before, so that ids of primitives are known, and keep one half of it,
    // in memory or not, while each object has the other.
    Result<BakeMemory> plan_memory() const {
        auto memory = BakeMemory::plan(options_.host_limit, options_.block_bytes ? options_.block_bytes : min_automatic);
        if (!memory || scene_.objects.empty()) return memory;
        for (uint64_t BakeMemory::*part : {&BakeMemory::gather, &BakeMemory::bucket, &BakeMemory::buffers, &BakeMemory::cut}) *memory.*part /= 2;
        memory->bucket_builders = memory->builders;
        memory->chunk_triangles = std::max<size_t>(memory->chunk_triangles / 2, 1);
        return memory;
    }

    // Everything that is made of blocks: objects, the scene's own shapes, instances, and the trees above them.
    Status bake_geometry(Gathered& gathered, BlockSink& sink, BakedScene& baked, BakeSummary& summary) {
        auto objects = add_objects(gathered, sink, baked, summary.buckets);
        if (!objects) return objects.status();
        if (options_.position_error > 0 && baked.triangles == 0 && gathered.issues.degenerate > 0)
            return Status::failed(
                fmt::format("no triangle is left of the scene if vertices move by {}; give a smaller --position-error", options_.position_error));
        const uint64_t of_objects = baked.block_entries.size();
        const GatherProgress progress = [this](const char* stage, double fraction) { report(stage, fraction); };
        auto block_entry_boxes = build_gathered(
            gathered, [this](uint64_t weight) { return building_of_shapes(weight); }, progress, sink, baked, summary.buckets);
        if (!block_entry_boxes) return block_entry_boxes.status();
        // Its memory is for instances now, and then for images.
        gathered.world = World();
        RAYPAGER_TRY(add_instances(gathered, *objects, sink, baked, *block_entry_boxes, summary.buckets));

        const TopTree top = build_top_tree(*block_entry_boxes);
        baked.top_grid = append_tree(top, of_objects, baked);
        baked.top_grid.block_entry_count = static_cast<rp_u32>(baked.block_entries.size());
        for (const ObjectTree& object : *objects) add_object_tree(object, baked);
        baked.block_entry_paths.insert(baked.block_entry_paths.end(), top.paths.begin(), top.paths.end());
        return {};
    }

    static void add_object_tree(const ObjectTree& object, BakedScene& baked) {
        rp_object added = {};
        added.top = append_tree(object.tree, object.first_block_entry, baked);
        added.levels = object.bounds.levels;
        added.first_range = object.first_range;
        if (!object.bounds.box.empty())
            for (size_t a = 0; a < 3; a++) added.base[a] = static_cast<float>(middle_of(object.bounds.box)[a]);
        baked.objects.push_back(added);
        baked.block_entry_paths.insert(baked.block_entry_paths.end(), object.tree.paths.begin(), object.tree.paths.end());
    }

    Result<std::vector<ObjectTree>> add_objects(Gathered& gathered, BlockSink& sink, BakedScene& baked, uint64_t& buckets) {
        if (scene_.objects.empty()) return std::vector<ObjectTree>();
        const auto building = building_of_shapes(0);
        if (!building) return building.status();
        return bake_objects({scene_, nesting_.of_objects, options_.points, *building, [this](double fraction) { report("objects", fraction); }}, sink,
                            baked, gathered.issues, buckets);
    }

    Status add_instances(Gathered& gathered, const std::vector<ObjectTree>& objects, BlockSink& sink, BakedScene& baked,
                         std::vector<BlockEntryBox>& block_entry_boxes, uint64_t& buckets) {
        if (nesting_.of_world.empty()) return {};
        const auto memory = BakeMemory::plan(options_.host_limit, options_.block_bytes);
        if (!memory) return memory.status();
        std::vector<ObjectBounds> bounds_of_objects;
        std::vector<ObjectLights> lights_of_objects;
        std::vector<uint32_t> first_ranges;
        uint32_t levels = 0;  // of what is in objects
        for (const ObjectTree& object : objects) {
            bounds_of_objects.push_back(object.bounds);
            lights_of_objects.push_back(object.lights);
            first_ranges.push_back(object.first_range);
            levels = std::max(levels, object.bounds.levels);
        }
        InstanceTraits traits(scene_, lights_of_objects, first_ranges, baked.lights.size());
        const size_t first_block = baked.blocks.size();
        const auto instances = bake_instances(
            nesting_.of_world, bounds_of_objects, &traits, {blocks(*memory), *memory, beside_},
            [this](double fraction) { report("instances", fraction); }, sink, baked, gathered.issues, buckets);
        if (!instances) return instances.status();
        traits.finish(baked);
        if (instances->levels == 0) {
            const Box& bounds = gathered.bounds;
            set_probabilities(baked.lights, bounds.empty() ? radius_of_nothing : radius_of(bounds.lower, bounds.upper));
            return {};
        }
        // All levels that there are, whether they are placed or not (BakedScene::instance_levels).
        for (BlockRecord& block : std::span(baked.blocks).subspan(first_block)) block.levels = levels + 1;
        block_entry_boxes.insert(block_entry_boxes.end(), instances->block_entry_boxes.begin(), instances->block_entry_boxes.end());

        // Lights were weighed without them. A backdrop counted only as long as there was nothing else.
        Box bounds = instances->bounds;
        if (!std::ranges::all_of(scene_.shapes, &Shape::backdrop)) bounds.grow(gathered.bounds);
        set_bounds(baked, bounds);
        set_probabilities(baked.lights, radius_of(baked.lower, baked.upper));
        return {};
    }

    const Scene& scene_;
    Nesting nesting_;
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
