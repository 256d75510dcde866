// What hangs and stands in a museum, and where: so many images, of such sizes that they take so many bytes, and a hall that holds them all.
// Metres; y up, the hall runs from z = 0 along -z.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "procedural/coverings.hpp"
#include "procedural/parts.hpp"

namespace raypager {

constexpr uint64_t min_museum_textures = 16, max_museum_textures = 20'000;
constexpr uint32_t no_image = UINT32_MAX;

struct MuseumImage {
    std::string name;  // of its texture; its file is textures/NAME.ppm or .pgm
    bool painting = false;
    Covering covering = Covering::marble;  // unless it is a painting
    double area = 1;                       // in square metres, as far as it decides how many of all texels it has
    double aspect = 1;                     // width over height
    uint64_t seed = 0;
    bool powers_of_two = false;
    uint32_t width = 0, height = 0;  // texels
    bool grey() const { return !painting && is_grey(covering); }
    std::string file() const { return "textures/" + name + (grey() ? ".pgm" : ".ppm"); }
    uint64_t bytes() const { return uint64_t{width} * height * (grey() ? 1 : 4); }  // level 0, decoded
};

// Fields are indices of images.
struct MuseumPainting {
    uint32_t picture, roughness = no_image, frame_roughness = no_image;
    Pose corner;  // the lower left one; x to the right, y up, z out of the wall
    double width = 1, height = 1;
};
struct MuseumStatue {
    uint32_t stone, roughness = no_image;
};
struct MuseumPlant {
    uint32_t leaf, mask;
};
struct MuseumBuilding {
    uint32_t floor, floor_roughness, wall, ceiling, column, pedestal, bench, pot, gilt_roughness, dark_roughness;
};

struct MuseumPlan {
    std::vector<MuseumImage> images;
    MuseumBuilding building{};
    std::vector<MuseumPlant> plants;  // kinds
    std::vector<MuseumStatue> statues;
    std::vector<MuseumPainting> paintings;
    uint32_t bays = 1, storeys = 1;

    static constexpr double bay = 5, storey = 4.4;
    double half_width() const { return 6 + 0.6 * (storeys - 1); }
    double height() const { return storey * storeys + 0.6; }
    double length() const { return bay * bays; }

    // Where something can stand: sites of a bay, from the walls inwards, on both sides in turn.
    uint32_t sites_a_bay() const { return 4 * (1 + (storeys - 1) / 3); }
    uint32_t sites() const { return sites_a_bay() * bays; }
    Vector site(uint32_t index) const;
};

// REQUIRES: min_museum_textures <= textures <= max_museum_textures. Sizes are not decided yet.
MuseumPlan plan_museum(uint64_t textures, uint64_t seed);

// Images of 64 to 16384 texels a side that take about so many bytes together; an error, with what would do, if there are none.
Status size_images(std::vector<MuseumImage>& images, uint64_t bytes);

}  // namespace raypager
