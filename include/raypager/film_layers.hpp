// Layers: what a film can keep of each pixel beside its light, for compositing and denoising. Like the light itself they are the same to the bit
// whatever the limits are, but for waits, which show paging.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "raypager/picture.hpp"
#include "raypager/status.hpp"

namespace raypager {

// Means over all samples of a pixel, of what their camera rays meet first. Samples that meet nothing count as zeros. Pixels without samples, of
// renders that were stopped, have the means around them, as in the picture.
//   albedo    the share of light that the surface reflects or lets through, 0 to 1, whatever its roughness; 0 of what only emits
//   normal    shading normal in the world, unit length in each sample, towards the camera
// Of the first sample of a pixel, what its camera ray meets first. Means of these would be of no use.
//   depth     along the view direction, in units of the scene; of panoramas the distance from the eye; infinity where nothing is met
//   position  in the world; 0, 0, 0 where nothing is met
//   object    number of the object that an instance has placed there, from 1 in the order of Scene::objects; 0: none, also where baking has written
//             instances out as copies
//   instance  its number, from 1; 0: none
//   material  number of the material, from 1 in the order of Scene::materials; 0: nothing is met
// Of the sums of samples.
//   samples   how many are finished
//   variance  of the pixel's mean luminance, as if its samples were independent of each other. They are spread evenly, so the square of its error is
//             smaller, often by far. Samples count as at most 1024; 0 with fewer than two samples
//   waits     rounds of the render that paths of the pixel have spent waiting for a block or a page
// Numbers above 2^24 - 1, which floats cannot tell apart, begin again at 1.
enum class FilmLayer : uint32_t { albedo, normal, depth, position, object, instance, material, samples, variance, waits };
inline constexpr uint32_t film_layer_count = 10;

class FilmLayers {
public:
    FilmLayers() = default;
    explicit FilmLayers(uint32_t bits) : bits_(bits & ((1u << film_layer_count) - 1)) {}
    bool has(FilmLayer layer) const { return (bits_ >> static_cast<uint32_t>(layer) & 1) != 0; }
    void add(FilmLayer layer) { bits_ |= 1u << static_cast<uint32_t>(layer); }
    bool any() const { return bits_ != 0; }
    uint32_t bits() const { return bits_; }  // bit i: layer i
    bool operator==(const FilmLayers&) const = default;

private:
    uint32_t bits_ = 0;
};

std::string_view film_layer_name(FilmLayer layer);
Result<FilmLayer> film_layer_named(std::string_view name);  // a usage error if there is none
// A list as users write it: "albedo,normal,depth", or "all". An error of usage names the word that is none.
Result<FilmLayers> parse_film_layers(std::string_view list);
// The other way round; empty if there are none.
std::string film_layer_list(const FilmLayers& layers);

// Names of its channels in files: "albedo.R", "albedo.G", "albedo.B"; "N.X", "N.Y", "N.Z"; "Z"; "position.X", "position.Y", "position.Z"; "object",
// "instance", "material"; "samples"; "variance"; "waits".
std::vector<std::string> film_layer_channels(FilmLayer layer);

struct FilmLayerImage {
    FilmLayer layer = FilmLayer::albedo;
    Image image;  // as many channels as film_layer_channels says
};

// Picture and layers in one file, with channels of these names behind R, G, B and A. Only .exr files can hold them: a usage error otherwise.
Status write_image_with_layers(const std::filesystem::path& path, const Image& picture, const std::vector<FilmLayerImage>& layers);
// Whether a picture with this ending can have layers.
bool holds_layers(const std::filesystem::path& path);

}  // namespace raypager
