// A render's dealings with its checkpoint file: whether it goes on from there, and when it is written anew.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "render/checkpoint.hpp"
#include "render/render.hpp"

namespace raypager {

class Checkpointer {
public:
    // Reads the checkpoint to go on from, if that is asked for and there is one; an error says why this render cannot. No other file is
    // overwritten than one that the render went on from. Without a file in options, nothing is ever written.
    // order: of a render that starts anew. device: name and driver; the picture may differ in the last bits between two.
    static Result<Checkpointer> create(const CheckpointOptions& options, const RenderIdentity& identity, uint32_t spp, const rp_sample_order& order,
                                       std::string device);

    bool enabled() const { return !options_.file.empty(); }
    bool resumed() const { return resumed_.has_value(); }
    // Of all samples, numbered up to `limit`: those that have not begun; how many have; and the first of those behind which none has.
    std::vector<SampleRange> left(uint64_t limit) const;
    std::vector<SampleRange> gaps() const { return resumed_ ? resumed_->state().gaps : std::vector<SampleRange>(); }
    uint64_t begun() const { return resumed_ ? samples_begun(resumed_->state()) : 0; }
    uint64_t next_sample() const { return resumed_ ? resumed_->state().next_sample : 0; }
    // Samples to be begun again.
    std::vector<rp_path_sample> under_way() const { return resumed_ ? resumed_->state().samples : std::vector<rp_path_sample>(); }
    // That of the render which it goes on from: `next_sample` tells which samples have begun in no other.
    const rp_sample_order& order() const { return order_; }
    WorkDone earlier_work() const { return resumed_ ? resumed_->state().work : WorkDone(); }
    bool other_device() const { return resumed_ && resumed_->state().device != device_; }
    // Hands over the film to go on with.
    Status restore(const FilmTarget& film) const;

    // Rendering begins: the first interval counts from now.
    void begin() { last_ = Clock::now(); }
    // Whether the interval is over.
    bool due() const;
    // Between two rounds. left: of all samples, numbered up to `limit`, those that have not begun. under_way: those that are not in the film.
    struct Contents {
        std::vector<SampleRange> left;
        uint64_t limit = 0;
        std::vector<rp_path_sample> under_way;
        WorkDone work;  // by this run and those before
    };
    Status write(Contents contents, const FilmSource& film);
    uint32_t written() const { return written_; }
    double seconds() const { return seconds_; }  // spent on writing
    // What the file holds, for the end of a sentence: "go on with --resume: FILE has 12.3 samples per pixel"; empty if there is none.
    std::string advice() const;

private:
    using Clock = std::chrono::steady_clock;
    Checkpointer(const CheckpointOptions& options, const RenderIdentity& identity, uint32_t spp, const rp_sample_order& order, std::string device)
        : options_(options), identity_(identity), spp_(spp), order_(order), device_(std::move(device)) {}

    CheckpointOptions options_;
    RenderIdentity identity_;
    uint32_t spp_ = 0, written_ = 0;
    rp_sample_order order_;
    std::string device_;
    std::optional<CheckpointFile> resumed_;
    std::optional<uint64_t> kept_samples_;  // that the file holds: begun ones
    double seconds_ = 0;
    Clock::time_point last_ = Clock::now();
};

}  // namespace raypager
