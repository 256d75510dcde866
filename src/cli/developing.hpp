// From what a render gives to the picture that is written: its noise taken out, exposed, with the layers that were asked for.
#pragma once

#include <filesystem>
#include <vector>

#include "cli/render_settings.hpp"
#include "raypager/film_layers.hpp"
#include "raypager/picture.hpp"

namespace raypager {

// Fills settings.denoiser where pictures are to be denoised; an error if they cannot be.
Status choose_denoiser(RenderSettings& settings);
// If it was asked for; the seconds that it took. layers: all of the render; fast: as DenoiseOptions have it. After an error the picture is as it was.
Result<double> denoise_picture(const RenderSettings& settings, Image& image, const std::vector<FilmLayerImage>& layers, bool fast = false);
// The picture to settings.output, with those of the layers that --layers asked for: denoising has had others kept.
Status write_picture(const RenderSettings& settings, const Image& image, std::vector<FilmLayerImage> layers);

}  // namespace raypager
