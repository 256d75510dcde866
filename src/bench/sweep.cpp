#include "bench/sweep.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <map>

#include "base/hash.hpp"
#include "base/words.hpp"
#include "raypager/baselines.hpp"
#include "raypager/picture.hpp"

namespace raypager::bench {
namespace {

using Baseline = SweepPolicy::Baseline;

RenderOptions options_of(const SweepSettings& settings, const SweepVariant& variant) {
    RenderOptions options = settings.base;
    options.geometry_limit = variant.limit.bytes;
    options.geometry_limit_percent = variant.limit.percent;
    options.tuning.policy = variant.policy.kind;
    options.connection = variant.connection;
    options.tuning.paths = variant.paths.per_pixel ? variant.paths.per_pixel * options.width * options.height : variant.paths.count;
    if (variant.policy.baseline == Baseline::paper) use_paper_settings(options, options.width, options.height);
    if (variant.policy.baseline == Baseline::host) {
        options.tuning.pool_place = PoolPlace::host;
        options.geometry_limit = 0;
        options.geometry_limit_percent = 0;
    }
    options.snapshot_seconds = settings.first_snapshot;
    options.snapshot_growth = settings.snapshot_growth;
    return options;
}

Status add_point(SweepRun& run, const Image& image, const Image& reference, double seconds, double spp, uint64_t bytes_loaded) {
    const auto difference = compare_images(image, reference);
    if (!difference) return difference.status();
    run.convergence.push_back({seconds, spp, difference->rmse, bytes_loaded});
    return {};
}

Result<SweepRun> run_one(const BlockSource& file, const RenderOptions& options, bool keep_journal, const Image& reference) {
    SweepRun run;
    RenderCallbacks callbacks;
    callbacks.snapshot = [&](const Image& image, const std::vector<FilmLayerImage>&, const RenderProgress& progress) {
        if (progress.spp < 1) return Status();  // a picture with black pixels is no stage of convergence
        return add_point(run, image, reference, progress.seconds - progress.snapshot_seconds, progress.spp, progress.bytes_loaded);
    };
    RenderInstruments instruments;
    instruments.keep_journal = keep_journal;
    auto result = render(file, options, callbacks, instruments);
    if (!result) return result.status();
    run.report = result->report;
    run.seconds = run.report.seconds.render - run.report.seconds.snapshots;
    RAYPAGER_TRY(add_point(run, result->image, reference, run.seconds, run.report.spp, run.report.paging.bytes_loaded));
    run.journal = std::move(result->journal);
    run.round_seconds = std::move(result->round_seconds);
    return run;
}

// So that no variant pays for building kernels or touching memory first.
Status warm_up(const BlockSource& file, const SweepSettings& settings) {
    RenderOptions options = settings.base;
    options.spp = 1;
    options.time_seconds = 0;
    return render(file, options, {}).status();
}

}  // namespace

std::string SweepPolicy::name() const {
    if (baseline == Baseline::paper) return "paper";
    if (baseline == Baseline::host) return "host";
    return std::string(policy_name(kind));
}

std::string SweepPaths::name() const { return per_pixel ? fmt::format("{}x", per_pixel) : count ? std::to_string(count) : "auto"; }

std::string SweepVariant::limit_name() const {
    if (limit.bytes == 0) return fmt::format("{:g}%", limit.percent);
    return limit.bytes < uint64_t{10} << 20 ? fmt::format("{:.0f} KiB", static_cast<double>(limit.bytes) / 1024)
                                            : fmt::format("{:.0f} MiB", static_cast<double>(limit.bytes) / 1048576);
}

std::string SweepVariant::settings_name() const {
    std::string name = policy.name();
    if (paths.count || paths.per_pixel) name += fmt::format(", {} paths", paths.name());
    if (policy.baseline != Baseline::paper && connection == Connection::roulette) name += ", roulette";
    return name;
}

std::vector<SweepVariant> sweep_variants(const SweepSettings& settings) {
    std::vector<SweepVariant> variants;
    for (const SweepPolicy& policy : settings.policies)
        for (size_t p = 0; p < settings.paths.size(); p++)
            for (size_t c = 0; c < settings.connections.size(); c++)
                for (size_t l = 0; l < settings.limits.size(); l++) {
                    SweepVariant variant{settings.limits[l], policy, settings.paths[p], settings.connections[c]};
                    if (policy.baseline == Baseline::paper) {
                        if (p > 0 || c > 0) continue;
                        variant.paths = {};
                        variant.connection = Connection::roulette;
                    }
                    if (policy.baseline == Baseline::host) {
                        if (l > 0) continue;
                        variant.limit = {0, 100};
                    }
                    variants.push_back(variant);
                }
    return variants;
}

std::vector<std::string> find_different_films(const std::vector<SweepVariant>& variants, const std::vector<SweepRun>& runs) {
    std::vector<std::string> different;
    std::map<std::pair<std::string, uint32_t>, const SweepRun*> first;  // by connection rule and samples
    for (const SweepRun& run : runs) {
        const auto [found, inserted] = first.try_emplace({run.report.connection, run.report.spp}, &run);
        const SweepRun& other = *found->second;
        if (inserted || run.report.film_hash == other.report.film_hash) continue;
        const auto describe = [&](const SweepRun& r) {
            const SweepVariant& v = variants[r.variant];
            return fmt::format("{} at {}, repeat {}", v.settings_name(), v.limit_name(), r.repeat + 1);
        };
        different.push_back(
            fmt::format("{}: film {}, but {} has {}", describe(run), hex64(run.report.film_hash), describe(other), hex64(other.report.film_hash)));
    }
    return different;
}

size_t run_count(const SweepSettings& settings) { return settings.repeats * sweep_variants(settings).size(); }

std::optional<double> seconds_left(const SweepSettings& settings, const std::vector<SweepRun>& done) {
    if (done.empty()) return std::nullopt;
    std::map<size_t, std::pair<double, size_t>> of_variant;  // sum and number
    double all = 0;
    for (const SweepRun& run : done) {
        all += run.wall_seconds;
        of_variant[run.variant].first += run.wall_seconds;
        of_variant[run.variant].second++;
    }
    double left = 0;
    const size_t variants = sweep_variants(settings).size();
    for (size_t variant = 0; variant < variants; variant++) {
        const auto found = of_variant.find(variant);
        const size_t made = found == of_variant.end() ? 0 : std::min<size_t>(found->second.second, settings.repeats);
        const double each = made > 0 ? found->second.first / static_cast<double>(found->second.second) : all / static_cast<double>(done.size());
        left += each * static_cast<double>(settings.repeats - made);
    }
    return left;
}

Result<SweepResult> run_sweep(const BlockSource& file, const SweepSettings& given, const std::vector<SweepRun>& earlier, const SweepHooks& hooks) {
    const auto say = [&hooks](const std::string& text) {
        if (hooks.note) hooks.note(text);
    };
    const auto is_stopped = [&hooks] { return hooks.stop && *hooks.stop; };
    SweepSettings settings = given;
    settings.base.stop = settings.base.stop_now = hooks.stop;
    SweepResult result;
    result.variants = sweep_variants(settings);
    say(fmt::format("reference, {} samples per pixel", settings.reference.spp));
    auto reference = find_or_make_reference(file, settings.base, settings.reference);
    if (!reference) return is_stopped() ? Status::interrupted("stopped by a signal before the reference was complete") : reference.status();
    result.reference = std::move(*reference);
    const size_t all = run_count(settings);
    if (const Status warm = earlier.size() < all ? warm_up(file, settings) : Status(); !warm && !is_stopped()) return warm;
    std::vector<SweepRun> known = earlier;
    for (uint32_t repeat = 0; repeat < settings.repeats; repeat++)
        for (size_t variant = 0; variant < result.variants.size(); variant++) {
            const auto had =
                std::find_if(earlier.begin(), earlier.end(), [&](const SweepRun& r) { return r.variant == variant && r.repeat == repeat; });
            if (had != earlier.end()) {
                result.geometry_bytes = file.scene().memory_bytes(had->report.form);
                result.runs.push_back(*had);
                continue;
            }
            result.stopped = result.stopped || is_stopped();
            if (result.stopped) continue;  // runs of later repeats may be there
            const SweepVariant& v = result.variants[variant];
            const auto left = seconds_left(settings, known);
            say(fmt::format("{} of {}{}: {} at {}", repeat * result.variants.size() + variant + 1, all,
                            left ? fmt::format(", {} left", format_duration(*left)) : "", v.settings_name(), v.limit_name()));
            const RenderOptions options = options_of(settings, v);
            const auto begin = std::chrono::steady_clock::now();
            auto run = run_one(file, options, repeat == 0, result.reference.image);
            // A signal also ends the work of compilers: that fails, then.
            result.stopped = result.stopped || (run ? !run->report.complete : is_stopped());
            if (result.stopped) continue;
            if (!run) return run.status().at(fmt::format("{} at {}", v.settings_name(), v.limit_name()));
            run->wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
            run->variant = variant;
            result.geometry_bytes = file.scene().memory_bytes(run->report.form);
            run->repeat = repeat;
            if (hooks.finished) RAYPAGER_TRY(hooks.finished(*run, v));
            known.push_back(*run);
            result.runs.push_back(std::move(*run));
        }
    result.different_films = find_different_films(result.variants, result.runs);
    return result;
}

}  // namespace raypager::bench
