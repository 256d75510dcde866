// What the default is measured against. Every baseline renders the same picture with the same kernels; only the paging differs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "raypager/blocks.hpp"
#include "raypager/session.hpp"

namespace raypager {

// The paper's settings (sections 3.2 to 3.5): a ray buffer of four paths a pixel, shadow rays by roulette against the continuation, one
// swap a round for which the next round waits, the most wanted block in and the least bounced out.
// width, height: of the picture.
void use_paper_settings(RenderOptions& options, uint32_t width, uint32_t height);
inline constexpr uint32_t paper_paths_per_pixel = 4;

// What still differs from the paper, for it is decided when a scene is baked: blocks of 30 MB with one box each. Nothing if neither does.
std::optional<std::string> paper_bake_difference(const Blocks& scene);

}  // namespace raypager
