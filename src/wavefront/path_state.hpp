// Path slots on the device: their size, and what the host reads from them and writes to them. With kernels/common/path_state.cl the only code that
// knows where the words of a slot lie and what its status word says (abi/path.h).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "block/baked_scene.hpp"
#include "device/device.hpp"
#include "film/film_layout.hpp"
#include "raypager/abi/path.h"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// A ray of a slot, for measurements: an extension ray if t_max is infinite. direction: unit.
struct SlotRay {
    Float3 origin;
    float t_max;
    Float3 direction;
};
// camera: an extension ray as `generate` leaves it.
enum class SlotRayKind { camera, extension, shadow };

// The closest hit of an extension ray. primitive: RP_NONE if there is none. normal: geometric, octahedral.
struct SlotHit {
    Float3 position;
    uint32_t primitive = RP_NONE, normal = 0;
    float t = 0;
};

// What the slots of some scenes have beside the rest, as runs of words (abi/path.h).
struct SlotFields {
    bool vertex_colors = false, uvs = false;
    uint32_t texture_words = 0;  // the cone of a ray and texels, and with cut-outs what a shadow ray brings
    bool cutouts = false;        // and two planes more
    bool tangents = false;
    uint32_t instance_levels = 0;  // where a ray that waits stands in each
    bool traits = false;           // of the instance of the closest hit
    bool hit_ids = false;          // of that instance and its object
    bool first_hits = false;       // what the camera ray met
    static SlotFields of(const BakedScene& scene, const FilmLayout& film = FilmLayout());
    // Of 16 bytes, with all else that follows them.
    uint64_t planes() const { return (cutouts ? RP_PATH_PLANES_WITH_CUTOUTS : RP_PATH_PLANES) + instance_levels * RP_STANDING_UNITS; }
    uint64_t runs() const {
        return 2 + (vertex_colors ? 1 : 0) + (uvs ? 3 : 0) + (tangents ? 1 : 0) + (traits ? 1 : 0) + texture_words + layer_words();
    }
    uint64_t layer_words() const { return (hit_ids ? 2 : 0) + (first_hits ? 2 : 0); }
};

class PathSlots {
public:
    // Bytes on the device: of a slot, of all that does not grow with their number, and of the largest buffer's share of a slot.
    static uint64_t bytes_per_slot(const SlotFields& fields);
    static uint64_t fixed_bytes(const SlotFields& fields);
    static uint64_t largest_part_per_slot(const SlotFields& fields);
    // Slots without contents; clear() makes them free. form: of the blocks, which says how rays are traced: the two ways leave planes in different
    // forms (RP_STATUS_CAMERA, RP_STATUS_CONNECTED).
    static Result<PathSlots> create(Device& device, uint32_t count, BlockForm form, const SlotFields& fields);
    Status clear(Queue& queue) const;
    // Those that no samples were left for are free again. REQUIRES: no round is under way.
    Status free_idle(Queue& queue) const;

    // For kernels.
    uint32_t count() const { return count_; }
    const Buffer& status() const { return status_; }
    const Buffer& planes() const { return planes_; }

    // Adds the samples whose paths are under way. untraced: there may be camera rays that no stage has traced yet.
    // REQUIRES: no round is under way.
    Status add_samples_under_way(Queue& queue, bool untraced, std::vector<rp_path_sample>& samples) const;

    // For measurements. Slot i gets ray i, of a path of which nothing else matters.
    Status write_rays(Queue& queue, std::span<const SlotRay> rays, SlotRayKind kind) const;
    // Of the first `count` slots, whose rays have been traced to their surfaces.
    Status read_hits(Queue& queue, size_t count, std::vector<SlotHit>& hits) const;
    // The distances at which extension rays ended, INFINITY without a hit.
    Status read_distances(Queue& queue, size_t count, std::vector<float>& distances) const;
    // Which shadow rays were occluded.
    Status read_occluded(Queue& queue, size_t count, std::vector<bool>& occluded) const;
    // Both have as many slots.
    Status copy_to(Queue& queue, PathSlots& other) const;

private:
    bool is_camera_ray(uint32_t status) const;

    uint32_t count_ = 0;
    BlockForm form_ = BlockForm::stored;
    Buffer status_, planes_;
};

}  // namespace raypager
