#include "blocks/bake.hpp"

#include <fmt/format.h>

#include <bit>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <map>
#include <mutex>
#include <new>

#include "base/parallel.hpp"
#include "blocks/bvh.hpp"
#include "blocks/cut.hpp"
#include "blocks/gather.hpp"
#include "blocks/pack.hpp"
#include "blocks/top_tree.hpp"
#include "store/block_file.hpp"

namespace raypager {
namespace {

constexpr uint64_t least_block_bytes = 16 << 10;

// Builds blocks in parallel and appends them in order. What is built but not yet written waits in memory: little, because no thread
// runs far ahead of the part that is to be written next.
class BlockStage {
public:
    BlockStage(const World& world, std::span<PrimitiveRef> refs, const BakeOptions& options, BlockFileWriter& writer, BakedScene& baked)
        : world_(world), refs_(refs), options_(options), writer_(writer), baked_(baked) {}

    Status run(const std::vector<Part>& parts, const std::function<void(double)>& progress) {
        const size_t ahead = 2 * worker_count();
        // Parts are handed out in order, so the one that is to be written next is always at work, and nobody waits forever.
        parallel_for(parts.size(), 1, [&](size_t index, size_t) {
            {
                std::unique_lock lock(mutex_);
                written_.wait(lock, [&] { return index < next_ + ahead || !status_.ok(); });
                if (!status_.ok()) return;
            }
            try {
                std::vector<PackedBlock> blocks;
                build(refs_.subspan(parts[index].begin, parts[index].end - parts[index].begin), blocks);
                std::lock_guard lock(mutex_);
                waiting_[index] = std::move(blocks);
                append_what_is_due(parts, progress);
            } catch (const std::bad_alloc&) {
                // The others wait for this part; they must hear that it will not come.
                std::lock_guard lock(mutex_);
                status_ = Status::failed("not enough memory to build a block; use a machine with more, or a smaller scene");
                written_.notify_all();
            }
        });
        return status_;
    }

    const std::vector<Box>& portal_boxes() const { return portal_boxes_; }

private:
    void append_what_is_due(const std::vector<Part>& parts, const std::function<void(double)>& progress) {
        for (auto due = waiting_.find(next_); status_.ok() && due != waiting_.end(); due = waiting_.find(next_)) {
            for (PackedBlock& block : due->second)
                if (status_.ok()) status_ = append(block);
            waiting_.erase(due);
            progress(static_cast<double>(parts[next_++].end) / static_cast<double>(refs_.size()));
        }
        written_.notify_all();
    }

    // The blocks of one part: more than one where its bytes were underestimated.
    void build(std::span<PrimitiveRef> refs, std::vector<PackedBlock>& blocks) const {
        PackedBlock block;
        if (pack(world_, build_bvh(world_, refs, options_.sub_boxes), options_.block_bytes, block)) {
            blocks.push_back(std::move(block));
            return;
        }
        const size_t middle = cut_in_two(refs);
        build(refs.first(middle), blocks);
        build(refs.subspan(middle), blocks);
    }

    Status append(PackedBlock& block) {
        rp_block_header header;
        std::memcpy(&header, block.bytes.data(), sizeof header);
        header.block_index = static_cast<rp_u32>(baked_.blocks.size());
        std::memcpy(block.bytes.data(), &header, sizeof header);
        BlockRecord record;
        record.memory_bytes = header.bytes;
        record.triangles = block.triangles;
        record.spheres = block.spheres;
        std::copy_n(block.bounds.lower, 3, record.lower);
        std::copy_n(block.bounds.upper, 3, record.upper);
        RAYPAGER_TRY(writer_.append(block.bytes, record));
        baked_.blocks.push_back(record);
        for (const PackedPortal& packed : block.portals) {
            rp_portal portal = {};
            std::copy_n(header.origin, 3, portal.origin);
            std::copy_n(header.cell, 3, portal.cell);
            portal.block = header.block_index;
            portal.root = packed.root;
            baked_.portals.push_back(portal);
            portal_boxes_.push_back(packed.box);
        }
        return {};
    }

    const World& world_;
    std::span<PrimitiveRef> refs_;
    const BakeOptions& options_;
    BlockFileWriter& writer_;
    BakedScene& baked_;
    std::vector<Box> portal_boxes_;

