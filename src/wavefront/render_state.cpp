// What a render is between two rounds: read for checkpoints and pictures, written when a render is resumed.
#include <algorithm>

#include "base/check.hpp"
#include "wavefront/wavefront.hpp"

namespace raypager {

Status Wavefront::read_film(uint64_t first_word, std::span<uint32_t> words) {
    return device_.kernels().read_now(buffers_.film, first_word * sizeof(uint32_t), std::as_writable_bytes(words));
}

Status Wavefront::write_film(uint64_t first_word, std::span<const uint32_t> words) {
    return device_.kernels().write_now(buffers_.film, first_word * sizeof(uint32_t), std::as_bytes(words));
}

Status Wavefront::read_samples_under_way(std::vector<rp_path_sample>& samples) {
    samples.clear();
    RAYPAGER_TRY(buffers_.slots.add_samples_under_way(device_.kernels(), backend_->leaves_untraced_camera_rays(), samples));
    const auto again = samples_again();
    samples.insert(samples.end(), again.begin(), again.end());
    return {};
}

// The next samples to be traced again, as many as the device has room for; the stage `generate` starts their paths.
Status Wavefront::list_samples_again() {
    const auto again = samples_again();
    listed_again_ = static_cast<uint32_t>(std::min<uint64_t>(again.size(), buffers_.again.bytes() / sizeof(rp_path_sample)));
    if (listed_again_ == 0) return {};
    RAYPAGER_CHECK(started_ - finished_ == 1);
    // The list stays as it is until the round has ended.
    return device_.kernels().write(buffers_.again, 0, std::as_bytes(again.first(listed_again_)), nullptr);
}

}  // namespace raypager
