#include "blocks/bake.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstring>
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

// Builds blocks in parallel and appends them in order.
class BlockStage {
public:
    BlockStage(const World& world, std::span<PrimitiveRef> refs, const BakeOptions& options, BlockFileWriter& writer, BakedScene& baked)
        : world_(world), refs_(refs), options_(options), writer_(writer), baked_(baked) {}

    Status run(const std::vector<Part>& parts, const std::function<void(double)>& progress) {
        for (size_t first = 0; first < parts.size();) {
            const size_t end = end_of_batch(parts, first);
            std::vector<std::vector<PackedBlock>> built(end - first);
            parallel_for(end - first, 1, [&](size_t from, size_t to) {
                for (size_t i = from; i < to; i++)
                    build(refs_.subspan(parts[first + i].begin, parts[first + i].end - parts[first + i].begin), built[i]);
            });
            for (auto& blocks : built)
                for (PackedBlock& block : blocks) RAYPAGER_TRY(append(block));
            first = end;
            progress(static_cast<double>(parts[end - 1].end) / static_cast<double>(refs_.size()));
        }
        return {};
    }

    const std::vector<Box>& portal_boxes() const { return portal_boxes_; }

private:
    // So many parts that all threads are busy, and no more: what is built waits in memory.
    static size_t end_of_batch(const std::vector<Part>& parts, size_t first) {
        const size_t enough = worker_count() << 19;
        size_t end = first, primitives = 0;
        while (end < parts.size() && (end - first < 4 * worker_count() || primitives < enough))
            primitives += parts[end].end - parts[end].begin, end++;
        return end;
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
};

Status check_options(const BakeOptions& options) {
    if (options.block_bytes < least_block_bytes || options.block_bytes > RP_MAX_BLOCK_BYTES)
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

Result<BakeSummary> run(const Scene& scene, const BakeOptions& options, const std::filesystem::path& output) {
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

    auto gathered = gather(scene, stage("load"));
    if (!gathered) return gathered.status();
    BakedScene baked = describe(scene, *gathered);
    baked.fingerprint = *fingerprint;

    stage("cut")(0);
    std::vector<PrimitiveRef> refs = make_refs(gathered->world);
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
