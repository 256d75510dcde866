#include "raypager/baselines.hpp"

#include <fmt/format.h>

namespace raypager {

void use_paper_settings(RenderOptions& options, uint32_t width, uint32_t height) {
    options.tuning.policy = PolicyKind::most_wanted;
    options.connection = Connection::roulette;
    options.tuning.paths = paper_paths_per_pixel * width * height;
    options.tuning.loads_in_flight = 1;
    options.tuning.hold_above_ready = 1.0;
    options.tuning.wait_for_loads = true;
}

std::optional<std::string> paper_bake_difference(const Blocks& scene) {
    constexpr uint32_t least = 15u << 20;  // blocks are cut in halves: those of 30 MB at most have 15 MB at least, but for the last cut
    const uint64_t largest = scene.largest(BlockForm::stored);
    const bool small = scene.count() > 1 && largest<least, boxes = scene.block_entries()> scene.count();
    if (!small && !boxes) return std::nullopt;
    return fmt::format(
        "the paper's blocks have 30 MB and one box each, this scene's up to {:.1f} MB and {:.1f} boxes; "
        "bake with --block-size 30M --sub-boxes 1 for all of its settings",
        static_cast<double>(largest) / 1048576.0, static_cast<double>(scene.block_entries()) / static_cast<double>(scene.count()));
}

}  // namespace raypager
