#include "cli/developing.hpp"

#include <fmt/format.h>

#include <chrono>

#include "base/log.hpp"
#include "raypager/denoise.hpp"

namespace raypager {
namespace {

const Image* find_layer(const std::vector<FilmLayerImage>& layers, FilmLayer wanted) {
    for (const FilmLayerImage& layer : layers)
        if (layer.layer == wanted) return &layer.image;
    return nullptr;
}

}  // namespace

Status choose_denoiser(RenderSettings& settings) {
    if (!settings.denoise) return {};
    const auto found = find_denoiser();
    if (!found) return found.status().at("--denoise");
    settings.denoiser = fmt::format("Open Image Denoise {}", found->version);
    log_note(fmt::format("denoiser: {}, {}", settings.denoiser, found->library.string()));
    return {};
}

// Before the exposure, which then only multiplies the picture: what is detail and what is noise does not depend on it.
Result<double> denoise_picture(const RenderSettings& settings, Image& image, const std::vector<FilmLayerImage>& layers, bool fast) {
    if (!settings.denoise) return 0.0;
    const auto begin = std::chrono::steady_clock::now();
    auto denoised = denoise(image, find_layer(layers, FilmLayer::albedo), find_layer(layers, FilmLayer::normal), {{}, fast});
    if (!denoised) return denoised.status();
    image = std::move(*denoised);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

Status write_picture(const RenderSettings& settings, const Image& image, std::vector<FilmLayerImage> layers) {
    std::erase_if(layers, [&](const FilmLayerImage& layer) { return !settings.options.layers.has(layer.layer); });
    return write_image_with_layers(settings.output, image, layers);
}

}  // namespace raypager
