#include "bake/paged_sky.hpp"

#include <algorithm>
#include <cstring>

#include "base/hash.hpp"
#include "lights/image_words.hpp"
#include "scene/image_levels.hpp"
#include "scene/light_images.hpp"

namespace raypager {
namespace {

class SkySource final : public ImageSource {
public:
    explicit SkySource(std::shared_ptr<const LightImage> image) : image_(std::move(image)) {}
    std::string name() const override { return "the sky"; }
    Result<ImageShape> shape() const override { return ImageShape{image_->width, image_->height, 4, TexelKind::half}; }
    Status read(const std::function<Status(std::span<const std::byte>)>& take) const override {
        for (uint32_t y = 0; y < image_->height; y++)
            RAYPAGER_TRY(take(std::as_bytes(std::span(image_->texels).subspan(size_t{y} * image_->width, image_->width))));
        return {};
    }
    Result<uint64_t> fingerprint() const override { return hash64(std::as_bytes(std::span(image_->texels)), image_->width); }

private:
    const std::shared_ptr<const LightImage> image_;
};

}  // namespace

std::optional<PagedSky> paged_sky(const Scene& scene, const BakeOptions& options) {
    const std::optional<uint32_t> number = sky_image(scene.lights);
    if (!number) return {};
    const auto shared = std::ranges::count_if(scene.lights, [&](const rp_light& light) { return image_of(light) == number; });
    PagedSky sky = {scene.light_images[*number], *number};
    if (shared > 1 || sky.image->texels.size() * sizeof(rp_texel) <= options.resident_sky_bytes) return {};
    for (uint32_t size = sky.image->width; size > std::max(options.scattered_sky_size, 1u); size = next_level_size(size)) sky.level++;
    return sky;
}

std::shared_ptr<const ImageSource> sky_source(const PagedSky& sky) { return std::make_shared<SkySource>(sky.image); }

void leave_out_sky(LightImages& images, uint32_t number) {
    const LightImage& whole = *images[number];
    images[number] = std::make_shared<const LightImage>(LightImage{whole.width, whole.height, {}});
}

SkyLevel::SkyLevel(const PagedSky& sky) : sky_(sky) {
    gathered_.width = sky.image->width;
    for (uint32_t level = 0; level < sky.level; level++) gathered_.width = next_level_size(gathered_.width);
    gathered_.height = gathered_.width;
    gathered_.texels.reserve(size_t{gathered_.width} * gathered_.width);
}

void SkyLevel::take(uint32_t level, std::span<const std::byte> texels) {
    if (level != sky_.level) return;
    const size_t before = gathered_.texels.size();
    gathered_.texels.resize(before + texels.size() / sizeof(rp_texel));
    std::memcpy(gathered_.texels.data() + before, texels.data(), texels.size());
}

std::vector<rp_u32> SkyLevel::words(uint32_t image) const {
    std::vector<rp_u32> words = sky_head(gathered_);
    words[RP_IMAGE_WIDTH] = sky_.image->width;
    words[RP_IMAGE_HEIGHT] = sky_.image->height;
    words[RP_IMAGE_IN_PAGES] = image;
    words[RP_IMAGE_LEVEL] = sky_.level;
    return words;
}

}  // namespace raypager
