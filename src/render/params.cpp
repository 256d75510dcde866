#include "render/params.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <vector>

#include "base/hash.hpp"
#include "base/memory.hpp"
#include "base/words.hpp"
#include "device/kernel_sources.hpp"
#include "device/kernel_tokens.hpp"
#include "raypager/abi/film.h"
#include "render/adaptive.hpp"
#include "scene/pixel_filter.hpp"
#include "scene/vector.hpp"
#include "wavefront/sample_order.hpp"
#include "wavefront/wavefront.hpp"

namespace raypager {
namespace {

// A film pixel holds so many samples of any radiance (abi/film.h).
constexpr uint32_t max_spp = 65535;

void set3(float (&target)[3], const Float3& value) {
    target[0] = value.x;
    target[1] = value.y;
    target[2] = value.z;
}
void set3(float (&target)[4], const Float3& value) {
    target[0] = value.x;
    target[1] = value.y;
    target[2] = value.z;
    target[3] = 0;
}

rp_camera device_camera(const Camera& camera) {
    rp_camera result = {};
    set3(result.eye, camera.eye);
    set3(result.right, camera.right);
    set3(result.up, camera.up);
    set3(result.forward, camera.forward);
    result.projection = static_cast<rp_u32>(camera.projection);
    if (camera.lens_radius > 0) {
        set3(result.lens_right, float3(double{camera.lens_radius} * unit(vector(camera.right))));
        set3(result.lens_up, float3(double{camera.lens_radius} * unit(vector(camera.up))));
        result.focal_distance = camera.focal_distance;
    }
    if (camera.sees_all_around()) std::copy(camera.window.begin(), camera.window.end(), result.window);
    return result;
}

rp_pixel_filter device_filter(const PixelFilter& filter) {
    rp_pixel_filter result = {};
    if (filter.is_the_pixel()) return result;
    result.radius[0] = filter.radius_x;
    result.radius[1] = filter.radius_y;
    for (uint32_t axis = 0; axis < 2; axis++) {
        const std::vector<float> shares = filter_shares(filter, axis, RP_FILTER_STEPS);
        std::copy(shares.begin(), shares.end(), result.share[axis]);
    }
    return result;
}

// What a camera ray stands for in textures: half a pixel. The samples of a pixel spread over it by themselves.
void set_camera_cone(const Camera& camera, rp_render_params& params) {
    const auto length = [](const Float3& v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); };
    constexpr float share = 0.5f, half_turn = 3.14159265f;
    const auto width = static_cast<float>(params.width), height = static_cast<float>(params.height);
    const float pixel = 2 * std::min(length(camera.right) / width, length(camera.up) / height);  // at the distance of forward
    if (camera.projection == Projection::orthographic)
        params.textures.cone_width = share * pixel;
    else
        params.textures.cone_spread = share * (camera.sees_all_around() ? half_turn * camera.window[3] / height : pixel / length(camera.forward));
}

uint32_t background_identity(const rp_render_params& params) {
    if (params.background_kind == RP_BACKGROUND_LIGHTS) return 0;
    return static_cast<uint32_t>(hash64(std::as_bytes(std::span(params.background)), params.background_kind)) | 1u;
}

}  // namespace

bool is_seen_growing(const RenderOptions& options) {
    return options.time_seconds > 0 || options.snapshot_seconds > 0 || options.coarse_first || !options.checkpoint.file.empty();
}

Result<rp_render_params> make_params(const BakedScene& scene, const RenderOptions& options) {
    rp_render_params params = {};
    const Camera& camera = options.camera ? *options.camera : scene.camera;
    params.camera = device_camera(camera);
    params.filter = device_filter(scene.filter);
    params.width = options.width ? options.width : scene.width;
    params.height = options.height ? options.height : scene.height;
    set_camera_cone(camera, params);
    // With a time limit alone, the time decides.
    params.spp = options.spp ? options.spp : options.time_seconds > 0 ? max_spp : scene.spp;
    params.max_depth = options.max_depth ? *options.max_depth : scene.max_depth;
    params.seed = options.seed;
    params.light_count = static_cast<uint32_t>(scene.lights.size());
    params.range_count = static_cast<uint32_t>(scene.ranges.size());
    params.infinite_light = RP_NONE;
    for (uint32_t i = 0; i < scene.lights.size(); i++)
        if (scene.lights[i].kind == RP_LIGHT_INFINITE) params.infinite_light = i;
    if (options.background) {
        params.background_kind = options.background->transparent ? RP_BACKGROUND_TRANSPARENT : RP_BACKGROUND_COLOR;
        if (!options.background->transparent) set3(params.background, options.background->color);
    }
    params.film_rows = params.height;
    params.film_layers = options.layers.bits();
    params.adaptive_error = static_cast<float>(options.adaptive_error);
    params.max_luminance = scene.film.max_luminance;
    params.max_xyz = scene.film.max_xyz;
    params.roulette_connection = options.connection == Connection::roulette;
    const uint64_t pixels = uint64_t{params.width} * params.height;
    constexpr uint32_t longest_side = 1 << 20;  // kernels multiply it by the size of a tile
    if (params.width > longest_side || params.height > longest_side)
        return Status::usage(fmt::format("--size: at most {} pixels a side", longest_side));
    if (pixels == 0 || pixels > uint64_t{1} << 31)
        return Status::usage(fmt::format("--size {}x{}: between 1 and 2^31 pixels are possible", params.width, params.height));
    if (params.spp == 0 || params.spp > max_spp) return Status::usage(fmt::format("--spp {}: from 1 to {}", params.spp, max_spp));
    if (options.tuning.tile_size > largest_tile) return Status::usage(fmt::format("--tile {}: from 1 to {}", options.tuning.tile_size, largest_tile));
    if (options.tuning.together > max_together)
        return Status::usage(fmt::format("--together {}: from 1 to {}", options.tuning.together, max_together));
    const uint32_t together = options.tuning.together ? options.tuning.together : is_seen_growing(options) ? 1 : default_together(pixels);
    if (options.adaptive_error != 0 && !(options.adaptive_error >= 1e-4 && options.adaptive_error <= 10))
        return Status::usage(fmt::format("--adaptive {:g}: from 0.0001 to 10", options.adaptive_error));
    // Where sampling is adaptive, of the samples before the first stage.
    const uint32_t ordered = options.adaptive_error > 0 ? std::min(params.spp, AdaptiveSampling::first_samples) : params.spp;
    params.order =
        make_order(options.tuning.tile_size ? options.tuning.tile_size : default_tile, together, ordered, pixels, options.tuning.region.value_or(0));
    if (params.max_depth > 60000) return Status::usage("--max-depth: at most 60000");
    params.stage_begin = pixels * ordered;
    return params;
}

