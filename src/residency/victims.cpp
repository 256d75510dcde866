#include "residency/victims.hpp"

#include <algorithm>
#include <iterator>

namespace raypager {

Victims::Victims(const PolicySettings& settings, const PolicyInput& input) : settings_(settings), input_(input) {
    if (settings.kind != PolicyKind::sweep && !input.active.resting.empty()) front_.push_back(0);
}

const BlockState* Victims::next(size_t behind) {
    while (order_.size() <= taken_ + behind)
        if (!find_resting() && !find_other()) return nullptr;
    return &input_.blocks[order_[taken_ + behind]];
}

void Victims::take(size_t count, std::vector<uint32_t>& evict) {
    const auto first = order_.begin() + static_cast<std::ptrdiff_t>(taken_);
    evict.insert(evict.end(), first, first + static_cast<std::ptrdiff_t>(count));
    taken_ += count;
}

// Goes through the heap in order without changing it.
bool Victims::find_resting() {
    const std::vector<ActiveBlocks::Rest>& heap = input_.active.resting;
    const auto later = [&](size_t a, size_t b) { return heap[a] > heap[b]; };
    while (!front_.empty()) {
        std::pop_heap(front_.begin(), front_.end(), later);
        const size_t at = front_.back();
        front_.pop_back();
        for (size_t child = 2 * at + 1; child < std::min(2 * at + 3, heap.size()); child++) {
            front_.push_back(child);
            std::push_heap(front_.begin(), front_.end(), later);
        }
        const uint32_t block = ActiveBlocks::block_of(heap[at]);
        const BlockState& state = input_.blocks[block];
        if (!ActiveBlocks::rests(state, heap[at]) || !is_idle(settings_.kind, state) || !may_go(block)) continue;
        if (!order_.empty() && order_.back() == block) continue;  // twice in the heap
        order_.push_back(block);
        return true;
    }
    return false;
}

bool Victims::find_other() {
    if (!others_listed_) list_others();
    if (others_.empty()) return false;
    std::pop_heap(others_.begin(), others_.end());
    order_.push_back(others_.back().block());
    others_.pop_back();
    return true;
}

void Victims::list_others() {
    const bool all = settings_.kind == PolicyKind::sweep;
    input_.active.resident.for_each([&](uint32_t block) {
        if (may_go(block) && (all || !is_idle(settings_.kind, input_.blocks[block]))) others_.push_back(candidate(block));
    });
    std::make_heap(others_.begin(), others_.end());
    others_listed_ = true;
}

bool Victims::Candidate::operator<(const Candidate& other) const {
    return need != other.need ? need > other.need : std::lexicographical_compare(other.then, std::end(other.then), then, std::end(then));
}

Victims::Candidate Victims::candidate(uint32_t i) const {
    const BlockState& block = input_.blocks[i];
    if (settings_.kind == PolicyKind::sweep) return {double(turns_away(input_, i)), {0, 0, i}};  // what comes next in turn was loaded first
    return {counts_entries(settings_.kind) ? block.traffic : 0, {block.bounces, block.last_used, i}};
}

}  // namespace raypager
