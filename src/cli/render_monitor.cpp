#include "cli/render_monitor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "base/log.hpp"
#include "cli/developing.hpp"
#include "cli/output_paths.hpp"
#include "cli/values.hpp"
#include "raypager/picture.hpp"

namespace raypager {
namespace {

constexpr double log_seconds = 1;  // between rows without --snapshots
constexpr double terminal_progress_seconds = 0.5;
constexpr double file_progress_seconds = 5;  // each is a line of its own there

Status check_reference_size(const Image& reference, const std::filesystem::path& path, const RenderOptions& effective) {
    if (reference.width == effective.width && reference.height == effective.height) return {};
    return Status::usage(fmt::format("render: --reference: {} has {}x{} pixels, the picture will have {}x{}; give --size {}x{} or another reference",
                                     path.string(), reference.width, reference.height, effective.width, effective.height, reference.width,
                                     reference.height));
}

bool goes_on_from_checkpoint(const RenderSettings& settings) {
    const CheckpointOptions& checkpoint = settings.options.checkpoint;
    std::error_code ignored;
    return checkpoint.resume && std::filesystem::exists(checkpoint.file, ignored);
}

// Of the samples so far, by device: "0: 51 %, 1: 49 %"; of several processes by rank: "rank 0: 51 %, 1: 49 %".
std::string shares_text(const RenderProgress& progress) {
    uint64_t all = 0;
    std::map<uint32_t, uint64_t> samples;
    const bool by_rank = progress.devices.back().rank > 0;
    for (const RenderProgress::Device& device : progress.devices) {
        all += device.samples;
        samples[by_rank ? device.rank : device.index] += device.samples;
    }
    std::string text = by_rank ? "rank " : "";
    for (const auto& [number, count] : samples)
        text += fmt::format("{}{}: {:.0f} %", number == samples.begin()->first ? "" : ", ", number,
                            100 * static_cast<double>(count) / static_cast<double>(std::max<uint64_t>(1, all)));
    return text;
}

}  // namespace

std::string progress_text(const RenderProgress& progress, uint32_t spp) {
    struct Part {
        std::string text;
        int rank;  // those with the highest are left out first where room is short
    };
    std::vector<Part> parts;
    const double rate = progress.rays_per_second / 1e6;
    parts.push_back({spp > 0 ? fmt::format("spp {:.1f}/{}", progress.spp, spp) : fmt::format("spp {:.1f}", progress.spp), 0});
    parts.push_back({fmt::format("{:.{}f} Mrays/s", rate, rate < 10 ? 2 : rate < 100 ? 1 : 0), 2});
    const auto devices = static_cast<double>(std::max<size_t>(1, progress.devices.size()));
    if (progress.geometry_bytes > 0)
        parts.push_back(
            {fmt::format("{:.0f} % resident", 100 * static_cast<double>(progress.resident_bytes) / (devices * double(progress.geometry_bytes))), 3});
    if (progress.devices.size() > 1) parts.push_back({shares_text(progress), 5});
    parts.push_back({counted(progress.loads, "load"), 4});
    if (progress.fraction > 0.001 && progress.fraction < 1)
        parts.push_back({format_duration(progress.seconds * (1 - progress.fraction) / progress.fraction) + " left", 1});
    for (int most = 5;; most--) {
        std::string line;
        for (const Part& part : parts)
            if (part.rank <= most) line += (line.empty() ? "" : " | ") + part.text;
        if (most == 0 || line.size() <= progress_columns) return line;
    }
}

Result<RenderMonitor> RenderMonitor::create(const RenderSettings& settings, const RenderOptions& effective, std::optional<Image> reference) {
    RenderMonitor monitor;
    monitor.settings_ = settings;
    monitor.total_spp_ = settings.options.spp == 0 && settings.options.time_seconds > 0 ? 0 : effective.spp;
    monitor.show_progress_ = settings.progress || stderr_is_terminal();
    if (reference) RAYPAGER_TRY(check_reference_size(*reference, *settings.reference, effective));
    monitor.reference_ = std::move(reference);
    std::error_code ignored;
    if (settings.log) {
        // A render that goes on from a checkpoint goes on with its log: rays and seconds count from where they were.
        const bool goes_on = goes_on_from_checkpoint(settings) && std::filesystem::exists(*settings.log, ignored);
        auto log = goes_on ? GrowingFile::reopen(*settings.log) : GrowingFile::create(*settings.log);
        if (!log) return log.status();
        monitor.log_ = std::move(*log);
        if (!goes_on) RAYPAGER_TRY(monitor.log_.append("seconds,spp,rmse,loads,bytes_loaded,rays\n"));
    }
    return monitor;
}

RenderCallbacks RenderMonitor::callbacks(RenderOptions& options) {
    RenderCallbacks result;
    if (show_progress_) {
        options.progress_seconds = stderr_is_terminal() ? terminal_progress_seconds : file_progress_seconds;
        result.progress = [spp = total_spp_](const RenderProgress& progress) { progress_line(progress_text(progress, spp)); };
    }
    options.snapshot_seconds = settings_.snapshot_seconds > 0 ? settings_.snapshot_seconds : log_.is_open() ? log_seconds : 0;
    if (options.snapshot_seconds > 0)
        result.snapshot = [this](Image& image, std::vector<FilmLayerImage>& layers, const RenderProgress& progress) {
            return snapshot(image, layers, progress);
        };
    return result;
}

// Denoised, too, wherever anybody looks at the picture: a file, or the log's comparison with a reference.
Status RenderMonitor::develop(Image& image, std::vector<FilmLayerImage>& layers, const RenderProgress& progress) {
    if (settings_.snapshot_seconds > 0 || reference_) RAYPAGER_TRY(denoise_picture(settings_, image, layers, true).status());
    expose(image, settings_.exposure);
    if (settings_.snapshot_seconds > 0) RAYPAGER_TRY(write_picture(settings_, image, std::move(layers)));
    return log_.is_open() ? log_row(image, progress) : Status();
}

// A snapshot or a row that cannot be written is no reason to throw the render away: the disk may have room again at its end.
Status RenderMonitor::snapshot(Image& image, std::vector<FilmLayerImage>& layers, const RenderProgress& progress) {
    const Status status = develop(image, layers, progress);
    if (!status && !warned_) log_warning(status.message() + "; the render goes on");
    warned_ = warned_ || !status;
    return {};
}

Status RenderMonitor::log_row(const Image& image, const RenderProgress& progress) {
    const auto error = rmse(image);
    if (!error) return error.status();
    return log_.append(fmt::format("{:.3f},{:.4f},{},{},{},{}\n", progress.seconds, progress.spp, *error ? fmt::format("{:.8g}", **error) : "",
                                   progress.loads, progress.bytes_loaded, progress.rays));
}

Result<std::optional<double>> RenderMonitor::rmse(const Image& image) const {
    if (!reference_) return std::optional<double>();
    const auto difference = compare_images(image, *reference_);
    if (!difference) return difference.status();
    return std::optional(difference->rmse);
}

Status RenderMonitor::finish(const Image& image, const RenderReport& report) {
    progress_line("");
    const auto error = rmse(image);
    if (!error) return error.status();
    final_rmse_ = *error;
    if (!log_.is_open()) return {};
    RenderProgress last;
    last.seconds = report.seconds.render;
    last.spp = report.average_spp;
    last.rays = report.rays.total();
    last.loads = report.paging.loads;
    last.bytes_loaded = report.paging.bytes_loaded;
    return log_row(image, last);
}

}  // namespace raypager
