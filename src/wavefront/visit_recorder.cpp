#include "wavefront/visit_recorder.hpp"

#include <algorithm>

#include "base/check.hpp"
#include "raypager/abi/visits.h"
#include "wavefront/sample_order.hpp"

namespace raypager {
namespace {

// The events of one path become its rays. Events of a ray that were logged twice (a pass that found no room for all of them is repeated)
// count once.
class PathBuilder {
public:
    explicit PathBuilder(DemandTrace& trace) : trace_(trace) {}

    void add(uint32_t event) {
        const uint32_t kind = event >> RP_VISIT_KIND_SHIFT, block = event & RP_VISIT_BLOCK_MASK;
        switch (kind) {
            case RP_VISIT_BEGIN_EXTEND:
                begin(false);
                found(block);
                break;
            case RP_VISIT_RESUME_EXTEND:
                found(block);
                break;
            case RP_VISIT_BEGIN_SHADOW:
                begin(true);
                stops(block);
                break;
            case RP_VISIT_RESUME_SHADOW:
            case RP_VISIT_STOPS:
                stops(block);
                break;
            default:
                RAYPAGER_CHECK(kind == RP_VISIT_ENTER);
                if (blocks_.empty() || blocks_.back() != block) blocks_.push_back(block);
        }
    }

    void end_path() {
        end_ray();
        trace_.path_rays.push_back(trace_.rays.size());
    }

private:
    void begin(bool shadow) {
        // No path has two shadow rays in a row: the first could not be logged whole, and this is the same one again.
        if (open_ && !(shadow && ray_.shadow)) end_ray();
        ray_ = {0, 0, shadow, RP_NONE};
        open_ = true;
        blocks_.clear();
        stopping_.clear();
    }
    void found(uint32_t block) {
        if (block != RP_VISIT_NO_BLOCK) ray_.hit_block = block;
    }
    void stops(uint32_t block) {
        if (block != RP_VISIT_NO_BLOCK) stopping_.push_back(block);
    }
    void end_ray() {
        if (!open_) return;
        open_ = false;
        ray_.first_visit = trace_.visits.size();
        ray_.visits = static_cast<uint32_t>(blocks_.size());
        for (const uint32_t block : blocks_)
            trace_.visits.push_back(Visit::of(block, std::find(stopping_.begin(), stopping_.end(), block) != stopping_.end()));
        trace_.rays.push_back(ray_);
    }

    DemandTrace& trace_;
    TracedRay ray_;
    bool open_ = false;
    std::vector<uint32_t> blocks_, stopping_;
};

}  // namespace

void VisitRecorder::take(std::span<const uint32_t> events) {
    RAYPAGER_CHECK(events.size() % RP_VISIT_WORDS == 0);
    for (size_t at = 0; at < events.size(); at += RP_VISIT_WORDS) {
        const uint32_t pixel = events[at], sample = events[at + 1];
        const auto [found, inserted] = index_.try_emplace(uint64_t{sample} << 32 | pixel, static_cast<uint32_t>(paths_.size()));
        if (inserted) paths_.push_back({sample_number(order_, width_, height_, pixel, sample), {}});
        paths_[found->second].events.push_back(events[at + 2]);
    }
}

void VisitRecorder::finish(DemandTrace& trace) {
    std::sort(paths_.begin(), paths_.end(), [](const Path& a, const Path& b) { return a.number < b.number; });
    for (const Path& path : paths_) {
        PathBuilder builder(trace);
        for (const uint32_t event : path.events) builder.add(event);
        builder.end_path();
    }
    paths_.clear();
    index_.clear();
}

}  // namespace raypager
