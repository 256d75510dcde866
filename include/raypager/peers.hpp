// Other processes that render the same picture: the ranks of a cluster. The program has them by MPI (src/cluster).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "raypager/status.hpp"

namespace raypager {

// Used by one thread of a process at a time. A rank that ends without the others ends them, too.
class Peers {
public:
    virtual ~Peers() = default;
    virtual uint32_t rank() const = 0;         // from 0
    virtual uint32_t count() const = 0;        // of ranks, this one included
    virtual uint32_t local_count() const = 0;  // of those on this machine

    // Numbers that all have in common, 0 at first. Adds to one, modulo 2^64, and says what it was before. Waits for nobody.
    static constexpr uint32_t common_numbers = 8;
    virtual Result<uint64_t> add(uint32_t number, uint64_t value) = 0;

    // By all together, in the same order everywhere. All get what rank 0 has; bytes gets its size.
    virtual Status broadcast(std::vector<std::byte>& bytes) = 0;
    // Rank 0 gets what each has, by rank; the others get nothing.
    virtual Result<std::vector<std::vector<std::byte>>> gather(std::span<const std::byte> bytes) = 0;
    // Rank 0 gets the sum of the words of all, which are equally many. add: adds the second to the first; any order of sums is right.
    using Add = std::function<void(std::span<uint32_t> to, std::span<const uint32_t> from)>;
    virtual Status sum(std::span<uint32_t> words, const Add& add) = 0;
};

}  // namespace raypager
