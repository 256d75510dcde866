#include "store/sharded_blocks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <limits>
#include <new>

#include "base/hash.hpp"
#include "base/words.hpp"
#include "store/shards.hpp"

namespace raypager {
namespace {

// Who can read the file does not wait longer for a peer, and asks one that was late no more for some time.
constexpr double patience = 2, late_for = 10;  // seconds
// Who cannot read it waits as long as it takes, and says for whom.
constexpr double long_wait = 10;  // seconds
constexpr int max_tries = 3;
constexpr auto between_questions = std::chrono::milliseconds(5);
constexpr uint32_t fill_threads = 4;

double steady_seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

struct Offer {
    uint64_t room, has_bytes;
};

Result<std::vector<Offer>> exchange(Peers& peers, const Offer& own) {
    const auto all = peers.gather(std::as_bytes(std::span(&own, 1)));
    if (!all) return all.status();
    std::vector<std::byte> bytes;
    for (const std::vector<std::byte>& offer : *all) bytes.insert(bytes.end(), offer.begin(), offer.end());
    RAYPAGER_TRY(peers.broadcast(bytes));
    std::vector<Offer> offers(peers.count());
    if (bytes.size() != offers.size() * sizeof(Offer)) return Status::failed("the processes of this render are of different programs");
    std::memcpy(offers.data(), bytes.data(), bytes.size());
    return offers;
}

}  // namespace

Result<std::unique_ptr<ShardedBlocks>> ShardedBlocks::create(const BlockSource& own, Peers& peers, uint64_t room, Warn warn) {
    std::unique_ptr<ShardedBlocks> blocks(new ShardedBlocks(own, peers, std::move(warn)));
    RAYPAGER_TRY(blocks->divide(room));
    RAYPAGER_TRY(blocks->take_memory());
    peers.serve(blocks.get());
    RAYPAGER_TRY(blocks->begin_together());
    for (uint32_t i = 0; i < fill_threads; i++) blocks->threads_.emplace_back([raw = blocks.get()] { raw->fill(); });
    return blocks;
}

ShardedBlocks::~ShardedBlocks() {
    stop_ = true;
    for (std::thread& thread : threads_) thread.join();
    peers_.serve(nullptr);
}

// Nobody asks before all answer.
Status ShardedBlocks::begin_together() {
    RAYPAGER_TRY(peers_.gather({}).status());
    std::vector<std::byte> nothing;
    return peers_.broadcast(nothing);
}

Status ShardedBlocks::divide(uint64_t room) {
    const auto offers = exchange(peers_, {room, own_.has_bytes()});
    if (!offers) return offers.status();
    std::vector<uint32_t> sizes;
    std::vector<uint64_t> rooms;
    uint64_t all_room = 0;
    for (uint32_t i = 0; i < scene().pageable_count(); i++) sizes.push_back(scene().pageable_bytes(i, BlockForm::stored));
    for (const Offer& offer : *offers) {
        rooms.push_back(offer.room);
        all_room += offer.room;
    }
    owners_ = choose_owners(sizes, rooms);
    slow_until_.resize(rooms.size());
    std::vector<uint32_t> readers;
    for (uint32_t rank = 0; rank < offers->size(); rank++)
        if ((*offers)[rank].has_bytes) readers.push_back(rank);
    const bool all_kept = std::find(owners_.begin(), owners_.end(), no_owner) == owners_.end();
    if (readers.empty() || (readers.size() < offers->size() && !all_kept)) {
        const auto without = std::find_if(offers->begin(), offers->end(), [](const Offer& offer) { return !offer.has_bytes; });
        return Status::failed(fmt::format(
            "rank {} does not reach {}, and the ranks have room for {} of its {}; give a larger --host-limit, or the file to all",
            without - offers->begin(), origin().file.string(), format_bytes(all_room), format_bytes(scene().memory_bytes(BlockForm::stored))));
    }
    // Blocks of who cannot read are read by the others in turn.
    size_t kept = 0, turn = 0;
    for (const uint32_t owner : owners_) kept += owner == peers_.rank();
    kept_ = std::vector<Kept>(kept);
    kept = 0;
    for (uint32_t pageable = 0; pageable < owners_.size(); pageable++) {
        const uint32_t owner = owners_[pageable];
        const bool reads_itself = owner == no_owner || (*offers)[owner].has_bytes;
        const uint32_t reader = reads_itself ? owner : readers[turn++ % readers.size()];
        if (owner == peers_.rank()) {
            kept_[kept].pageable = pageable;
            kept_[kept].reader = reader;
            kept_[kept].at = kept_bytes_;
            kept_[kept].bytes = sizes[pageable];
            kept_bytes_ += sizes[pageable];
            kept++;
        }
        if (!reads_itself && reader == peers_.rank()) errands_.push_back({pageable, owner});
    }
    return {};
}

Status ShardedBlocks::take_memory() {
    memory_.reset(new (std::nothrow) std::byte[std::max<uint64_t>(kept_bytes_, 1)]);
    if (!memory_)
        return Status::failed(fmt::format("not enough host memory for {} of blocks; give a smaller --host-limit", format_bytes(kept_bytes_)));
    return {};
}

// Who cannot read waits for what others bring, so that comes by turns with what is kept here, which the file has, too.
void ShardedBlocks::fill() {
    const size_t own = own_.has_bytes() ? kept_.size() : 0;
    for (bool any = true; any && !stop_;) {
        const size_t errand = next_errand_++, kept = next_kept_++;
        any = errand < errands_.size() || kept < own;
        if (errand < errands_.size()) run_errand(errands_[errand]);
        if (kept < own && !stop_) read_kept(kept_[kept]);
    }
}

// What cannot be read is no error yet: nobody may need it.
void ShardedBlocks::read_kept(Kept& kept) {
    try {
        kept.state = own_.read(kept.pageable, bytes_of(kept)) ? State::here : State::failed;
    } catch (const std::bad_alloc&) {  // of its message
        kept.state = State::failed;
    }
}

// Where a block cannot be read, its owner is told by none of its bytes.
void ShardedBlocks::run_errand(const Errand& errand) {
    for (int tries = 0; tries < max_tries && !stop_; tries++) {
        Status status;
        std::vector<std::byte> bytes;
        try {
            bytes.resize(scene().pageable_bytes(errand.pageable, BlockForm::stored));
            status = own_.read(errand.pageable, bytes);
        } catch (const std::bad_alloc&) {
            status = Status::failed("not enough host memory to read a block; give a smaller --host-limit");
        }
        if (!status) {
            warn_once(peers_.rank(), Fault::unread, status.message());
            bytes.clear();
        }
        if (peers_.put(errand.rank, errand.pageable, std::move(bytes), stop_) == Peers::Answer::bytes || !status) return;
    }
    (void)peers_.put(errand.rank, errand.pageable, {}, stop_);
}

ShardedBlocks::Kept* ShardedBlocks::find_kept(uint64_t pageable) const {
    const auto kept = std::lower_bound(kept_.begin(), kept_.end(), pageable, [](const Kept& of, uint64_t number) { return of.pageable < number; });
    return kept != kept_.end() && kept->pageable == pageable ? &*kept : nullptr;
}

Peers::Answer ShardedBlocks::find(uint64_t number, std::span<const std::byte>& found) {
    const Kept* const kept = find_kept(number);
    if (!kept) return Peers::Answer::none;
    const State state = kept->state;
    if (state == State::here) found = bytes_of(*kept);
    return state == State::here ? Peers::Answer::bytes : state == State::awaited ? Peers::Answer::not_yet : Peers::Answer::none;
}

std::span<std::byte> ShardedBlocks::room_for(uint64_t number) {
    Kept* const kept = find_kept(number);
    return kept && kept->state == State::awaited ? bytes_of(*kept) : std::span<std::byte>();
}

bool ShardedBlocks::has_come(uint64_t number) {
    Kept& kept = *find_kept(number);
    last_came_ = steady_seconds();
    if (!is_right(kept.pageable, bytes_of(kept))) return false;
    kept.state = State::here;
    return true;
}

void ShardedBlocks::will_not_come(uint64_t number) {
    Kept* const kept = find_kept(number);
    if (kept && kept->state == State::awaited) kept->state = State::failed;
}

bool ShardedBlocks::is_right(uint32_t pageable, std::span<const std::byte> stored) const { return hash64(stored) == checksum_of(pageable); }

void ShardedBlocks::warn_once(uint32_t rank, Fault fault, const std::string& text) const {
    {
        const std::lock_guard lock(mutex_);
        if (!warned_.insert({rank, fault}).second) return;
    }
    warn_(text);
}

// begin: by the steady clock. what: the rank has to do with it. A large store takes a while to be handed out: as long as anything comes, all is well.
void ShardedBlocks::warn_if_long(double begin, uint32_t rank, const std::string& what) const {
    if (steady_seconds() - std::max(begin, last_came_.load()) < long_wait) return;
    warn_once(rank, Fault::awaited, fmt::format("rank {} has waited for {} s for {}; it goes on waiting", peers_.rank(), long_wait, what));
}

bool ShardedBlocks::take_kept(uint32_t pageable, std::span<std::byte> stored) const {
    const Kept* const kept = find_kept(pageable);
    if (!kept || kept->state != State::here) return false;
    std::ranges::copy(bytes_of(*kept), stored.begin());
    if (is_right(pageable, stored)) return true;
    damaged_++;
    warn_once(peers_.rank(), Fault::changed,
              fmt::format("rank {}: {} has changed in memory; the machine's memory may be faulty", peers_.rank(), scene().pageable_name(pageable)));
    return false;
}

// False: the file is to be asked.
Result<bool> ShardedBlocks::take_from_owner(uint32_t pageable, std::span<std::byte> stored) const {
    const uint32_t owner = owners_[pageable];
    const bool can_read = own_.has_bytes();
    const double begin = steady_seconds();
    int tries = 0;
    for (; !stop_; std::this_thread::sleep_for(between_questions)) {
        {
            const std::lock_guard lock(mutex_);
            if (can_read && slow_until_[owner] > steady_seconds()) return false;
        }
        const Peers::Answer answer = peers_.get(owner, pageable, stored, can_read ? patience : std::numeric_limits<double>::infinity(), stop_);
        if (answer == Peers::Answer::bytes) last_came_ = steady_seconds();
        if (answer == Peers::Answer::bytes && is_right(pageable, stored)) return true;
        if (answer == Peers::Answer::bytes) {
            damaged_++;
            warn_once(owner, Fault::damaged,
                      fmt::format("{} came damaged from rank {}; its memory or the network may be faulty", scene().pageable_name(pageable), owner));
        } else if (answer == Peers::Answer::late && !stop_) {
            late_++;
            warn_once(owner, Fault::late,
                      fmt::format("rank {} has not answered for {} s; blocks that it keeps are read from the file", owner, patience));
            const std::lock_guard lock(mutex_);
            slow_until_[owner] = steady_seconds() + late_for;
        }
        if (can_read) return false;
        if (answer == Peers::Answer::none || (answer == Peers::Answer::bytes && ++tries == max_tries)) return cannot_be_had(pageable, answer);
        warn_if_long(begin, owner, fmt::format("{}, which rank {} keeps", scene().pageable_name(pageable), owner));
    }
    return Status::failed("the render has ended");
}

Status ShardedBlocks::cannot_be_had(uint32_t pageable, Peers::Answer answer) const {
    const uint32_t owner = owners_[pageable];
    const std::string what = answer == Peers::Answer::none ? "could not get it, or has ended" : "has a damaged one";
    return Status::failed(fmt::format("{}: {} is not there for rank {}, and rank {}, which keeps {}, {}; give the file to all",
                                      origin().file.string(), origin().file.filename().string(), peers_.rank(), owner,
                                      scene().pageable_name(pageable), what));
}

Status ShardedBlocks::fetch(uint32_t pageable, std::span<std::byte> stored) const {
    const uint32_t owner = owners_[pageable];
    if (owner == peers_.rank()) {
        // Another process may have to bring it first.
        const double begin = steady_seconds();
        const Kept& kept = *find_kept(pageable);
        for (; !own_.has_bytes() && kept.state == State::awaited && !stop_; std::this_thread::sleep_for(between_questions))
            warn_if_long(begin, kept.reader, fmt::format("{}, which rank {} is to bring", scene().pageable_name(pageable), kept.reader));
        if (take_kept(pageable, stored)) {
            from_memory_ += stored.size();
            return {};
        }
    } else if (owner != no_owner) {
        const auto taken = take_from_owner(pageable, stored);
        if (!taken) return taken.status();
        if (*taken) {
            from_peers_ += stored.size();
            return {};
        }
    }
    from_file_ += stored.size();
    return own_.read(pageable, stored);
}

Status ShardedBlocks::damaged(uint32_t pageable, const std::string& what) const {
    return Status::failed(
        fmt::format("{}: {}: {}; the file is damaged, bake the scene again", origin().file.string(), scene().pageable_name(pageable), what));
}

bool ShardedBlocks::is_full() const {
    return std::none_of(kept_.begin(), kept_.end(), [](const Kept& kept) { return kept.state == State::awaited; });
}

ShardedBlocks::Figures ShardedBlocks::figures() const { return {kept_bytes_, from_memory_, from_peers_, from_file_, late_, damaged_}; }

}  // namespace raypager
