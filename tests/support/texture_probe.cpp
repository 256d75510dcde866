#include "support/texture_probe.hpp"

#include <algorithm>
#include <cstring>
#include <random>

#include "support/probe_kernels.hpp"
#include "texture/layout.hpp"
#include "texture/texture_words.hpp"
#include "texture/tiler.hpp"
#include "wavefront/path_state.hpp"

namespace raypager::support {
namespace {

void require(bool holds, const char* what) {
    if (!holds) throw std::runtime_error(what);
}

std::vector<std::vector<std::byte>> tile_all_images(const Scene& scene, BakedScene& tables) {
    std::vector<ImageShape> shapes;
    for (const auto& source : scene.images) shapes.push_back(*source->shape());
    auto layout = lay_out_images(shapes);
    require(layout.ok(), "the images have no layout");
    std::vector<std::vector<std::byte>> pages(layout->pages, std::vector<std::byte>(RP_TEXTURE_PAGE_BYTES));
    const auto put = [&](uint32_t page, uint32_t at, std::span<const std::byte> bytes) {
        std::ranges::copy(bytes, pages[page].begin() + at);
        return Status();
    };
    const PageTakers takers = {[&](uint32_t page, std::span<const std::byte> bytes) { return put(page, 0, bytes); }, put};
    for (size_t i = 0; i < shapes.size(); i++) {
        const rp_image& image = layout->images[i];
        const auto levels = std::span<const rp_image_level>(layout->levels).subspan(image.first_level, image.levels);
        require(tile_image(*scene.images[i], image, levels, takers).ok(), "an image cannot be read");
    }
    tables.images = std::move(layout->images);
    tables.image_levels = std::move(layout->levels);
    return pages;
}

}  // namespace

TextureProbe::TextureProbe(const Scene& scene) : scene_(scene), pages_(tile_all_images(scene, tables_)) {
    tables_.texture_ops = scene.texture_ops;
    tables_.texture_maps = scene.texture_maps;
    auto device = Device::open("", 0);
    if (!device.ok()) throw std::runtime_error(device.status().message());
    device_ = std::move(*device);
    // Numbers of pages say nothing of where they lie.
    constexpr size_t stride = RP_TEXTURE_PAGE_BYTES + 3 * RP_BLOCK_ALIGNMENT;
    for (uint32_t i = 0; i < pages_.size(); i++) addresses_.push_back(i);
    std::ranges::shuffle(addresses_, std::mt19937(11));
    std::vector<std::byte> slab(stride * (pages_.size() + 1), std::byte{0xa5});
    for (size_t i = 0; i < pages_.size(); i++) {
        const size_t at = addresses_[i] * stride + RP_BLOCK_ALIGNMENT;
        std::ranges::copy(pages_[i], slab.begin() + static_cast<std::ptrdiff_t>(at));
        addresses_[i] = static_cast<uint32_t>(at / RP_BLOCK_ALIGNMENT);
    }
    slab_ = buffer(slab);
    const TextureWords words = texture_words(tables_);
    words_ = buffer(bytes_of(words.words));
    const rp_texture_tables at = {first_page, words.images_at, words.levels_at, words.ops_at, words.maps_at, 0, 0, 0};
    at_ = buffer(std::as_bytes(std::span(&at, 1)));
    set_absent({});
}

void TextureProbe::set_absent(const std::vector<uint32_t>& pages_of_images) {
    std::vector<rp_page> table(first_page, {RP_NONE, 0, 0, 0});
    for (const uint32_t address : addresses_) table.push_back({address, 0, 0, 0});
    for (const uint32_t page : pages_of_images) table[first_page + page].address = RP_NONE;
    table_ = buffer(bytes_of(table));
}

std::vector<ProgramOutcome> TextureProbe::run_programs(const std::vector<ProgramSite>& sites, std::vector<SlotTexels>& texels,
                                                       std::vector<rp_material>& materials) {
    static_assert(sizeof(ProgramSite) == 7 * 16);
    texels.resize(sites.size());
    materials.resize(sites.size());
    SlotFields fields;
    fields.texture_words = 1 + RP_TEXEL_WORDS;
    const auto slots = PathSlots::create(*device_, static_cast<uint32_t>(sites.size()), BlockForm::stored, fields);
    require(slots.ok(), "there are no slots");
    const Buffer given = buffer(bytes_of(scene_.materials)), words = buffer(bytes_of(texels)), own = buffer(bytes_of(materials));
    auto results = run_with<ProgramOutcome>("rp_probe_programs", sites, sites.size(), given, slots->status(), words, own);
    require(device_->kernels().read_now(words, 0, std::as_writable_bytes(std::span(texels))).ok() &&
                device_->kernels().read_now(own, 0, std::as_writable_bytes(std::span(materials))).ok(),
            "results cannot be read");
    return results;
}

Kernel TextureProbe::kernel(const char* name) {
    auto probe =
        probe_kernel(*device_, "shading/texture_probe", name, "-DRP_SLABS=1 -DRP_SHORT_STATES -DRP_TEXTURES -DRP_NOISE -DRP_BUMPS -DRP_ANISOTROPIC");
    if (!probe.ok()) throw std::runtime_error(probe.status().message());
    return std::move(*probe);
}

Buffer TextureProbe::buffer(std::span<const std::byte> contents) {
    auto result = device_->upload(contents, "a test");
    if (!result.ok()) throw std::runtime_error(result.status().message());
    return std::move(*result);
}

}  // namespace raypager::support
