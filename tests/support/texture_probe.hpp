// Images, maps and programs of a scene on a device, and kernels that look them up outside of any render (kernels/shading/texture_probe.cl).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <vector>

#include "block/baked_scene.hpp"
#include "device/device.hpp"
#include "raypager/scene.hpp"

namespace raypager::support {

struct ProgramSite {
    float position[3] = {}, u = 0, normal[3] = {0, 0, 1}, v = 0, tangent[3] = {1, 0, 0}, density = 1;
    float bitangent[3] = {0, 1, 0}, width = 0, shading[3] = {0, 0, 1};
    uint32_t flips = 0, pixel = 0, sample = 0, depth = 1, shading_normal = 0;
    uint32_t material = 0, have = 0, unused[2] = {};
};

struct ProgramOutcome {
    uint32_t done, absent, have, shading_normal;
};

using SlotTexels = std::array<uint32_t, RP_TEXEL_WORDS>;

// Functions throw where the device fails.
class TextureProbe {
public:
    // All pages lie in one slab, in an order of their own. REQUIRES: images that can be read.
    explicit TextureProbe(const Scene& scene);
    const BakedScene& tables() const { return tables_; }
    uint32_t page_count() const { return static_cast<uint32_t>(pages_.size()); }
    const std::vector<std::byte>& page(uint32_t number) const { return pages_[number]; }
    // Of the first page of images, in the page table.
    static constexpr uint32_t first_page = 5;
    void set_absent(const std::vector<uint32_t>& pages_of_images);

    template <class Out, class Item>
    std::vector<Out> run(const char* name, const std::vector<Item>& items, size_t count) {
        return run_with<Out>(name, items, count);
    }
    // texels: of each site; those that are missing are 0.
    std::vector<ProgramOutcome> run_programs(const std::vector<ProgramSite>& sites, std::vector<SlotTexels>& texels,
                                             std::vector<rp_material>& materials);

private:
    Kernel kernel(const char* name);
    Buffer buffer(std::span<const std::byte> contents);
    template <class Out, class Item, class... More>
    std::vector<Out> run_with(const char* name, const std::vector<Item>& items, size_t count, const More&... more) {
        Kernel probe = kernel(name);
        std::vector<Out> results(count);
        const Buffer in = buffer(bytes_of(items)), out = buffer(bytes_of(results));
        const bool done = probe.set(table_, slab_, words_, at_, in, static_cast<uint32_t>(count), out, more...).ok() &&
                          device_->kernels().launch(probe, count, 1).ok() &&
                          device_->kernels().read_now(out, 0, std::as_writable_bytes(std::span(results))).ok();
        if (!done) throw std::runtime_error("the kernel did not run");
        return results;
    }

    const Scene& scene_;
    BakedScene tables_;
    std::vector<std::vector<std::byte>> pages_;
    std::vector<uint32_t> addresses_;
    std::unique_ptr<Device> device_;
    Buffer table_, slab_, words_, at_;
};

}  // namespace raypager::support
