// A render that several processes share: they take samples from common numbers, and do together what concerns the whole picture: checkpoints, stages
// of adaptive sampling, and the end. Rank 0 decides when, and has the film of all afterwards.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "base/check.hpp"
#include "base/hash.hpp"
#include "render/job.hpp"
#include "render/params.hpp"
#include "render/plan.hpp"
#include "render/value_bytes.hpp"
#include "store/shards.hpp"

namespace raypager {
namespace {

// Numbers that all ranks have in common (Peers::add).
enum Common : uint32_t { taken, action, idle_ranks, stop_requests };

// The lowest bits of the number that rank 0 raises say what is to be done; the others count.
constexpr uint32_t action_bits = 8;
// Of the number of stop requests: those that are not to wait for paths under way.
constexpr uint64_t at_once_unit = uint64_t{1} << 32;

// Between two times that a rank tells rank 0 how far it is.
constexpr std::chrono::milliseconds between_tellings{100};

}  // namespace

// What rank 0 has settled, the order of samples above all; and whether all render the same.
Status RenderJob::begin_with_peers(rp_render_params& params, const DeviceInfo& device) {
    if (!options_.peers) return {};
    RAYPAGER_TRY(check_several());
    struct Beginning {
        RenderIdentity identity;
        rp_sample_order order;
        std::array<char, 256> device;
        uint64_t next_sample;
        uint32_t spp, keeps_checkpoints, resumed;
    };
    Beginning beginning = {};
    beginning.identity = identity_of(scene_, params);
    beginning.order = params.order;
    const std::string own = device.name + ", " + device.driver;
    own.copy(beginning.device.data(), beginning.device.size() - 1);
    beginning.next_sample = checkpointer_->next_sample();
    beginning.spp = params.spp;
    beginning.keeps_checkpoints = checkpointer_->enabled() ? 1 : 0;
    beginning.resumed = checkpointer_->resumed() ? 1 : 0;
    const RenderIdentity identity = beginning.identity;
    std::vector<std::byte> bytes;
    put_values(bytes, std::vector{beginning});
    RAYPAGER_TRY(options_.peers->broadcast(bytes));
    std::span<const std::byte> rest(bytes);
    beginning = take_values<Beginning>(rest)[0];
    const uint32_t rank = options_.peers->rank();
    const auto hash = [](const RenderIdentity& of) { return hash64(std::as_bytes(std::span(&of, 1))); };
    if (hash(identity) != hash(beginning.identity) || params.spp != beginning.spp)
        return Status::failed(fmt::format("rank {} renders another scene or picture than rank 0, or is another program; give all the same", rank));
    if (own.substr(0, beginning.device.size() - 1) != beginning.device.data() && !options_.allow_different)
        return Status::usage(
            fmt::format("rank {} has {}, rank 0 {}: the last bits of the picture would depend on which of them takes a sample; give all "
                        "the same --device, or --allow-different",
                        rank, own, beginning.device.data()));
    params.order = beginning.order;
    common_begin_ = beginning.next_sample;
    keeps_checkpoints_ = beginning.keeps_checkpoints != 0;
    resumed_ = beginning.resumed != 0;
    return {};
}

// Devices go first, and wait for their loaders, which may wait for ranks that have come to their end before.
RenderJob::~RenderJob() {
    if (sharded_) sharded_->stop();
}

// Every block in the memory of one of them, as far as there is room. What is left of the host limit is each one's own cache.
Status RenderJob::share_blocks(const DeviceInfo& device) {
    if (!options_.peers) return {};
    // Settled before blocks take memory. Devices that use main memory take their share of it.
    const uint64_t limit = host_limit(options_, device, 0, options_.peers->local_count());
    settled_host_limit_ = options_.host_limit == 0 && device.profile.shares_host_memory ? limit / 2 : limit;
    auto blocks = ShardedBlocks::create(source_, *options_.peers, shard_room(settled_host_limit_), [this](const std::string& text) { warn(text); });
    if (!blocks) return blocks.status();
    sharded_ = std::move(*blocks);
    return {};
}

// Each does its share of what a checkpoint has left behind.
Status RenderJob::share_checkpoint() {
    std::vector<std::byte> bytes;
    if (options_.peers->rank() == 0) {
        put_values(bytes, checkpointer_->gaps());
        put_values(bytes, checkpointer_->under_way());
    }
    RAYPAGER_TRY(options_.peers->broadcast(bytes));
    std::span<const std::byte> rest(bytes);
    const uint64_t rank = options_.peers->rank(), ranks = options_.peers->count();
    std::vector<SampleRange> gaps = take_values<SampleRange>(rest);
    for (SampleRange& gap : gaps) gap = {gap.begin + gap.size() * rank / ranks, gap.begin + gap.size() * (rank + 1) / ranks};
    pool_.add(std::move(gaps));
    const std::vector<rp_path_sample> again = take_values<rp_path_sample>(rest);
    const auto at = [&](uint64_t share) { return again.begin() + static_cast<std::ptrdiff_t>(again.size() * share / ranks); };
    pool_.add_again({at(rank), at(rank + 1)});
    return {};
}

uint64_t RenderJob::common_end() const { return sample_limit_ - std::min(sample_limit_, common_begin_); }

// Where it ends before its time, every pixel still needs a sample.
bool RenderJob::takes_no_more() const {
    const uint64_t first_pass = pixels_ - std::min(pixels_, common_begin_);
    return common_taken_ >= (late_ || stop_began_ ? std::min(common_end(), first_pass) : common_end());
}

Status RenderJob::take_from_peers() {
    pool_.expect_more(!takes_no_more());
    if (takes_no_more()) return {};
    const uint64_t end = common_end(), share = next_share(end - common_taken_, end, options_.peers->count());
    if (pool_.left() > share / 2) return {};
    const auto before = options_.peers->add(taken, share);
    if (!before) return before.status();
    common_taken_ = *before + share;
    if (*before < end) pool_.add({{common_begin_ + *before, common_begin_ + std::min(*before + share, end)}});
    return {};
}

// What concerns all is done when rank 0 says so: it raises a number, at which the others look.
Status RenderJob::act_with_peers() {
    RAYPAGER_TRY(take_from_peers());
    const auto now = Clock::now();
    if (now - last_asked_ < std::chrono::milliseconds(20)) return {};
    last_asked_ = now;
    if (now - last_told_ >= between_tellings) RAYPAGER_TRY(tell_progress());
    RAYPAGER_TRY(ask_to_stop());
    RAYPAGER_TRY(say_idle(takes_no_more() && devices_.idle()));
    Peers& peers = *options_.peers;
    const auto word = peers.add(action, 0);
    if (!word) return word.status();
    RAYPAGER_CHECK(*word >> action_bits <= actions_ + 1);  // nobody misses one
    if (peers.rank() > 0) return *word >> action_bits > actions_ ? act(static_cast<PeerAction>(*word & ((1 << action_bits) - 1))) : Status();
    const auto next = next_action();
    if (!next || !*next) return next.status();
    const uint64_t raised = (actions_ + 1) << action_bits | static_cast<uint64_t>(**next);
    RAYPAGER_TRY(peers.add(action, raised - *word).status());
    return act(**next);
}

// Signals may come to one of them alone.
Status RenderJob::ask_to_stop() {
    const auto is_set = [](const std::atomic<bool>* flag) { return flag != nullptr && flag->load(); };
    const bool at_once = cancelled_ || is_set(options_.stop_now), stop = at_once || is_set(options_.stop);
    if (stop && !std::exchange(asked_to_stop_, true)) RAYPAGER_TRY(options_.peers->add(stop_requests, 1).status());
    if (at_once && !std::exchange(asked_to_stop_now_, true)) RAYPAGER_TRY(options_.peers->add(stop_requests, at_once_unit).status());
    return {};
}

Result<std::optional<RenderJob::PeerAction>> RenderJob::next_action() {
    const auto idle = options_.peers->add(idle_ranks, 0), stops = options_.peers->add(stop_requests, 0);
    if (!idle || !stops) return idle ? stops.status() : idle.status();
    const double now = render_seconds();
    const bool stop = *stops > 0, has_had_time = stop_began_ && now - *stop_began_ >= options_.stop_seconds;
    std::optional<PeerAction> next;
    if (stop && (checkpointer_->enabled() || *stops >= at_once_unit || has_had_time))
        next = PeerAction::stop;
    else if (stop && !stop_began_)
        next = PeerAction::stop_soon;
    else if (!late_ && options_.time_seconds > 0 && now >= options_.time_seconds)
        next = PeerAction::late;
    else if (*idle == options_.peers->count())
        next = adaptive_ && !late_ && !stop_began_ ? PeerAction::stage : PeerAction::finish;
    else if (checkpointer_->due())
        next = PeerAction::checkpoint;
    else if (callbacks_.snapshot && options_.snapshot_seconds > 0 && now >= next_snapshot_)
        next = PeerAction::snapshot;
    return next;
}

Status RenderJob::say_idle(bool idle) {
    if (idle == std::exchange(said_idle_, idle)) return {};
    return options_.peers->add(idle_ranks, idle ? 1 : ~uint64_t{0}).status();
}

Result<bool> RenderJob::all_agree(bool agrees) {
    const std::array<std::byte, 1> own = {std::byte{agrees}};
    const auto all = options_.peers->gather(own);
    if (!all) return all.status();
    std::vector<std::byte> answer;
    if (options_.peers->rank() == 0)
        answer.push_back(std::byte{std::all_of(all->begin(), all->end(), [](const auto& of_rank) { return of_rank[0] != std::byte{0}; })});
    RAYPAGER_TRY(options_.peers->broadcast(answer));
    return answer[0] != std::byte{0};
}

Status RenderJob::act(PeerAction what) {
    actions_++;
    if (what == PeerAction::late || what == PeerAction::stop_soon) {
        late_ = late_ || what == PeerAction::late;
        if (what == PeerAction::stop_soon) stop_began_ = render_seconds();
        RAYPAGER_TRY(begin_fewer(what == PeerAction::stop_soon));
        // What comes next would otherwise hide this from who has not looked yet. The other actions need no such wait: all take part in them.
        return options_.peers->gather({}).status();
    }
    RAYPAGER_TRY(settle());
    RAYPAGER_TRY(collect_films());
    RAYPAGER_TRY(tell_progress());
    if (what == PeerAction::stage || what == PeerAction::finish) {
        // A device may have failed in the last moment; then others do its work again.
        const auto agreed = all_agree(takes_no_more() && devices_.idle());
        if (!agreed) return agreed.status();
        if (!*agreed) return say_idle(false);
    }
    switch (what) {
        case PeerAction::checkpoint:
            devices_.doing("writing the checkpoint");
            return checkpoint_of_all();
        case PeerAction::snapshot:
            RAYPAGER_TRY(film_to_first({}));
            return options_.peers->rank() == 0 ? snapshot(render_seconds()) : Status();
        case PeerAction::stage:
            return stage_of_all();
        case PeerAction::stop:
            stopped_ = shortened_ = true;
            [[fallthrough]];
        default:
            finished_ = true;
            last_stage_ended_ = adaptive_.has_value();
            return {};
    }
}

// Rank 0 gets the film of all; the others have none of it any more.
Status RenderJob::film_to_first(const std::function<Status(std::span<uint32_t>)>& see) {
    const FilmLayout layout(wavefront().params());
    const FilmAdder adder(layout);
    const size_t most = film_piece_words(layout.words());
    for (size_t first = 0; first < film_.size(); first += most) {
        const auto piece = std::span(film_).subspan(first, std::min(most, film_.size() - first));
        RAYPAGER_TRY(options_.peers->sum(piece, [&](std::span<uint32_t> to, std::span<const uint32_t> from) { adder.add(to, from); }));
        if (see) RAYPAGER_TRY(see(piece));
        if (options_.peers->rank() > 0) std::fill(piece.begin(), piece.end(), 0);
    }
    return {};
}

// Rank 0 gets what has not begun or is under way anywhere.
Status RenderJob::gather_contents(Checkpointer::Contents& contents) {
    RAYPAGER_TRY(take_contents(contents));
    std::vector<std::byte> bytes;
    put_values(bytes, contents.left);
    put_values(bytes, contents.under_way);
    put_values(bytes, std::vector{contents.work});
    const auto all = options_.peers->gather(bytes);
    if (!all) return all.status();
    // Nobody takes samples before rank 0 has seen how many were taken.
    const auto begun = options_.peers->rank() == 0 ? options_.peers->add(taken, 0) : Result<uint64_t>(0);
    if (!begun) return begun.status();
    std::vector<std::byte> nothing;
    RAYPAGER_TRY(options_.peers->broadcast(nothing));
    for (size_t rank = 1; rank < all->size(); rank++) {
        std::span<const std::byte> rest((*all)[rank]);
        const auto left = take_values<SampleRange>(rest);
        const auto under_way = take_values<rp_path_sample>(rest);
        contents.left.insert(contents.left.end(), left.begin(), left.end());
        contents.under_way.insert(contents.under_way.end(), under_way.begin(), under_way.end());
        contents.work += without_clock(take_values<WorkDone>(rest)[0]);
    }
    contents.left.push_back({common_begin_ + std::min(*begun, common_end()), sample_limit_});
    return {};
}

Status RenderJob::checkpoint_of_all() {
    RAYPAGER_TRY(film_to_first({}));
    Checkpointer::Contents contents;
    RAYPAGER_TRY(gather_contents(contents));
    if (options_.peers->rank() > 0) return {};
    const Status status =
        checkpointer_->write(std::move(contents), [this](uint64_t first, std::span<uint32_t> words) { return read_words(first, words); });
    if (!status) warn(status.message() + "; the checkpoint before it stays, and the render goes on");
    return {};
}

// Each decides about stages by the film of all, so all decide the same.
Status RenderJob::share_film_for_stage() {
    adaptive_->begin_taking();
    return film_to_first([this](std::span<uint32_t> piece) -> Status {
        std::vector<std::byte> bytes;
        if (options_.peers->rank() == 0) put_values(bytes, std::vector<uint32_t>(piece.begin(), piece.end()));
        RAYPAGER_TRY(options_.peers->broadcast(bytes));
        std::span<const std::byte> rest(bytes);
        adaptive_->take(take_values<uint32_t>(rest));
        return {};
    });
}

Status RenderJob::stage_of_all() {
    devices_.doing("choosing pixels");
    RAYPAGER_TRY(share_film_for_stage());
    const SampleStage& stage = adaptive_->next();
    if (stage.pixels.empty()) {
        last_stage_ended_ = finished_ = true;
        return {};
    }
    if (options_.peers->rank() == 0) adaptive_->put(0, film_);
    RAYPAGER_TRY(begin_stage(stage, {}));
    return restart_common(stage.begin);
}

// Numbers from there on are taken next. By all together.
Status RenderJob::restart_common(uint64_t from) {
    Peers& peers = *options_.peers;
    if (peers.rank() == 0) {
        const auto before = peers.add(taken, 0);
        if (!before) return before.status();
        RAYPAGER_TRY(peers.add(taken, ~*before + 1).status());
    }
    RAYPAGER_TRY(say_idle(false));
    // Nobody takes any before all have said so and the number is 0.
    std::vector<std::byte> nothing;
    RAYPAGER_TRY(peers.gather(nothing).status());
    RAYPAGER_TRY(peers.broadcast(nothing));
    common_begin_ = from;
    common_taken_ = 0;
    return {};
}

// The film of all, and what each has done, to rank 0.
Status RenderJob::finish_with_peers() {
    RAYPAGER_TRY(settle(true));
    RAYPAGER_TRY(keeps_checkpoints_ ? checkpoint_of_all() : film_to_first({}));
    struct Done {
        WorkDone work;
        uint64_t begun, texture_waits;
        double concurrent_seconds;
        RenderReport::Rank figures;
    };
    struct DeviceDone {
        std::array<char, 128> name;
        RenderReport::DeviceFigures figures;
    };
    std::vector<std::byte> bytes;
    const ShardedBlocks::Figures blocks = sharded_->figures();
    Done own = {work(),
                samples_begun(),
                texture_waits_before_,
                0,
                {blocks.kept_bytes, blocks.from_memory, blocks.from_peers, blocks.from_file, blocks.late, blocks.damaged, peak_host_bytes()}};
    rank_figures_.push_back(own.figures);
    std::vector<DeviceDone> devices;
    for (size_t i = 0; i < devices_.count(); i++) {
        own.concurrent_seconds += static_cast<double>(devices_.worker(i).wavefront().concurrent_nanoseconds()) * 1e-9;
        const RenderReport::DeviceWork d = device_work(devices_.worker(i));
        devices.push_back({{}, d});
        d.facts.name.copy(devices.back().name.data(), devices.back().name.size() - 1);
    }
    put_values(bytes, std::vector{own});
    put_values(bytes, devices);
    const auto all = options_.peers->gather(bytes);
    if (!all) return all.status();
    for (size_t rank = 1; rank < all->size(); rank++) {
        std::span<const std::byte> rest((*all)[rank]);
        const Done done = take_values<Done>(rest)[0];
        of_peers_ += without_clock(done.work);
        begun_by_peers_ += done.begun;
        texture_waits_before_ += done.texture_waits;
        concurrent_of_peers_ += done.concurrent_seconds;
        rank_figures_.push_back(done.figures);
        for (const DeviceDone& d : take_values<DeviceDone>(rest)) {
            RenderReport::DeviceWork& device = peer_devices_.emplace_back(RenderReport::DeviceWork{d.figures, {d.name.data(), {}, {}, {}}});
            device.rank = static_cast<uint32_t>(rank);
        }
    }
    if (late_ || stop_began_) samples_to_begin_ = samples_begun() + begun_by_peers_;
    return {};
}

}  // namespace raypager
