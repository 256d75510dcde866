// Other processes that render the same picture: the ranks of a cluster. The program has them by MPI (src/cluster).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "raypager/status.hpp"

namespace raypager {

// Used by one thread of a process at a time, but for get() and put(). A rank that ends without the others ends them, too.
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

    enum class Answer : uint8_t {
        bytes,    // are there
        not_yet,  // will be there
        none,     // will never be, or are no more
        late,     // did not come in time
    };
    // What a rank keeps in its memory for others, by numbers that all know. Its functions are called from a thread of the peers' and are to be quick.
    class Shelf {
    public:
        virtual ~Shelf() = default;
        // found: what there is of that number, which stays as it is until the shelf is served no more.
        virtual Answer find(uint64_t number, std::span<const std::byte>& found) = 0;
        // Where bytes go that another rank puts there; empty: nowhere.
        virtual std::span<std::byte> room_for(uint64_t number) = 0;
        // That they have come, or, not whole, that others than there is room for have been put.
        virtual void has_come(uint64_t number, bool whole) = 0;
    };
    // Answers others from this shelf from now on; null: with Answer::none. Returns when nothing of the shelf before is read any more.
    virtual void serve(Shelf* shelf) = 0;
    // From any thread, and many at once, whatever else goes on. bytes: as many as there are of that number. Waits at most so many seconds.
    virtual Answer get(uint32_t rank, uint64_t number, std::span<std::byte> bytes, double seconds) = 0;
    // The same the other way; returns when they have come. False: there is no such room.
    virtual bool put(uint32_t rank, uint64_t number, std::span<const std::byte> bytes) = 0;
};

}  // namespace raypager