Status check_instruments(const RenderOptions& options, const RenderInstruments& instruments) {
    if (instruments.record_paths == 0) return {};
    if (!options.spp && options.time_seconds > 0)
        return Status::usage("--record-trace needs --spp as well as --time: the share of paths to record follows from how many there can be");
    if (options.checkpoint.resume)
        return Status::usage("--record-trace: a render that goes on from a checkpoint cannot be recorded whole; leave --resume out");
    return {};
}

RenderIdentity identity_of(const BakedScene& scene, const rp_render_params& params) {
    RenderIdentity identity;
    identity.scene = scene.identity();
    identity.kernels = kernels_identity(kernel_sources(), render_stages);
    identity.width = params.width;
    identity.height = params.height;
    identity.max_depth = params.max_depth;
    identity.seed = params.seed;
    identity.roulette_connection = params.roulette_connection;
    identity.background = background_identity(params);
    identity.camera = params.camera;
    identity.film_layers = params.film_layers;
    identity.adaptive_error = params.adaptive_error;
    return identity;
}

namespace {

uint64_t picture_bytes(const rp_render_params& params) {
    const FilmLayout layout(params);
    uint64_t channels = params.background_kind == RP_BACKGROUND_TRANSPARENT ? 4 : 3;
    for (uint32_t i = 0; i < film_layer_count; i++)
        if (layout.layers().has(static_cast<FilmLayer>(i))) channels += film_layer_channels(static_cast<FilmLayer>(i)).size();
    const uint64_t of_stages = layout.adaptive() ? AdaptiveSampling::bytes_per_pixel : 0;
    return uint64_t{params.width} * params.height * (channels * sizeof(float) + of_stages);
}

Status check_host_memory(const rp_render_params& params, const char* what, uint64_t bytes) {
    const uint64_t free = available_memory();
    if (bytes <= free) return {};
    return Status::failed(fmt::format("--size {}x{}: {} {} of main memory, of which {} are free; render a smaller one", params.width, params.height,
                                      what, format_bytes(bytes), format_bytes(free)));
}

}  // namespace

Status check_picture_size(const rp_render_params& params, const DeviceInfo& device, bool film_in_parts) {
    const uint64_t pixels = uint64_t{params.width} * params.height, bytes_per_pixel = FilmLayout(params).words() * sizeof(uint32_t);
    const uint64_t film = pixels * bytes_per_pixel, most = device.max_allocation_bytes;
    const uint64_t part = uint64_t{params.width} * std::min(params.height, params.order.tile_size) * bytes_per_pixel;
    if (film_in_parts && part > most)
        return Status::failed(
            fmt::format("--size {}x{}: the film of a row of tiles needs {} at once, but {} allocates at most {}; give a smaller --tile", params.width,
                        params.height, format_exact_bytes(part), device.name, format_bytes(most)));
    if (film > most && !film_in_parts)
        return Status::failed(
            fmt::format("--size {}x{}: the film needs {} at once, but {} allocates at most {}; at most {} pixels are possible there", params.width,
                        params.height, format_exact_bytes(film), device.name, format_bytes(most), format_count(most / bytes_per_pixel)));
    return check_host_memory(params, "the picture needs", picture_bytes(params));
}

uint64_t host_film_bytes(const rp_render_params& params) {
    return uint64_t{params.width} * (uint64_t{params.height} + params.film_rows) * FilmLayout(params).words() * sizeof(uint32_t);
}

Status check_host_film(const rp_render_params& params) {
    return check_host_memory(params, "the picture and its film, which does not fit into device memory as a whole, need",
                             host_film_bytes(params) + picture_bytes(params));
}

}  // namespace raypager
