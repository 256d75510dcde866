// Images of textures and of a large sky -> pages in the file.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "bake/paged_sky.hpp"
#include "block/baked_scene.hpp"
#include "raypager/bake.hpp"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"
#include "store/block_sink.hpp"
#include "texture/layout.hpp"

namespace raypager {

// What will be baked, as far as it is known before a texel is read.
struct ImagePlan {
    std::vector<uint32_t> used;      // of Scene::images
    std::vector<ImageShape> shapes;  // of these, and of the sky
    ImageLayout layout;
    std::optional<PagedSky> sky;  // the image behind these, if the scene's sky is paged
};

struct ImageBaking {
    uint64_t host_limit = 0;                  // for images that are being baked
    const std::atomic<bool>* stop = nullptr;  // may be null
    std::function<void(double fraction)> progress;
};

// Opens the images that are used. An error if one cannot be: better now than after hours of work.
Result<ImagePlan> plan_images(const Scene& scene, const BakeOptions& options);

// Several at a time, as far as the limit allows; what is in the file does not depend on that. Images, levels and pages of baked are filled in, and
// its sky is as it has it where that is paged.
Status bake_images(const Scene& scene, ImagePlan plan, const ImageBaking& settings, BlockSink& sink, BakedScene& baked);

}  // namespace raypager
