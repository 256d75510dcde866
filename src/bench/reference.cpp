#include "bench/reference.hpp"

#include <fmt/format.h>

#include <cstring>

#include "base/hash.hpp"
#include "base/log.hpp"

namespace raypager::bench {
namespace {

// Far from the seeds that people choose, so that no render shares samples with its reference.
constexpr uint32_t other_seed = 0x5eed0ffu;

RenderOptions reference_options(const RenderOptions& options, const ReferenceSettings& settings) {
    RenderOptions reference;
    reference.device = options.device;
    reference.memory_limit = options.memory_limit;
    reference.host_limit = options.host_limit;
    reference.width = options.width;
    reference.height = options.height;
    reference.max_depth = options.max_depth;
    reference.camera = options.camera;
    reference.spp = settings.spp;
    reference.seed = options.seed ^ other_seed;
    reference.stop = options.stop;
    reference.stop_now = options.stop_now;
    return reference;
}

}  // namespace

std::filesystem::path reference_path(const BakedScene& scene, const RenderOptions& options, const ReferenceSettings& settings) {
    const RenderOptions reference = reference_options(options, settings);
    const Camera& camera = reference.camera ? *reference.camera : scene.camera;
    uint64_t key = scene.identity();
    const auto add = [&key](const auto& value) { key = hash64(std::as_bytes(std::span(&value, 1)), key); };
    add(camera);
    const uint32_t depth = reference.max_depth ? *reference.max_depth : scene.max_depth;
    for (const uint32_t value : {reference.width, reference.height, depth, reference.spp, reference.seed}) add(value);
    return settings.folder / fmt::format("reference-{}.pfm", hex64(key));
}

Result<Reference> find_or_make_reference(const BlockSource& file, const RenderOptions& options, const ReferenceSettings& settings) {
    Reference reference;
    reference.spp = settings.spp;
    reference.seed = options.seed ^ other_seed;
    reference.path = reference_path(file.scene(), options, settings);
    std::error_code error;
    if (std::filesystem::is_regular_file(reference.path, error)) {
        auto image = read_image(reference.path);
        if (image && image->width == options.width && image->height == options.height) {
            reference.image = std::move(*image);
            reference.was_there = true;
            return reference;
        }
        log_warning(image ? reference.path.string() + " has another size; it is made again" : image.status().message() + "; it is made again");
    }
    auto result = render(file, reference_options(options, settings), {});
    if (!result) return result.status().at("the reference");
    if (!result->report.complete) return Status::interrupted("stopped by a signal before the reference was complete");
    RAYPAGER_TRY(write_image(reference.path, result->image));
    reference.image = std::move(result->image);
    return reference;
}

}  // namespace raypager::bench
