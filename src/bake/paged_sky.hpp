// Skies that are too large to be resident: their texels become an image in pages.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "block/baked_scene.hpp"
#include "raypager/bake.hpp"
#include "raypager/scene.hpp"

namespace raypager {

struct PagedSky {
    std::shared_ptr<const LightImage> image;
    uint32_t number = 0;  // of the image, among those of lights
    uint32_t level = 0;   // that surfaces see which scatter light
};

// The scene's sky, if it is to be paged: that is a matter of the scene and of options of the bake, not of any limit, so that pictures do not depend
// on limits. The image that a lamp shines through as well stays resident.
std::optional<PagedSky> paged_sky(const Scene& scene, const BakeOptions& options);

// Its texels as the format RP_TEXEL_SKY has them; by its shape they are halves, which take as many bytes.
std::shared_ptr<const ImageSource> sky_source(const PagedSky& sky);

// Takes out its texels, which are in pages. number: of the sky's image.
void leave_out_sky(LightImages& images, uint32_t number);

// Gathers the rows of the level that directions are drawn from, and makes the sky's words of it (abi/light_image.h).
class SkyLevel {
public:
    explicit SkyLevel(const PagedSky& sky);
    void take(uint32_t level, std::span<const std::byte> texels);
    // image: the number of the sky's among those in pages.
    std::vector<rp_u32> words(uint32_t image) const;

private:
    const PagedSky& sky_;
    LightImage gathered_;
};

}  // namespace raypager
