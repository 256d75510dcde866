#include "blocks/split_tree.hpp"

#include <algorithm>
#include <bit>

#include "base/check.hpp"
#include "blocks/binning.hpp"

namespace raypager {
namespace {

// Sets up to this size are sorted and every split is tried.
constexpr size_t sweep_size = 12;

class Builder {
public:
    Builder(std::span<PrimitiveRef> refs, int max_depth, uint32_t leaf_size) : refs_(refs), max_depth_(max_depth), leaf_size_(leaf_size) {
        nodes_.reserve(2 * refs.size() / leaf_size);
    }

    uint32_t build(uint32_t first, uint32_t count, int depth) {
        const auto index = static_cast<uint32_t>(nodes_.size());
        const auto refs = refs_.subspan(first, count);
        nodes_.push_back({bounds(refs), first, count});
        if (count <= leaf_size_) return index;
        const auto left_count = static_cast<uint32_t>(split(refs, depth));
        const uint32_t left = build(first, left_count, depth + 1);
        const uint32_t right = build(first + left_count, count - left_count, depth + 1);
        nodes_[index].left = left;
        nodes_[index].right = right;
        return index;
    }

    std::vector<SplitNode> take() { return std::move(nodes_); }

private:
    static Box bounds(std::span<const PrimitiveRef> refs) {
        Box box;
        for (const PrimitiveRef& ref : refs) box.grow(ref.box);
        return box;
    }

    // Halving what is left needs ceil(log2(count)) levels more; where no level is to spare, nothing else is done.
    size_t split(std::span<PrimitiveRef> refs, int depth) const {
        const bool must_halve = std::bit_width(refs.size() - 1) >= static_cast<unsigned>(max_depth_ - depth);
        if (must_halve) return split_at_median(refs, centroid_bounds(refs));
        return refs.size() <= sweep_size ? split_by_sweep(refs, 1) : split_by_bins(refs);
    }

    static size_t split_by_bins(std::span<PrimitiveRef> refs) {
        const Box centroids = centroid_bounds(refs);
        const int count = refs.size() < 64 ? 8 : refs.size() < 1024 ? 16 : most_bins;
        const BinMapping mapping(centroids, count);
        BinSet bins;
        bins.add(refs, mapping);
        const Split split = best_split(bins, count, 0, false);
        if (split.axis < 0) return split_at_median(refs, centroids);
        const auto middle =
            std::partition(refs.begin(), refs.end(), [&](const PrimitiveRef& ref) { return mapping.bin(ref, split.axis) < split.bin; });
        return static_cast<size_t>(middle - refs.begin());
    }

    std::span<PrimitiveRef> refs_;
    const int max_depth_;
    const uint32_t leaf_size_;
    std::vector<SplitNode> nodes_;
};

}  // namespace

std::vector<SplitNode> build_split_tree(std::span<PrimitiveRef> refs, int max_depth, uint32_t leaf_size) {
    RAYPAGER_CHECK(!refs.empty() && std::bit_width(refs.size() - 1) <= static_cast<unsigned>(max_depth));
    Builder builder(refs, max_depth, leaf_size);
    builder.build(0, static_cast<uint32_t>(refs.size()), 0);
    return builder.take();
}

}  // namespace raypager
