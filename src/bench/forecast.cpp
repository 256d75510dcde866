#include "raypager/forecast.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "base/log.hpp"
#include "bench/clock_model.hpp"
#include "bench/forecast_runs.hpp"
#include "bench/limit_curve.hpp"

namespace raypager {
namespace {

using namespace bench;
using Clock = std::chrono::steady_clock;

// A limit, and what was measured within it.
struct Trial {
    RenderOptions options;
    LimitPlan plan;
    std::vector<Course> courses;
    Extent whole;
    double resident_bytes = 0;
    double seen_bytes = 0;  // of all that ever came, each once
};

double bytes_of(const GeometryLimit& limit, uint64_t scene_bytes) {
    return limit.bytes ? static_cast<double>(limit.bytes) : static_cast<double>(scene_bytes) * limit.percent / 100;
}

std::vector<GeometryLimit> usual_limits(const LimitPlan& asked) {
    if (asked.holds_all()) return {{0, 50}, {0, 25}, {0, 12.5}};
    return {{4 * asked.pool_bytes}, {2 * asked.pool_bytes}, {asked.pool_bytes / 2}};
}

class Forecaster {
public:
    Forecaster(const Blocks& scene, const RenderOptions& options, const ForecastOptions& how, const RenderCallbacks& callbacks)
        : source_(scene.source()), options_(options), how_(how), callbacks_(callbacks) {
        if (how.stop) options_.stop_now = how.stop;
    }

    Result<Forecast> run() {
        RAYPAGER_TRY(choose_trials());
        RAYPAGER_TRY(measure());
        return result();
    }

private:
    // Within another limit of geometry: where the memory limit has no room for it, within as much as a render takes by itself.
    Result<Trial> trial_within(const GeometryLimit& limit) const {
        Trial trial{options_, {}, {}, {}};
        trial.options.geometry_limit = limit.bytes;
        trial.options.geometry_limit_percent = limit.bytes ? 0 : limit.percent;
        const auto plan = plan_within(source_, trial.options);
        if (!plan) return plan.status();
        trial.plan = *plan;
        if (static_cast<double>(plan->pool_bytes) >= std::floor(bytes_of(limit, plan->scene_bytes))) return trial;
        RenderOptions roomy = trial.options;
        roomy.memory_limit = 0;
        const auto more = plan_within(source_, roomy);
        if (!more || more->pool_bytes <= plan->pool_bytes) return trial;
        trial.options = roomy;
        trial.plan = *more;
        return trial;
    }

    void warn(const std::string& text) const { callbacks_.warning ? callbacks_.warning(text) : log_warning(text); }

    Status choose_trials() {
        const auto asked = plan_within(source_, options_);
        if (!asked) return asked.status();
        if (asked->film_in_parts) warn("the film is on the device in parts; each loads blocks anew, which this forecast leaves out");
        trials_.push_back({options_, *asked, {}, {}});
        auto resident = trial_within({0, 100});
        if (!resident) return resident.status();
        has_resident_ = resident->plan.holds_all();
        if (has_resident_ && !asked->holds_all()) trials_.push_back(std::move(*resident));
        for (const GeometryLimit& limit : how_.limits.empty() ? usual_limits(*asked) : how_.limits) {
            if (bytes_of(limit, asked->scene_bytes) >= static_cast<double>(asked->scene_bytes)) continue;
            auto trial = trial_within(limit);
            // What is not asked for is left out if it cannot be.
            if (!trial && how_.limits.empty()) continue;
            if (!trial) return trial.status().at("--limits");
            const auto is_there = [&](const Trial& other) { return other.plan.pool_bytes == trial->plan.pool_bytes; };
            if (std::ranges::none_of(trials_, is_there)) trials_.push_back(std::move(*trial));
        }
        return {};
    }

    Status measure() {
        constexpr size_t most_passes = 3;
        if (how_.progress) how_.progress(0);
        for (size_t pass = 0; pass < most_passes; pass++) {
            const double before = seconds();
            for (size_t i = 0; i < trials_.size(); i++) {
                // To and fro, so that none has the cold start, or whatever else goes with its place, each time.
                RAYPAGER_TRY(measure(trials_[pass % 2 ? trials_.size() - 1 - i : i]));
                const double share = static_cast<double>(pass * trials_.size() + i + 1) / static_cast<double>(trials_.size() * most_passes);
                if (how_.progress) how_.progress(std::min(1.0, std::max(share, seconds() / how_.seconds)));
            }
            const double each = seconds() - before;
            if (seconds() + each > how_.seconds) break;
        }
        for (Trial& trial : trials_) trial.whole = whole_extent(quickest(trial.courses), samples_);
        return {};
    }

    Status measure(Trial& trial) {
        const auto stopped = [this] { return how_.stop && *how_.stop; };
        const Status interrupted = Status::interrupted("stopped before the forecast was complete");
        if (stopped()) return interrupted;
        const auto pilot = run_pilot(source_, trial.options, callbacks_);
        // Compilers of kernels that catch signals themselves fail when one comes.
        if (!pilot) return stopped() ? interrupted : pilot.status();
        trial.courses.push_back(course_of(pilot->marks, pilot->parts));
        if (trial.courses.back().paces.size() != trial.courses.front().paces.size())
            return Status::failed("other programs took memory of the device between two measurements; try again, or give a --memory-limit");
        const uint64_t pixels = uint64_t{options_.width} * options_.height;
        if (pilot->parts.size() > 1) trial.courses.back().later_sweeps = later_sweeps(pilot->samples, pixels, pilot->parts.front().end);
        trial.resident_bytes = std::max(trial.resident_bytes, pilot->resident_bytes);
        trial.seen_bytes = std::max(trial.seen_bytes, pilot->seen_bytes);
        samples_ = pilot->samples;
        uint64_t measured = 0;
        for (const PilotPart& part : pilot->parts) measured += part.end - part.begin;
        samples_measured_ = std::max(samples_measured_, measured);
        return {};
    }

