#include "residency/block_state.hpp"

#include <algorithm>
#include <functional>

namespace raypager {

ActiveBlocks::ActiveBlocks(std::span<const BlockState> blocks) : wanted(blocks.size()), resident(blocks.size()) {
    for (uint32_t i = 0; i < blocks.size(); i++) {
        if (blocks[i].requests > 0) wanted.insert(i);
        loading += blocks[i].state == PageState::loading ? 1 : 0;
        if (blocks[i].state != PageState::resident) continue;
        resident.insert(i);
        add_resting(i, blocks[i].last_used);
    }
}

void ActiveBlocks::add_resting(uint32_t block, uint32_t used) {
    resting.push_back(rest_of(block, used));
    std::push_heap(resting.begin(), resting.end(), std::greater<>());
}

void ActiveBlocks::tidy(std::span<const BlockState> blocks) {
    const auto has_left = [&](Rest rest) { return !rests(blocks[block_of(rest)], rest); };
    while (!resting.empty() && has_left(resting.front())) {
        std::pop_heap(resting.begin(), resting.end(), std::greater<>());
        resting.pop_back();
    }
    if (resting.size() <= 2 * resident.size() + 64) return;
    std::erase_if(resting, has_left);
    std::sort(resting.begin(), resting.end());
    resting.erase(std::unique(resting.begin(), resting.end()), resting.end());
}

}  // namespace raypager
