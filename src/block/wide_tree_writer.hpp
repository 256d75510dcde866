// Lays out a wide tree as abi/wide.h says.
#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "base/check.hpp"
#include "block/wide_collapse.hpp"
#include "block/wide_node.hpp"
#include "raypager/abi/block.h"
#include "raypager/abi/wide.h"

namespace raypager {

// Stands for bytes of which only the number is wanted.
class ByteCount {
public:
    size_t size() const { return size_; }
    void resize(size_t size) { size_ = size; }

private:
    size_t size_ = 0;
};

// Bytes: std::vector<std::byte>, or ByteCount for where the parts would lie.
// append_leaf(const BinaryNode&, Bytes&) appends a leaf record, a multiple of RP_WIDE_UNIT bytes.
template <class Bytes, class AppendLeaf>
class WideTreeWriter {
public:
    // Writes over what is in `bytes`. The other arguments outlive the writer.
    WideTreeWriter(std::span<const BinaryNode> nodes, const Collapse& collapse, Bytes& bytes, AppendLeaf append_leaf)
        : nodes_(nodes), collapse_(collapse), bytes_(bytes), append_leaf_(append_leaf) {
        bytes_.resize(0);
        bytes_.resize(up_to(sizeof(rp_wide_header), RP_WIDE_UNIT));
    }

    // Returns the root's word.
    rp_u32 add_root(uint32_t node) {
        const bool leaf = collapse_.is_leaf(node);
        const size_t at = bytes_.size();
        if (leaf) {
            append_leaf_(nodes_[node], bytes_);
        } else {
            bytes_.resize(at + sizeof(rp_wide_node));
            write_node(node, at);
        }
        return static_cast<rp_u32>(at / RP_WIDE_UNIT) << 1 | (leaf ? 1u : 0u);
    }

    void finish(uint32_t block, rp_u32 root) {
        bytes_.resize(up_to(bytes_.size() + RP_WIDE_GUARD, RP_BLOCK_ALIGNMENT));
        if constexpr (writes) {
            const rp_wide_header header = {RP_WIDE_MAGIC, static_cast<rp_u32>(bytes_.size()), block, root};
            std::memcpy(bytes_.data(), &header, sizeof header);
        }
    }

private:
    static constexpr bool writes = !std::is_same_v<Bytes, ByteCount>;
    static size_t up_to(size_t value, size_t unit) { return (value + unit - 1) / unit * unit; }

    // Its children follow each other at the end of what is there; then come theirs.
    void write_node(uint32_t index, size_t at) {
        const WideChildren children = collapse_.children(index);
        Box boxes[RP_WIDE_CHILDREN];
        size_t places[RP_WIDE_CHILDREN + 1] = {bytes_.size()};
        rp_wide_node node = {};
        node.children = static_cast<rp_u32>((bytes_.size() - at) / RP_WIDE_UNIT);
        uint32_t k = 0;
        for (const WideChild& child : children) {
            if (child.leaf) {
                append_leaf_(nodes_[child.node], bytes_);
                node.leaves |= static_cast<rp_u8>(1u << k);
            } else {
                bytes_.resize(bytes_.size() + sizeof(rp_wide_node));
            }
            boxes[k] = nodes_[child.node].box;
            node.size[k] = static_cast<rp_u8>((bytes_.size() - places[k]) / RP_WIDE_UNIT);
            places[++k] = bytes_.size();
        }
        RAYPAGER_CHECK(places[k] - places[0] <= 255 * RP_WIDE_UNIT);
        if constexpr (writes) {
            quantise(std::span(boxes, k), node);
            std::memcpy(bytes_.data() + at, &node, sizeof node);
        }
        k = 0;
        for (const WideChild& child : children) {
            if (!child.leaf) write_node(child.node, places[k]);
            k++;
        }
    }

    std::span<const BinaryNode> nodes_;
    const Collapse& collapse_;
    Bytes& bytes_;
    AppendLeaf append_leaf_;
};

static_assert(sizeof(rp_wide_node) == 80 && sizeof(rp_wide_leaf) == 8 && sizeof(rp_wide_header) == 16);

}  // namespace raypager
