#include "raypager/bake.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <memory>
#include <new>
#include <optional>

#include "bake/bake_images.hpp"
#include "bake/build_blocks.hpp"
#include "bake/restyle.hpp"
#include "base/memory.hpp"
#include "base/words.hpp"
#include "block/block_coding.hpp"
#include "cut/distribute.hpp"
#include "cut/top_tree.hpp"
#include "cut/world_cut.hpp"
#include "gather/gather.hpp"
#include "store/block_file.hpp"
#include "store/memory_blocks.hpp"
#include "world/bake_memory.hpp"

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

BakedScene describe(const Scene& scene, Gathered& gathered) {
    BakedScene baked;
    take_settings(scene, baked);
    baked.lights = std::move(gathered.lights);
    baked.ranges = std::move(gathered.ranges);
    baked.spheres = gathered.spheres;
    baked.triangles = gathered.triangles;
    if (const Box& bounds = gathered.bounds; !bounds.empty()) {
        std::copy_n(bounds.lower, 3, baked.lower);
        std::copy_n(bounds.upper, 3, baked.upper);
    }
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
        const auto fingerprint = bake_fingerprint(scene_, options_);
        if (!fingerprint) return fingerprint.status();
        const auto memory = BakeMemory::plan(options_.host_limit, options_.block_bytes ? options_.block_bytes : min_automatic);
        if (!memory) return memory.status();
        auto images = plan_images(scene_, options_);
        if (!images) return images.status();
        const Result<BlockSink*> sink = open();
        if (!sink) return sink.status();

        const GatherLimits limits = {*memory, beside_, options_.stop};
        auto gathered = gather(
            scene_, limits, [this](const char* name, double fraction) { report(name, fraction); }, options_.points, cell());
        if (!gathered) return gathered.status();
        if (options_.position_error > 0 && gathered->triangles == 0 && gathered->issues.degenerate > 0)
            return Status::failed(
                fmt::format("no triangle is left of the scene if vertices move by {}; give a smaller --position-error", options_.position_error));
        BakedScene baked = describe(scene_, *gathered);
        baked.fingerprint = *fingerprint;
        baked.position_cell = cell();
        std::vector<BlockEntryBox> block_entry_boxes;
        RAYPAGER_TRY(gathered->spilled ? build_from_disk(*gathered, **sink, baked, block_entry_boxes, summary.buckets)
                                       : build_in_memory(gathered->world, **sink, baked, block_entry_boxes));
        TopTree top = build_top_tree(block_entry_boxes);
        baked.top_grid = top.grid;
        baked.top_nodes = std::move(top.nodes);
        baked.block_entry_paths = std::move(top.paths);
        // Its memory is for the images now.
        gathered->world = World();
        RAYPAGER_TRY(add_images(std::move(*images), **sink, baked));
        RAYPAGER_TRY((*sink)->finish(baked));

        if (gathered->spilled && limit_.reduced()) {
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
    Result<BakeMemory> settle_block_size(uint64_t scene_bytes) {
        if (options_.block_bytes == 0) options_.block_bytes = automatic_block_bytes(scene_bytes, options_.host_limit);
        return BakeMemory::plan(options_.host_limit, options_.block_bytes);
    }

    Status build_in_memory(const World& world, BlockSink& sink, BakedScene& baked, std::vector<BlockEntryBox>& block_entry_boxes) {
        report("cut", 0);
        const Weigher weigher(world, Weigher::Sharing::by_index);
        WorldCut cut(world, weigher);
        const auto memory = settle_block_size(cut.weight());
        if (!memory) return memory.status();
        const WorldParts parts = std::move(cut).run(options_.block_bytes, memory->cut);
        report("cut", 1);
        BlockBuilder builder(building(*memory), sink, baked);
        RAYPAGER_TRY(builder.build(world, weigher, parts, [this](double fraction) { report("build", fraction); }));
        block_entry_boxes = builder.block_entry_boxes();
        return {};
    }

    // Splits what is too large until it fits into memory, depth first: the blocks come in the order of the cuts.
    Status build_from_disk(Gathered& gathered, BlockSink& sink, BakedScene& baked, std::vector<BlockEntryBox>& block_entry_boxes, uint64_t& buckets) {
        const auto memory = settle_block_size(gathered.weight);
        if (!memory) return memory.status();
        const DistributeSettings settings = {*memory, beside_, options_.stop, [this](double fraction) { report("distribute", fraction); }};
        BlockBuilder builder(building(*memory), sink, baked);
        std::vector<Bucket> stack;
        stack.push_back(std::move(*gathered.spilled));
        const double all = static_cast<double>(baked.triangles + baked.spheres);
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
            RAYPAGER_TRY(build_bucket(bucket, *memory, builder, [&](double fraction) {
                report("build", (static_cast<double>(built) + fraction * static_cast<double>(count)) / all);
            }));
            built += count;
            buckets++;
        }
        block_entry_boxes = builder.block_entry_boxes();
        return {};
    }

    Status build_bucket(const Bucket& bucket, const BakeMemory& memory, BlockBuilder& builder, const std::function<void(double)>& progress) const {
        const auto world = load_bucket(bucket);
        if (!world) return world.status();
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
