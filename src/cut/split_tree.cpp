#include "cut/split_tree.hpp"

#include <algorithm>
#include <bit>

#include "base/check.hpp"
#include "cut/binning.hpp"

namespace raypager {
namespace {

// Sets up to this size are sorted and every split is tried.
constexpr size_t sweep_size = 12;

struct SplitHalves {
    size_t left_count = 0;
    Extent left, right;
};

class SplitTreeBuilder {
public:
    SplitTreeBuilder(std::span<PrimitiveRef> refs, int max_depth, uint32_t leaf_size) : refs_(refs), max_depth_(max_depth), leaf_size_(leaf_size) {
        nodes_.reserve(2 * refs.size() / leaf_size);
    }

    // extent: of the refs.
    uint32_t build(uint32_t first, uint32_t count, int depth, const Extent& extent) {
        const auto index = static_cast<uint32_t>(nodes_.size());
        nodes_.push_back({extent.box.box(), first, count});
        if (count <= leaf_size_) return index;
        const SplitHalves halves = split(refs_.subspan(first, count), depth, extent);
        const auto left_count = static_cast<uint32_t>(halves.left_count);
        const uint32_t left = build(first, left_count, depth + 1, halves.left);
        const uint32_t right = build(first + left_count, count - left_count, depth + 1, halves.right);
        nodes_[index].left = left;
        nodes_[index].right = right;
        return index;
    }

    std::vector<SplitNode> take() { return std::move(nodes_); }

private:
    // Halving what is left needs ceil(log2(count)) levels more; where no level is to spare, nothing else is done.
    SplitHalves split(std::span<PrimitiveRef> refs, int depth, const Extent& extent) const {
        const bool must_halve = std::bit_width(refs.size() - 1) >= static_cast<unsigned>(max_depth_ - depth);
        if (must_halve) return measured(refs, split_at_median(refs, extent.centroids));
        return refs.size() <= sweep_size ? measured(refs, split_by_sweep(refs, 1)) : split_by_bins(refs, extent);
    }

    static SplitHalves measured(std::span<const PrimitiveRef> refs, size_t left_count) {
        return {left_count, extent_of(refs.first(left_count)), extent_of(refs.subspan(left_count))};
    }

    static SplitHalves split_by_bins(std::span<PrimitiveRef> refs, const Extent& extent) {
        const int count = refs.size() < 64 ? 8 : refs.size() < 1024 ? 16 : max_bins;
        const BinMapping mapping(extent.centroids, count);
        const BinSet bins(refs, mapping, refs.size());
        const Split split = best_split(bins, 0, false);
        if (split.axis < 0) return measured(refs, split_at_median(refs, extent.centroids));
        SplitHalves halves;
        const float origin = mapping.origin[split.axis], scale = mapping.scale[split.axis], bin = static_cast<float>(split.bin);
        // Each ref is looked at once, and measured on the way.
        const auto middle = std::partition(refs.begin(), refs.end(), [&](const PrimitiveRef& ref) {
            const bool is_left = (ref.centroid(split.axis) - origin) * scale < bin;
            (is_left ? halves.left : halves.right).grow(ref);
            return is_left;
        });
        halves.left_count = static_cast<size_t>(middle - refs.begin());
        return halves;
    }

    std::span<PrimitiveRef> refs_;
    const int max_depth_;
    const uint32_t leaf_size_;
    std::vector<SplitNode> nodes_;
};

}  // namespace

std::vector<SplitNode> build_split_tree(std::span<PrimitiveRef> refs, int max_depth, uint32_t leaf_size) {
    RAYPAGER_CHECK(!refs.empty() && std::bit_width(refs.size() - 1) <= static_cast<unsigned>(max_depth));
    SplitTreeBuilder builder(refs, max_depth, leaf_size);
    builder.build(0, static_cast<uint32_t>(refs.size()), 0, extent_of(refs));
    return builder.take();
}

}  // namespace raypager
