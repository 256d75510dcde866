// A render of which only parts are begun, for measurements (RenderInstruments::parts).
#include "base/check.hpp"
#include "render/job.hpp"

namespace raypager {

Status RenderJob::begin_parts() {
    if (!instruments_.parts) return {};
    RAYPAGER_CHECK(!adaptive_ && !in_first_pass_ && !checkpointer_->enabled());
    parts_ = instruments_.parts(wavefront().params());
    RAYPAGER_CHECK(!parts_.empty());
    const SamplePart first = parts_.front();
    parts_.erase(parts_.begin());
    left_out_ = first.begin;
    part_begins_ = true;
    wavefront().expect_more(!parts_.empty());
    return wavefront().begin_part(first.begin, first.end);
}

// Free slots take the paths of the next part as soon as the last one of this part has begun.
Status RenderJob::go_on_with_parts() {
    if (parts_.empty() || stopped_ || late_ || stop_began_ || part_begins_) return {};
    if (samples_begun() < wavefront().params().sample_limit) return {};
    RAYPAGER_TRY(settle());
    const SamplePart next = parts_.front();
    parts_.erase(parts_.begin());
    left_out_ += next.begin - wavefront().params().sample_limit;
    part_begins_ = true;
    wavefront().expect_more(!parts_.empty());
    return wavefront().begin_part(next.begin, next.end);
}

}  // namespace raypager
