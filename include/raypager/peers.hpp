// Other processes that render the same picture: the ranks of a cluster. The program has them by MPI (src/cluster).
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
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

    // Numbers that all have in common, 0 at first. Adds to one, modulo 2^64, and says what it was before. Waits for nobody. Renders leave the last
    // one to whoever runs them.
    static constexpr uint32_t common_numbers = 8;
    virtual Result<uint64_t> add(uint32_t number, uint64_t value) = 0;

    // What each tells rank 0 of itself, whenever it likes; what it told before is forgotten. Waits for nobody.
    virtual Status tell(std::vector<std::byte> bytes) = 0;
    // On rank 0: what each has told last, by rank; nothing of those that have not told anything.
    virtual std::vector<std::vector<std::byte>> told() const = 0;

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
        // The memory of all that it has, which may outlive it: whoever sends or receives holds on to it.
        virtual std::shared_ptr<const void> memory() const = 0;
        // found: what there is of that number, in that memory. It does not change.
        virtual Answer find(uint64_t number, std::span<const std::byte>& found) = 0;
        // Where bytes go that another rank puts there; empty: nowhere.
        virtual std::span<std::byte> room_for(uint64_t number) = 0;
        // They have come. False: they are not what they should be, and are to be put again.
        virtual bool has_come(uint64_t number) = 0;
        // Nothing can be put there.
        virtual void will_not_come(uint64_t number) = 0;
    };
    // Answers others from this shelf from now on, and from none before it; null: with Answer::none.
    virtual void serve(Shelf* shelf) = 0;
    // From any thread, and many at once, whatever else goes on. bytes: as many as there are of that number. Answer::late after so many seconds, or
    // soon after stop has been set.
    virtual Answer get(uint32_t rank, uint64_t number, std::span<std::byte> bytes, double seconds, const std::atomic<bool>& stop) = 0;
    // The same the other way; no bytes: there will be none. Returns when they have come. Answer::none: they were not taken.
    virtual Answer put(uint32_t rank, uint64_t number, std::vector<std::byte> bytes, const std::atomic<bool>& stop) = 0;
};

}  // namespace raypager