    std::mutex mutex_;  // of what follows, and of everything that append() changes
    std::condition_variable written_;
    std::map<size_t, std::vector<PackedBlock>> waiting_;
    size_t next_ = 0;  // the part that is to be written
    Status status_;
};

// About a thousand blocks a scene page best: smaller ones are chosen more exactly, larger ones cost less a byte to move. Below 128 KiB a
// transfer costs more than its bytes; above 4 MiB nothing is gained.
uint64_t automatic_block_bytes(std::span<const PrimitiveRef> refs) {
    uint64_t bytes = 0;
    for (const PrimitiveRef& ref : refs) bytes += ref.weight;
    return std::clamp(std::bit_ceil(bytes / 1024), uint64_t{128} << 10, uint64_t{4} << 20);
}

Status check_options(const BakeOptions& options) {
    if (options.block_bytes != 0 && (options.block_bytes < least_block_bytes || options.block_bytes > RP_MAX_BLOCK_BYTES))
        return Status::usage(fmt::format("block size {}: must be from {} to {} bytes", options.block_bytes, least_block_bytes, RP_MAX_BLOCK_BYTES));
    if (options.sub_boxes < 1 || options.sub_boxes > RP_MAX_SUB_BOXES)
        return Status::usage(fmt::format("{} sub-boxes a block: must be from 1 to {}", options.sub_boxes, RP_MAX_SUB_BOXES));
    return {};
}

BakedScene describe(const Scene& scene, Gathered& gathered) {
    BakedScene baked;
    baked.camera = scene.camera;
    baked.width = scene.width;
    baked.height = scene.height;
    baked.spp = scene.spp;
    baked.max_depth = scene.max_depth;
    baked.materials = scene.materials;
    baked.lights = std::move(gathered.lights);
    baked.ranges = std::move(gathered.ranges);
    baked.spheres = gathered.world.spheres.size();
    baked.triangles = gathered.world.primitives.size() - baked.spheres;
    if (const Box& bounds = gathered.world.bounds; !bounds.empty()) {
        std::copy_n(bounds.lower, 3, baked.lower);
        std::copy_n(bounds.upper, 3, baked.upper);
    }
    return baked;
}

Result<BakeSummary> run(const Scene& scene, BakeOptions options, const std::filesystem::path& output) {
    const auto start = std::chrono::steady_clock::now();
    const auto stage = [&options](const char* name) {
        return [&options, name](double fraction) {
            if (options.progress) options.progress(name, fraction);
        };
    };
    RAYPAGER_TRY(check_options(options));
    RAYPAGER_TRY(validate(scene));
    const auto fingerprint = bake_fingerprint(scene, options);
    if (!fingerprint) return fingerprint.status();
    auto writer = BlockFileWriter::create(output);
    if (!writer) return writer.status();

    auto gathered = gather(scene, stage("load"), options.points);
    if (!gathered) return gathered.status();
    BakedScene baked = describe(scene, *gathered);
    baked.fingerprint = *fingerprint;

    stage("cut")(0);
    std::vector<PrimitiveRef> refs = make_refs(gathered->world);
    if (options.block_bytes == 0) options.block_bytes = automatic_block_bytes(refs);
    const std::vector<Part> parts = cut(refs, options.block_bytes);
    stage("cut")(1);

    BlockStage blocks(gathered->world, refs, options, *writer, baked);
    RAYPAGER_TRY(blocks.run(parts, stage("build")));
    TopTree top = build_top_tree(blocks.portal_boxes());
    baked.top_grid = top.grid;
    baked.top_nodes = std::move(top.nodes);
    baked.portal_paths = std::move(top.paths);
    RAYPAGER_TRY(writer->finish(baked));

    BakeSummary summary;
    summary.triangles = baked.triangles;
    summary.spheres = baked.spheres;
    summary.blocks = baked.blocks.size();
    summary.stored_bytes = baked.stored_bytes();
    summary.points_culled = gathered->points_culled;
    summary.points_merged = gathered->points_merged;
    summary.issues = gathered->issues;
    summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return summary;
}

}  // namespace

Result<BakeSummary> bake(const Scene& scene, const BakeOptions& options, const std::filesystem::path& output) {
    try {
        return run(scene, options, output);
    } catch (const std::bad_alloc&) {
        return Status::failed(fmt::format("{}: not enough memory to bake the scene; use a machine with more, or a smaller scene", output.string()));
    }
}

}  // namespace raypager
