#include "bench/baselines.hpp"

#include <fmt/format.h>

namespace raypager::bench {

void use_paper_settings(RenderOptions& options, uint32_t width, uint32_t height) {
    options.policy = PolicyKind::most_wanted;
    options.connection = Connection::roulette;
    options.paths = paper_paths_per_pixel * width * height;
    options.loads_in_flight = 1;
    options.hold_above_ready = 1.0;
    options.wait_for_loads = true;
}

std::optional<std::string> paper_bake_difference(const BakedScene& scene) {
    constexpr uint32_t least = 15u << 20;  // blocks are cut in halves: those of 30 MB at most have 15 MB at least, but for the last cut
    const bool small = scene.blocks.size() > 1 && scene.largest_block(BlockForm::stored)<least, boxes = scene.portals.size()> scene.blocks.size();
    if (!small && !boxes) return std::nullopt;
    return fmt::format(
        "the paper's blocks have 30 MB and one box each, this scene's up to {:.1f} MB and {:.1f} boxes; "
        "bake with --block-size 30M --sub-boxes 1 for all of its settings",
        scene.largest_block(BlockForm::stored) / 1048576.0, static_cast<double>(scene.portals.size()) / static_cast<double>(scene.blocks.size()));
}

}  // namespace raypager::bench
