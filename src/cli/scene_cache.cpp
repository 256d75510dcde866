#include "cli/scene_cache.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>

#include "base/files.hpp"
#include "base/hash.hpp"
#include "base/log.hpp"
#include "cli/baking.hpp"
#include "cli/output_paths.hpp"

namespace raypager {
namespace {

using Clock = std::chrono::steady_clock;

// $XDG_CACHE_HOME/raypager, or ~/.cache/raypager; nothing without a home.
std::optional<std::filesystem::path> user_cache_folder() {
    const auto variable = [](const char* name) -> std::optional<std::filesystem::path> {
        const char* value = std::getenv(name);
        if (value == nullptr || value[0] != '/') return std::nullopt;
        return value;
    };
    if (const auto cache = variable("XDG_CACHE_HOME")) return *cache / "raypager";
    if (const auto home = variable("HOME")) return *home / ".cache" / "raypager";
    return std::nullopt;
}

// The block file at path, if it is there, whole, and has the geometry of this scene; it comes with the looks of the scene.
std::optional<Blocks> open_cached(const std::filesystem::path& path, uint64_t fingerprint, const Scene& scene) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;
    auto blocks = open_baked(path, scene, fingerprint);
    if (blocks) return *blocks;
    log_warning(fmt::format("{}; it is baked again", blocks.status().message()));
    return std::nullopt;
}

Result<std::filesystem::path> first_writable(const std::vector<std::filesystem::path>& folders) {
    for (const auto& folder : folders) {
        std::error_code error;
        std::filesystem::create_directories(folder, error);
        if (folder_is_writable(folder)) return folder;
    }
    return Status::failed(
        fmt::format("{}: the baked scene cannot be kept there, the folder is not writable; name another with --cache-dir", folders.front().string()));
}

// Tells the inputs apart whose block files share a folder: their name, and where they lie.
std::string cache_prefix(const std::vector<std::filesystem::path>& inputs) {
    uint64_t places = 0;
    std::error_code error;
    for (const auto& input : inputs) places = hash64(std::filesystem::weakly_canonical(input, error).string(), places);
    return fmt::format("{}-{}-", inputs.front().stem().string(), hex64(places).substr(0, 8));
}

bool is_fingerprint(std::string_view text) { return text.size() == 16 && text.find_first_not_of("0123456789abcdef") == std::string_view::npos; }

// Removes what earlier versions of the inputs left in folder: their block files, and temporary files of bakes that were killed.
void remove_old(const std::filesystem::path& folder, const std::string& prefix, const std::string& current) {
    const auto belongs = [&](std::string_view stem) { return stem.starts_with(prefix) && is_fingerprint(stem.substr(prefix.size())); };
    remove_abandoned_temporaries(folder, ".rpb", belongs);
    std::error_code error;
    for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
        const std::filesystem::path& path = entry->path();
        std::error_code ignored;
        // A render that has the file open keeps it until it ends.
        if (path.filename() != current && path.extension() == ".rpb" && belongs(path.stem().string())) std::filesystem::remove(path, ignored);
    }
}

}  // namespace

std::vector<std::filesystem::path> cache_folders(const std::filesystem::path& input, const std::optional<std::filesystem::path>& cache_directory) {
    if (cache_directory) return {*cache_directory};
    std::vector<std::filesystem::path> folders = {folder_of(input)};
    if (const auto user = user_cache_folder()) folders.push_back(*user);
    return folders;
}

Result<OpenedScene> open_scene(const std::vector<std::filesystem::path>& inputs, const std::optional<std::filesystem::path>& cache_directory,
                               const BakeRequest& request) {
    if (inputs.size() == 1 && has_ending(inputs.front(), ".rpb")) {
        auto blocks = Blocks::open(inputs.front());
        if (!blocks) return blocks.status();
        return OpenedScene{*blocks, 0, 0};
    }
    const auto begin = Clock::now();
    const auto seconds = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
    BareLook look = request.look;
    look.width = request.view.width;
    look.height = request.view.height;
    auto scene = import_with_warnings(inputs, request.options.host_limit, look, request.options.points.columns);
    if (!scene) return scene.status();
    if (request.options.points.cull_to_camera || request.options.points.filter_to_image) RAYPAGER_TRY(set_view(request.view, *scene));
    const auto fingerprint = bake_fingerprint(*scene, request.options);
    if (!fingerprint) return fingerprint.status();

    const std::string prefix = cache_prefix(inputs), name = prefix + hex64(*fingerprint) + ".rpb";
    const auto folders = cache_folders(inputs.front(), cache_directory);
    for (const auto& folder : folders)
        if (auto blocks = open_cached(folder / name, *fingerprint, *scene)) {
            forget_unpacked_files();
            log_note(fmt::format("the scene is baked already: {}", (folder / name).string()));
            return OpenedScene{*blocks, seconds(), ground_triangles(*scene)};
        }
    const auto folder = first_writable(folders);
    if (!folder) return folder.status();
    const auto summary = bake_with_notes(*scene, request.options, *folder / name, request.show_progress);
    if (!summary) return summary.status();
    remove_old(*folder, prefix, name);
    auto blocks = Blocks::open(*folder / name);
    if (!blocks) return blocks.status();
    return OpenedScene{*blocks, seconds(), ground_triangles(*scene)};
}

}  // namespace raypager
