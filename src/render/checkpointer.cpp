#include "render/checkpointer.hpp"

#include <fmt/format.h>

#include "base/log.hpp"
#include "wavefront/sample_order.hpp"

namespace raypager {

Result<Checkpointer> Checkpointer::create(const CheckpointOptions& options, const RenderIdentity& identity, uint32_t spp,
                                          const rp_sample_order& order, std::string device) {
    Checkpointer checkpointer(options, identity, spp, order, std::move(device));
    if (options.file.empty()) return checkpointer;
    std::error_code ignored;
    const bool there = std::filesystem::exists(options.file, ignored);
    if (there && !options.resume)
        return Status::failed(
            fmt::format("{}: exists, and may hold hours of work; go on from it with --resume, or remove it to start over", options.file.string()));
    if (!there) {
        if (options.resume) log_note(fmt::format("{}: no such checkpoint yet; the render starts from the beginning", options.file.string()));
        return checkpointer;
    }
    auto file = CheckpointFile::open(options.file);
    if (!file) return file.status();
    RAYPAGER_TRY(file->check(identity, spp));
    checkpointer.order_ = file->state().order;
    // Where sampling is adaptive, it is that of the first samples alone.
    if (identity.adaptive_error == 0)
        checkpointer.order_ = continue_order(file->state().order, file->state().next_sample, spp, uint64_t{identity.width} * identity.height);
    checkpointer.kept_samples_ = samples_begun(file->state()) - file->state().samples.size();
    checkpointer.resumed_ = std::move(*file);
    return checkpointer;
}

std::vector<SampleRange> Checkpointer::left(uint64_t limit) const {
    return resumed_ ? ranges_left(resumed_->state(), limit) : std::vector{SampleRange{0, limit}};
}

Status Checkpointer::restore(const FilmTarget& film) const { return resumed_ ? resumed_->read_film(film) : Status(); }

bool Checkpointer::due() const { return enabled() && std::chrono::duration<double>(Clock::now() - last_).count() >= options_.every_seconds; }

Status Checkpointer::write(Contents contents, const FilmSource& film) {
    const auto begin = Clock::now();
    CheckpointState state;
    state.identity = identity_;
    state.device = device_;
    state.spp = spp_;
    state.order = order_;
    set_left(state, std::move(contents.left), contents.limit);
    state.samples = std::move(contents.under_way);
    state.work = contents.work;
    const Status status = write_checkpoint(options_.file, state, film);
    if (status) {
        written_++;
        kept_samples_ = samples_begun(state) - state.samples.size();
    }
    last_ = Clock::now();
    seconds_ += std::chrono::duration<double>(last_ - begin).count();
    return status;
}

std::string Checkpointer::advice() const {
    if (!kept_samples_) return {};
    const double pixels = static_cast<double>(identity_.width) * identity_.height;
    return fmt::format("go on with --resume: {} has {:.1f} of {} samples per pixel", options_.file.string(),
                       static_cast<double>(*kept_samples_) / pixels, spp_);
}

}  // namespace raypager
