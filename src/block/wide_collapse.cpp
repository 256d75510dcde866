#include "block/wide_collapse.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "base/check.hpp"

namespace raypager {
namespace {

// A step through a wide node, where a leaf costs what its leaf_cost says.
constexpr float wide_node_cost = 1.0f;

constexpr uint32_t max_as_child = RP_WIDE_CHILDREN - 1;  // a side of a wide node leaves one child to the other side

}  // namespace

void Collapse::run(std::span<const BinaryNode> nodes) {
    nodes_ = nodes;
    plans_.resize(nodes.size());
    for (size_t i = nodes.size(); i-- > 0;) plan(static_cast<uint32_t>(i));
}

void Collapse::plan(uint32_t index) {
    const BinaryNode& node = nodes_[index];
    Plan& plan = plans_[index];
    const auto area = static_cast<float>(node.box.half_area());
    plan.cost[0] = area * node.leaf_cost;
    plan.leaf = true;
    plan.inner_share = 0;
    for (uint32_t n = 1; n <= max_as_child; n++) plan.share[n - 1] = 0;
    if (node.is_leaf()) {
        RAYPAGER_CHECK(node.leaf_cost < std::numeric_limits<float>::infinity());
        for (uint32_t n = 2; n <= max_as_child; n++) plan.cost[n - 1] = plan.cost[0];
        return;
    }
    const Plan &left = plans_[node.left], &right = plans_[node.right];
    const auto distribute = [&]<uint32_t n>(std::integral_constant<uint32_t, n>) {
        // The bits of floats that are not negative have their order; so the least cost, and the least share among equals, takes no branch.
        uint64_t least = UINT64_MAX;
        const auto consider = [&](uint32_t l) {
            least = std::min(least, uint64_t{std::bit_cast<uint32_t>(left.cost[l - 1] + right.cost[n - l - 1])} << 8 | l);
        };
        [&]<size_t... i>(std::index_sequence<i...>) { (consider(i + 1), ...); }
        (std::make_index_sequence<n - 1>());
        return std::pair(std::bit_cast<float>(static_cast<uint32_t>(least >> 8)), static_cast<uint8_t>(least));
    };
    const auto [of_children, inner_share] = distribute(std::integral_constant<uint32_t, RP_WIDE_CHILDREN>());
    plan.inner_share = inner_share;
    const float as_node = area * wide_node_cost + of_children;
    // Not "<": areas may be too small or too large for a float.
    if (!(plan.cost[0] <= as_node) || node.leaf_cost == std::numeric_limits<float>::infinity()) {
        plan.cost[0] = as_node;
        plan.leaf = false;
    }
    const auto as_children = [&]<uint32_t n>(std::integral_constant<uint32_t, n> count) {
        const auto [cost, share] = distribute(count);
        const bool better = cost < plan.cost[n - 2];
        plan.cost[n - 1] = better ? cost : plan.cost[n - 2];
        plan.share[n - 1] = better ? share : 0;
    };
    [&]<uint32_t... i>(std::integer_sequence<uint32_t, i...>) { (as_children(std::integral_constant<uint32_t, i + 2>()), ...); }
    (std::make_integer_sequence<uint32_t, max_as_child - 1>());
}

void Collapse::add_children(uint32_t index, uint32_t most, WideChildren& out) const {
    const Plan& plan = plans_[index];
    while (most > 1 && plan.share[most - 1] == 0) most--;
    if (most == 1) return out.add({index, plan.leaf});
    add_children(nodes_[index].left, plan.share[most - 1], out);
    add_children(nodes_[index].right, most - plan.share[most - 1], out);
}

WideChildren Collapse::children(uint32_t index) const {
    WideChildren out;
    const uint32_t share = plans_[index].inner_share;
    add_children(nodes_[index].left, share, out);
    add_children(nodes_[index].right, RP_WIDE_CHILDREN - share, out);
    return out;
}

}  // namespace raypager
