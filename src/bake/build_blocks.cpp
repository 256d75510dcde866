#include "bake/build_blocks.hpp"

#include <algorithm>
#include <condition_variable>
#include <cstring>
#include <map>
#include <mutex>
#include <new>

#include "base/parallel.hpp"
#include "cut/bvh.hpp"

namespace raypager {

// Builds blocks in parallel and appends them in order. What is built but not yet written waits in memory: little, because no thread
// runs far ahead of the part that is to be written next.
class BlockBuilder::Run {
public:
    Run(BlockBuilder& builder, const World& world, const Weigher& weigher, const WorldParts& world_parts, const std::function<void(double)>& progress)
        : builder_(builder), world_(world), weigher_(weigher), order_(world_parts.order), parts_(world_parts.parts), progress_(progress) {}

    Status run() {
        const size_t ahead = 2 * builder_.settings_.builders;
        // Parts are handed out in order, so the one that is to be written next is always at work, and nobody waits forever.
        parallel_for(
            parts_.size(), 1,
            [&](size_t index, size_t) {
                {
                    std::unique_lock lock(mutex_);
                    written_.wait(lock, [&] { return index < next_ + ahead || !status_.ok(); });
                    if (!status_.ok()) return;
                }
                try {
                    std::vector<PackedBlock> blocks;
                    PrimitiveRefs refs;
                    make_refs(world_, order_.subspan(parts_[index].begin, parts_[index].end - parts_[index].begin), refs);
                    build(refs, blocks);
                    const std::lock_guard lock(mutex_);
                    waiting_[index] = std::move(blocks);
                    append_what_is_due();
                } catch (const std::bad_alloc&) {
                    // The others wait for this part; they must hear that it will not come.
                    const std::lock_guard lock(mutex_);
                    status_ = Status::failed("not enough memory to build a block; give a smaller --host-limit or --block-size");
                    written_.notify_all();
                }
            },
            builder_.settings_.builders);
        return status_;
    }

private:
    void append_what_is_due() {
        for (auto due = waiting_.find(next_); status_.ok() && due != waiting_.end(); due = waiting_.find(next_)) {
            for (PackedBlock& block : due->second)
                if (status_.ok()) status_ = builder_.append(block);
            waiting_.erase(due);
            progress_(static_cast<double>(parts_[next_++].end) / static_cast<double>(order_.size()));
        }
        if (builder_.settings_.stop && *builder_.settings_.stop) status_ = Status::interrupted("stopped by a signal; nothing was written");
        written_.notify_all();
    }

    // The blocks of one part: more than one where its bytes were underestimated.
    void build(std::span<PrimitiveRef> refs, std::vector<PackedBlock>& blocks) const {
        PackedBlock block;
        if (pack(world_, build_bvh(world_, refs, builder_.settings_.max_entries), builder_.settings_.block_bytes, position_cell_, block)) {
            blocks.push_back(std::move(block));
            return;
        }
        weigher_.weigh(refs);
        const size_t middle = cut_in_two(refs);
        build(refs.first(middle), blocks);
        build(refs.subspan(middle), blocks);
    }

    BlockBuilder& builder_;
    const World& world_;
    const Weigher& weigher_;
    const std::span<const uint32_t> order_;
    const std::vector<Part>& parts_;
    const std::function<void(double)>& progress_;
    const float position_cell_ = builder_.baked_.position_cell;

    std::mutex mutex_;  // of what follows, and of everything that append() changes
    std::condition_variable written_;
    std::map<size_t, std::vector<PackedBlock>> waiting_;
    size_t next_ = 0;  // the part that is to be written
    Status status_;
};

Status BlockBuilder::build(const World& world, const Weigher& weigher, const WorldParts& parts, const std::function<void(double)>& progress) {
    return Run(*this, world, weigher, parts, progress).run();
}

Status BlockBuilder::append(PackedBlock& block) {
    rp_block_header header;
    std::memcpy(&header, block.bytes.data(), sizeof header);
    header.block_index = static_cast<rp_u32>(baked_.blocks.size());
    std::memcpy(block.bytes.data(), &header, sizeof header);
    BlockRecord record;
    record.wide_bytes = block.wide_bytes;
    record.triangles = block.triangles;
    record.spheres = block.spheres;
    record.instances = block.instances;
    std::copy_n(block.bounds.lower, 3, record.lower);
    std::copy_n(block.bounds.upper, 3, record.upper);
    RAYPAGER_TRY(sink_.append(block.bytes, record));
    baked_.blocks.push_back(record);
    for (const PackedBlockEntry& packed : block.block_entries) {
        rp_block_entry block_entry = {};
        std::copy_n(header.origin, 3, block_entry.origin);
        std::copy_n(header.cell, 3, block_entry.cell);
        block_entry.block = header.block_index;
        block_entry.root = packed.root;
        baked_.block_entries.push_back(block_entry);
        baked_.wide_roots.push_back(packed.wide_root);
        block_entry_boxes_.push_back({packed.box, packed.depth});
    }
    return {};
}

}  // namespace raypager
