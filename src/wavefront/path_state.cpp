#include "wavefront/path_state.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "base/check.hpp"

namespace raypager {
namespace {

constexpr uint64_t slots_at_once = uint64_t{1} << 16;  // bounds the host memory for reading path slots

struct Plane {
    uint32_t x, y, z, w;
};
static_assert(sizeof(Plane) == 16);
using PlanePair = std::array<Plane, 2>;  // as they lie beside each other (RP_PLANE_PAIR)

uint32_t bits(float v) { return std::bit_cast<uint32_t>(v); }
float number(uint32_t v) { return std::bit_cast<float>(v); }
Float3 numbers(const Plane& p) { return {number(p.x), number(p.y), number(p.z)}; }

const Plane& of_pair(const PlanePair& pair, uint32_t plane) { return pair[plane % 2]; }

// The pair that a plane is in, of slots from `first` on.
Status read_pairs(Queue& queue, const PathSlots& slots, uint32_t plane, uint64_t first, std::span<PlanePair> pairs) {
    return queue.read_now(slots.planes(), RP_PLANE_INDEX(uint64_t{plane} - plane % 2, uint64_t{slots.count()}, first) * sizeof(Plane),
                          std::as_writable_bytes(pairs));
}

Status read_statuses(Queue& queue, const PathSlots& slots, uint64_t first, std::span<uint32_t> statuses) {
    return queue.read_now(slots.status(), first * sizeof(uint32_t), std::as_writable_bytes(statuses));
}

}  // namespace

SlotFields SlotFields::of(const BakedScene& scene, const FilmLayout& film) {
    const bool cutouts = scene.has_cutouts();
    const uint32_t texture_words = scene.has_textures() ? 1 + scene.texel_words() + (cutouts ? 3 : 0) : 0;
    return {scene.has_vertex_colors(), scene.has_uvs(),         texture_words,      cutouts,
            scene.has_tangents(),      scene.instance_levels(), scene.has_traits(), film.needs_ids() && scene.instances > 0,
            film.needs_first_hits()};
}

uint64_t PathSlots::bytes_per_slot(const SlotFields& fields) { return fields.planes() * sizeof(Plane) + fields.runs() * sizeof(uint32_t); }
uint64_t PathSlots::fixed_bytes(const SlotFields& fields) { return fields.runs() * RP_SLEEP_GROUP * sizeof(uint32_t); }
uint64_t PathSlots::largest_part_per_slot(const SlotFields& fields) {
    return std::max<uint64_t>(fields.planes() * sizeof(Plane), fields.runs() * sizeof(uint32_t));
}

Result<PathSlots> PathSlots::create(Device& device, uint32_t count, BlockForm form, const SlotFields& fields) {
    PathSlots slots;
    slots.count_ = count;
    slots.form_ = form;
    auto status = device.allocate(fields.runs() * RP_STATUS_WORDS(uint64_t{count}) * sizeof(uint32_t), "path states");
    if (!status) return status.status();
    slots.status_ = std::move(*status);
    auto planes = device.allocate(uint64_t{count} * fields.planes() * sizeof(Plane), "path slots");
    if (!planes) return planes.status();
    slots.planes_ = std::move(*planes);
    return slots;
}

Status PathSlots::clear(Queue& queue) const {
    static_assert(RP_PHASE_FREE == 0);
    return queue.fill_zero(status_, 0, status_.bytes());
}

Status PathSlots::free_idle(Queue& queue) const {
    std::vector<uint32_t> statuses(std::min<uint64_t>(count_, slots_at_once));
    for (uint64_t first = 0; first < count_; first += slots_at_once) {
        const auto some = std::span(statuses).first(std::min<uint64_t>(count_ - first, slots_at_once));
        RAYPAGER_TRY(read_statuses(queue, *this, first, some));
        std::replace_if(
            some.begin(), some.end(), [](uint32_t status) { return (status & RP_PHASE_MASK) == RP_PHASE_IDLE; }, RP_PHASE_FREE);
        RAYPAGER_TRY(queue.write_now(status_, first * sizeof(uint32_t), std::as_bytes(some)));
    }
    return {};
}

// With streams this bit is of a block's number, as RP_STATUS_FOUND is.
bool PathSlots::is_camera_ray(uint32_t status) const { return form_ == BlockForm::stored && (status & RP_STATUS_CAMERA) != 0; }

Status PathSlots::add_samples_under_way(Queue& queue, bool untraced, std::vector<rp_path_sample>& samples) const {
    const uint64_t most = std::min<uint64_t>(count_, slots_at_once);
    std::vector<uint32_t> statuses(most);
    std::vector<PlanePair> ray(untraced ? most : 0), radiance(most), surface(most);
    for (uint64_t first = 0; first < count_; first += slots_at_once) {
        const uint64_t count = std::min<uint64_t>(count_ - first, slots_at_once);
        RAYPAGER_TRY(read_statuses(queue, *this, first, std::span(statuses).first(count)));
        if (untraced) RAYPAGER_TRY(read_pairs(queue, *this, RP_PLANE_ORIGIN, first, std::span(ray).first(count)));
        RAYPAGER_TRY(read_pairs(queue, *this, RP_PLANE_RADIANCE, first, std::span(radiance).first(count)));
        RAYPAGER_TRY(read_pairs(queue, *this, RP_PLANE_SURFACE, first, std::span(surface).first(count)));
        for (uint64_t i = 0; i < count; i++) {
            const uint32_t phase = statuses[i] & RP_PHASE_MASK;
            if (phase == RP_PHASE_FREE || phase == RP_PHASE_IDLE) continue;
            const bool camera = is_camera_ray(statuses[i]);
            RAYPAGER_CHECK(untraced || !camera);
            samples.push_back(camera ? rp_path_sample{of_pair(ray[i], RP_PLANE_ORIGIN).w, of_pair(ray[i], RP_PLANE_DIRECTION).w}
                                     : rp_path_sample{of_pair(radiance[i], RP_PLANE_RADIANCE).w, of_pair(surface[i], RP_PLANE_SURFACE).z});
        }
    }
    return {};
}

Status PathSlots::write_rays(Queue& queue, std::span<const SlotRay> rays, SlotRayKind kind) const {
    RAYPAGER_CHECK(rays.size() <= count_);
    std::vector<PlanePair> pairs(std::min<size_t>(rays.size(), slots_at_once));
    const auto write = [&](uint32_t plane, auto contents) -> Status {
        for (size_t first = 0; first < rays.size(); first += pairs.size()) {
            const std::span<const SlotRay> some = rays.subspan(first, std::min(rays.size() - first, pairs.size()));
            std::transform(some.begin(), some.end(), pairs.begin(), contents);
            RAYPAGER_TRY(queue.write_now(planes_, RP_PLANE_INDEX(uint64_t{plane}, uint64_t{count_}, first) * sizeof(Plane),
                                         std::as_bytes(std::span(pairs).first(some.size()))));
        }
        return {};
    };
    static_assert(RP_PLANE_ORIGIN % 2 == 0 && RP_PLANE_DIRECTION == RP_PLANE_ORIGIN + 1 && RP_PLANE_HIT % 2 == 0 &&
                  RP_PLANE_SURFACE == RP_PLANE_HIT + 1 && RP_PLANE_THROUGHPUT % 2 == 0 && RP_PLANE_RADIANCE == RP_PLANE_THROUGHPUT + 1);
    // As camera rays these are of pixel bits(t_max), which nobody asks for, and sample 0.
    RAYPAGER_TRY(write(RP_PLANE_ORIGIN, [](const SlotRay& r) {
        return PlanePair{Plane{bits(r.origin.x), bits(r.origin.y), bits(r.origin.z), bits(r.t_max)},
                         Plane{bits(r.direction.x), bits(r.direction.y), bits(r.direction.z), 0}};
    }));
    RAYPAGER_TRY(write(RP_PLANE_THROUGHPUT, [](const SlotRay&) { return PlanePair{}; }));
    RAYPAGER_TRY(write(RP_PLANE_HIT, [&](const SlotRay&) {
        return PlanePair{Plane{0, 0, 0, kind == SlotRayKind::shadow ? 0 : RP_NONE}, Plane{0, 0, 0, RP_NONE}};
    }));
    const std::vector<uint32_t> statuses(rays.size(), kind == SlotRayKind::shadow   ? RP_PHASE_SHADOW
                                                      : kind == SlotRayKind::camera ? RP_PHASE_EXTEND | RP_STATUS_CAMERA
                                                                                    : RP_PHASE_EXTEND);
    return queue.write_now(status_, 0, std::as_bytes(std::span(statuses)));
}

Status PathSlots::read_hits(Queue& queue, size_t count, std::vector<SlotHit>& hits) const {
    std::vector<PlanePair> ray(count), hit(count);
    RAYPAGER_TRY(read_pairs(queue, *this, RP_PLANE_ORIGIN, 0, ray));
    RAYPAGER_TRY(read_pairs(queue, *this, RP_PLANE_HIT, 0, hit));
    hits.clear();
    for (size_t i = 0; i < count; i++) {
        const Plane &found = of_pair(hit[i], RP_PLANE_HIT), &surface = of_pair(hit[i], RP_PLANE_SURFACE);
        hits.push_back({numbers(found), found.w, surface.x, number(of_pair(ray[i], RP_PLANE_ORIGIN).w)});
    }
    return {};
}

Status PathSlots::read_distances(Queue& queue, size_t count, std::vector<float>& distances) const {
    std::vector<PlanePair> ray(count), hit(count);
    std::vector<uint32_t> statuses(count);
    RAYPAGER_TRY(read_pairs(queue, *this, RP_PLANE_ORIGIN, 0, ray));
    RAYPAGER_TRY(read_pairs(queue, *this, RP_PLANE_HIT, 0, hit));
    RAYPAGER_TRY(read_statuses(queue, *this, 0, statuses));
    distances.clear();
    for (size_t i = 0; i < count; i++) {
        const Plane &origin = of_pair(ray[i], RP_PLANE_ORIGIN), &found = is_camera_ray(statuses[i]) ? origin : of_pair(hit[i], RP_PLANE_HIT);
        const bool surface_to_be_found = form_ == BlockForm::stored && (statuses[i] & RP_STATUS_FOUND) != 0;
        distances.push_back(number(surface_to_be_found ? found.z : origin.w));
    }
    return {};
}

Status PathSlots::read_occluded(Queue& queue, size_t count, std::vector<bool>& occluded) const {
    std::vector<uint32_t> statuses(count);
    RAYPAGER_TRY(read_statuses(queue, *this, 0, statuses));
    occluded.clear();
    for (const uint32_t status : statuses) occluded.push_back((status & RP_STATUS_LIT) == 0);
    return {};
}

Status PathSlots::copy_to(Queue& queue, PathSlots& other) const {
    RAYPAGER_CHECK(count_ == other.count_);
    RAYPAGER_TRY(queue.copy(status_, other.status_));
    return queue.copy(planes_, other.planes_);
}

}  // namespace raypager