    // All limits have the same rays to trace. The parts of each lie elsewhere in the picture where it has other regions: what they say of the number
    // of rays is by chance.
    double rays() const {
        double sum = 0;
        for (const Trial& trial : trials_) sum += trial.whole.rays;
        return sum / static_cast<double>(trials_.size());
    }

    ForecastRow row_of(const Trial& trial) const {
        ForecastRow row;
        row.geometry_bytes = std::min(trial.plan.pool_bytes, trial.plan.scene_bytes);
        row.memory_bytes = trial.plan.device_bytes;
        row.paths = trial.plan.slots;
        row.seconds = trial.whole.rays > 0 ? trial.whole.seconds * rays() / trial.whole.rays : trial.whole.seconds;
        row.moved_bytes = trial.resident_bytes + trial.whole.bytes;
        return row;
    }

    // Where the device has no room for everything.
    ForecastRow modelled_resident() const {
        const Trial& asked = trials_.front();
        std::vector<Extent> measured;
        for (const Trial& trial : trials_) {
            const Course course = quickest(trial.courses);
            measured.insert(measured.end(), course.paces.begin(), course.paces.end());
            if (course.paces.empty()) measured.push_back(trial.whole);
        }
        const ClockModel clock = fit_clock(measured);
        ForecastRow row;
        row.measured = false;
        row.geometry_bytes = asked.plan.scene_bytes;
        row.paths = asked.plan.slots;
        row.memory_bytes = asked.plan.device_bytes - asked.plan.pool_bytes + asked.plan.scene_bytes;
        // What is seen comes once.
        for (const Trial& trial : trials_) row.moved_bytes = std::max(row.moved_bytes, trial.seen_bytes);
        // Each round takes a ray of every path on.
        row.seconds = clock.seconds(rays(), rays() / static_cast<double>(asked.plan.slots), 0);
        for (const Trial& trial : trials_) row.seconds = std::min(row.seconds, row_of(trial).seconds);
        return row;
    }

    Forecast result() const {
        const Trial& asked = trials_.front();
        Forecast result;
        result.device = asked.plan.device;
        result.width = options_.width, result.height = options_.height, result.spp = options_.spp;
        result.scene_bytes = asked.plan.scene_bytes;
        result.samples = samples_;
        result.samples_measured = samples_measured_;
        for (const Trial& trial : trials_) result.rows.push_back(row_of(trial));
        if (!has_resident_) result.rows.push_back(modelled_resident());
        std::ranges::sort(result.rows, std::greater(), &ForecastRow::geometry_bytes);
        result.resident = result.rows.front();
        for (ForecastRow& row : result.rows) row.slow_down = result.resident.seconds > 0 ? row.seconds / result.resident.seconds : 1;
        result.resident.slow_down = 1;
        double least = result.resident.seconds;
        for (auto row = result.rows.rbegin(); row != result.rows.rend(); ++row) {
            least = row == result.rows.rbegin() ? row->seconds : std::min(least, row->seconds);
            if (least > 0) result.noise = std::max(result.noise, row->seconds / least);
        }
        const uint64_t of_asked = row_of(asked).geometry_bytes;
        result.asked = *std::ranges::find(result.rows, of_asked, &ForecastRow::geometry_bytes);
        find_limits(result);
        result.seconds = seconds();
        return result;
    }

    static void find_limits(Forecast& forecast) {
        std::vector<LimitPoint> points;
        for (auto row = forecast.rows.rbegin(); row != forecast.rows.rend(); ++row)
            if (row->geometry_bytes >= std::max<uint64_t>(1, forecast.asked.geometry_bytes)) points.push_back({row->geometry_bytes, row->seconds});
        constexpr double noise = 1.02;  // less than that is none
        if (forecast.asked.slow_down < noise) return;
        forecast.halves_excess = limit_for(points, (forecast.asked.seconds + forecast.resident.seconds) / 2);
        forecast.halves_time = limit_for(points, forecast.asked.seconds / 2);
    }

    double seconds() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

    const BlockSource& source_;
    RenderOptions options_;
    const ForecastOptions& how_;
    const RenderCallbacks& callbacks_;
    const Clock::time_point begin_ = Clock::now();
    std::vector<Trial> trials_;  // that of the options first
    bool has_resident_ = false;
    uint64_t samples_ = 0, samples_measured_ = 0;
};

}  // namespace

Result<Forecast> forecast(const Blocks& scene, const RenderOptions& options, const ForecastOptions& how, const RenderCallbacks& callbacks) {
    if (options.time_seconds > 0) return Status::usage("a forecast is of a number of samples, and not of a render that ends by the clock");
    if (options.adaptive_error > 0) return Status::usage("how many samples adaptive sampling takes is not known before; there is no forecast of it");
    if (options.peers) return Status::usage("a forecast is of one process");
    if (!options.checkpoint.file.empty() || !options.record.file.empty() || options.coarse_first)
        return Status::usage("a forecast has no checkpoint, no recording, and no coarse pass");
    RenderOptions filled = options;
    if (filled.width == 0) filled.width = scene.width();
    if (filled.height == 0) filled.height = scene.height();
    if (filled.spp == 0) filled.spp = scene.spp();
    return Forecaster(scene, filled, how, callbacks).run();
}

}  // namespace raypager
