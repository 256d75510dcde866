// What is shown and written while a render runs: the progress line, snapshots of the picture, the convergence log.
#pragma once

#include <optional>
#include <string>

#include "base/files.hpp"
#include "cli/render_settings.hpp"
#include "raypager/picture.hpp"
#include "raypager/session.hpp"

namespace raypager {

class RenderMonitor {
public:
    // Opens the log. The reference, if there is one, must have the picture's size.
    static Result<RenderMonitor> create(const RenderSettings& settings, const RenderOptions& effective, std::optional<Image> reference);

    // Sets the intervals in options to those of the monitor. The callbacks refer to the monitor; it must outlive the render.
    RenderCallbacks callbacks(RenderOptions& options);
    // The last row of the log, with the finished picture, exposed as it is written.
    Status finish(const Image& image, const RenderReport& report);
    std::optional<double> final_rmse() const { return final_rmse_; }

private:
    Status snapshot(Image& image, std::vector<FilmLayerImage>& layers, const RenderProgress& progress);
    Status develop(Image& image, std::vector<FilmLayerImage>& layers, const RenderProgress& progress);
    Status log_row(const Image& image, const RenderProgress& progress);
    Result<std::optional<double>> rmse(const Image& image) const;

    RenderSettings settings_;
    bool show_progress_ = false;
    uint32_t total_spp_ = 0;  // 0: as many as there is time for
    bool warned_ = false;     // about a snapshot that could not be written
    GrowingFile log_;         // open if asked for
    std::optional<Image> reference_;
    std::optional<double> final_rmse_;
};

// "spp 12.5/64 | 3.21 Mrays/s | resident 120 MiB of 480 MiB | 812 loads | 0:42 left"; at most about 80 columns in all but extreme renders.
// spp: how many there will be, or 0 if time decides.
std::string progress_text(const RenderProgress& progress, uint32_t spp);

}  // namespace raypager
