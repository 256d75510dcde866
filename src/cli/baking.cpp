#include "cli/baking.hpp"

#include <fmt/format.h>

#include <mutex>

#include "base/files.hpp"
#include "base/log.hpp"
#include "cli/report.hpp"
#include "cli/stop_signal.hpp"
#include "cli/values.hpp"
#include "raypager/import.hpp"

namespace raypager {
namespace {

constexpr size_t max_warnings = 20;

// A progress callback that may be called from several threads. Without a terminal, a line a stage; lines in between would only fill logs.
std::function<void(const char*, double)> progress_printer() {
    struct State {
        std::mutex mutex;
        std::string stage;
        int percent = -1;
    };
    return [state = std::make_shared<State>()](const char* stage, double fraction) {
        const std::lock_guard lock(state->mutex);
        const int percent = static_cast<int>(fraction * 100);
        if (stage == state->stage && (percent == state->percent || !stderr_is_terminal())) return;
        state->stage = stage;
        state->percent = percent;
        progress_line(fmt::format("bake: {} {} %", stage, percent));
    };
}

void print_issues(const MeshIssues& issues) {
    std::vector<std::string> warnings;
    for (const MeshWarning& w : issues.warnings)
        warnings.push_back(w.files == 1 ? w.text : fmt::format("{} (and {} more {} like it)", w.text, w.files - 1, w.files == 2 ? "file" : "files"));
    if (issues.any()) warnings.push_back(issues.describe());
    print_warnings(warnings);
}

}  // namespace

void print_warnings(const std::vector<std::string>& warnings) {
    for (size_t i = 0; i < std::min(warnings.size(), max_warnings); ++i) log_warning(warnings[i]);
    if (warnings.size() > max_warnings) log_warning(fmt::format("and {} more", warnings.size() - max_warnings));
}

uint64_t ground_triangles(const Scene& scene) {
    uint64_t count = 0;
    for (const Shape& shape : scene.shapes)
        if (const auto* mesh = dynamic_cast<const MeshInMemory*>(shape.mesh.get()); mesh && shape.backdrop) count += mesh->mesh().triangles.size();
    return count;
}

Result<Scene> import_with_warnings(const std::vector<std::filesystem::path>& inputs, uint64_t host_limit, const BareLook& look,
                                   const PointColumns& columns) {
    const uint64_t keep_bytes = host_limit ? std::min(default_keep_bytes, host_limit / 8) : default_keep_bytes;
    auto scene = import_scene(inputs, {keep_bytes, look, columns});
    if (scene) print_warnings(scene->warnings);
    return scene;
}

Result<BakeSummary> bake_with_notes(const Scene& scene, BakeOptions options, const std::filesystem::path& output, bool show_progress) {
    if (show_progress) options.progress = progress_printer();
    const StopSignal signal(StopMode::finish);
    options.stop = &signal.stop();
    auto summary = bake(scene, options, output);
    forget_unpacked_files();
    progress_line("");
    if (!summary) return summary;
    print_issues(summary->issues);
    if (summary->reduced_limit > 0)
        log_note(fmt::format("only {} of main memory are free for the bake, not {} as usual: it went over the disk",
                             format_bytes(summary->reduced_limit), format_bytes(summary->usual_limit)));
    if (summary->points_culled || summary->points_merged)
        log_note(fmt::format("left out: {} that the camera does not see, {} that share a pixel with others", counted(summary->points_culled, "point"),
                             format_count(summary->points_merged)));
    const std::string detour = summary->buckets ? fmt::format(" over the disk in {}", counted(summary->buckets, "bucket")) : "";
    const std::string images = summary->images ? fmt::format(" and {} into {}, {},", counted(summary->images, "image"),
                                                             counted(summary->pages, "page"), format_bytes(summary->texture_bytes))
                                               : "";
    log_note(fmt::format("baked {}{} into {}, {},{}{} in {}: {}", primitives_text(summary->triangles, summary->spheres, ground_triangles(scene)),
                         instances_text(summary->instances, summary->objects), counted(summary->blocks, "block"), format_bytes(summary->stored_bytes),
                         images, detour, format_duration(summary->seconds), output.string()));
    return summary;
}

}  // namespace raypager
