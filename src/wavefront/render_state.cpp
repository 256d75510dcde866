// What a render is between two rounds: read for checkpoints and pictures, written when a render is resumed.
#include <algorithm>

#include "base/check.hpp"
#include "wavefront/wavefront.hpp"

namespace raypager {
namespace {

constexpr uint64_t slots_at_once = uint64_t{1} << 16;  // bounds the host memory for reading path slots

struct Plane {
    uint32_t x, y, z, w;
};
static_assert(sizeof(Plane) == 16);

}  // namespace

Status Wavefront::read_film(uint64_t first_word, std::span<uint32_t> words) {
    return device_.kernels().read_now(film_, first_word * sizeof(uint32_t), std::as_writable_bytes(words));
}

Status Wavefront::write_film(uint64_t first_word, std::span<const uint32_t> words) {
    return device_.kernels().write_now(film_, first_word * sizeof(uint32_t), std::as_bytes(words));
}

Status Wavefront::read_samples_under_way(std::vector<rp_path_sample>& samples) {
    samples.clear();
    const uint64_t slots = params_.slot_count;
    std::vector<uint32_t> status(std::min(slots, slots_at_once));
    // Between rounds a slot has a camera ray that has not been traced at all only where rays are recorded: one that found the log of visits full.
    const bool recorded = visit_settings_.capacity > 0;
    std::vector<Plane> begun(recorded ? 2 * status.size() : 0), radiance(2 * status.size()), surface(2 * status.size());
    for (uint64_t first = 0; first < slots; first += slots_at_once) {
        const uint64_t count = std::min(slots - first, slots_at_once);
        const auto read_pair = [&](uint32_t plane, std::vector<Plane>& target) {
            return device_.kernels().read_now(paths_, RP_PLANE_INDEX(plane - plane % 2, slots, first) * sizeof(Plane),
                                              std::as_writable_bytes(std::span(target).first(2 * count)));
        };
        RAYPAGER_TRY(device_.kernels().read_now(status_, first * sizeof(uint32_t), std::as_writable_bytes(std::span(status).first(count))));
        if (recorded) RAYPAGER_TRY(read_pair(RP_PLANE_ORIGIN, begun));
        RAYPAGER_TRY(read_pair(RP_PLANE_RADIANCE, radiance));
        RAYPAGER_TRY(read_pair(RP_PLANE_SURFACE, surface));
        for (uint64_t i = 0; i < count; i++) {
            const uint32_t phase = status[i] & RP_STATUS_MASK;
            if (phase == RP_STATUS_FREE || phase == RP_STATUS_IDLE) continue;
            const Plane &of_radiance = radiance[2 * i + RP_PLANE_RADIANCE % 2], &of_surface = surface[2 * i + RP_PLANE_SURFACE % 2];
            const bool begins = !as_on_cpus() && (status[i] & RP_STATUS_CAMERA) != 0;
            RAYPAGER_CHECK(recorded || !begins);
            if (begins)
                samples.push_back({begun[2 * i + RP_PLANE_ORIGIN % 2].w, begun[2 * i + RP_PLANE_DIRECTION % 2].w});
            else
                samples.push_back({of_radiance.w, of_surface.z});
        }
    }
    const auto again = samples_again();
    samples.insert(samples.end(), again.begin(), again.end());
    return {};
}

// The next samples to be traced again, as many as the device has room for; the stage `generate` starts their paths.
Status Wavefront::list_samples_again() {
    const auto again = samples_again();
    listed_again_ = static_cast<uint32_t>(std::min<uint64_t>(again.size(), again_.bytes() / sizeof(rp_path_sample)));
    if (listed_again_ == 0) return {};
    RAYPAGER_CHECK(started_ - finished_ == 1);
    // The list stays as it is until the round has ended.
    return device_.kernels().write(again_, 0, std::as_bytes(again.first(listed_again_)), nullptr);
}

}  // namespace raypager
