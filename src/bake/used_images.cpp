#include "bake/used_images.hpp"

#include <algorithm>

namespace raypager {
namespace {

bool reads_image(const rp_texture_op& op) { return (op.op & RP_TEXTURE_OPERATION_MASK) == RP_TEXTURE_IMAGE; }

}  // namespace

std::vector<uint32_t> used_images(const Scene& scene) {
    std::vector<uint32_t> used;
    for (const rp_texture_op& op : scene.texture_ops)
        if (reads_image(op)) used.push_back(op.image);
    std::ranges::sort(used);
    used.erase(std::unique(used.begin(), used.end()), used.end());
    return used;
}

std::vector<rp_texture_op> baked_texture_ops(const Scene& scene) {
    const std::vector<uint32_t> used = used_images(scene);
    std::vector<rp_texture_op> ops = scene.texture_ops;
    for (rp_texture_op& op : ops)
        if (reads_image(op)) op.image = static_cast<uint32_t>(std::ranges::lower_bound(used, op.image) - used.begin());
    return ops;
}

}  // namespace raypager
