// A set of numbers below a limit, one bit each, gone through in order: in time that grows with those that are in it, and with a 4096th of the limit.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace raypager {

class IndexSet {
public:
    IndexSet() = default;
    explicit IndexSet(size_t limit) : words_((limit + 63) / 64), filled_((words_.size() + 63) / 64) {}

    size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    bool contains(uint32_t i) const { return words_[i / 64] >> i % 64 & 1; }
    void insert(uint32_t i) {
        size_ += contains(i) ? 0 : 1;
        words_[i / 64] |= uint64_t{1} << i % 64;
        filled_[i / 4096] |= uint64_t{1} << i / 64 % 64;
    }
    void erase(uint32_t i) {
        size_ -= contains(i) ? 1 : 0;
        words_[i / 64] &= ~(uint64_t{1} << i % 64);
        if (words_[i / 64] == 0) filled_[i / 4096] &= ~(uint64_t{1} << i / 64 % 64);
    }
    void set(uint32_t i, bool in) { in ? insert(i) : erase(i); }
    void clear() { *this = IndexSet(words_.size() * 64); }
    // From the lowest on. The one that is visited may be erased meanwhile.
    template <class Visit>
    void for_each(const Visit& visit) const {
        for (size_t part = 0; part < filled_.size(); part++)
            for (uint64_t words = filled_[part]; words != 0; words &= words - 1) {
                const size_t word = 64 * part + static_cast<size_t>(std::countr_zero(words));
                for (uint64_t bits = words_[word]; bits != 0; bits &= bits - 1)
                    visit(static_cast<uint32_t>(64 * word + static_cast<size_t>(std::countr_zero(bits))));
            }
    }

private:
    std::vector<uint64_t> words_, filled_;  // filled_: a bit for each word that is not 0
    size_t size_ = 0;
};

}  // namespace raypager
