// The state of paths: all that kernels know of where the words of a path slot lie, what they mean, and which bits of its status word say so
// (abi/path.h has the layout). Stages ask for what they need by name; a new field of a path is added here, in abi/path.h and in
// src/wavefront/path_state.cpp.
//
// The state of a path is all that its slot holds. `status` is one word of it, and its phase, the lowest bits of that word, is what the slot is about.
//
// Planes are in one of two forms. In the full form each plane holds what abi/path.h names first. In the compact one (RP_STATUS_CAMERA,
// RP_STATUS_CONNECTED, RP_STATUS_FOUND) they still hold what the stage before has left, so that it need not be written and read again; unfolding
// brings it into the full one.
#ifndef RP_PATH_STATE_CL
#define RP_PATH_STATE_CL

#include "common/demand.cl"
#include "common/prefetch.cl"
#include "raypager/abi/block.h"
#include "raypager/abi/path.h"
#include "raypager/abi/scene.h"

// All path slots. status: runs of words (abi/path.h); planes: RP_PLANE_INDEX.
typedef struct rp_paths {
    uint slot_count;
    __global uint* status;
    __global uint4* planes;
} rp_paths;

#define RP_PLANE(paths, plane, slot) (paths)->planes[RP_PLANE_INDEX(plane, (size_t)(paths)->slot_count, slot)]

// Asks for a slot's planes, which are about to be read.
static inline void rp_prefetch_path(const rp_paths* paths, uint slot) {
    rp_prefetch(paths->status + slot);
    for (uint plane = 0u; plane < RP_PATH_PLANES; plane += 2u) rp_prefetch(&RP_PLANE(paths, plane, slot));
}
// The same of what an extension ray is read from and written to, and of what a shadow ray is read from.
static inline void rp_prefetch_extension(const rp_paths* paths, uint slot) {
    rp_prefetch(&RP_PLANE(paths, RP_PLANE_ORIGIN, slot));
    rp_prefetch(&RP_PLANE(paths, RP_PLANE_HIT, slot));
}
static inline void rp_prefetch_shadow(const rp_paths* paths, uint slot) { rp_prefetch(&RP_PLANE(paths, RP_PLANE_ORIGIN, slot)); }

// ---- What a status word says

static inline uint rp_status_of(const rp_paths* paths, uint slot) { return paths->status[slot]; }
// status: as returned by functions of this file.
static inline void rp_set_status(const rp_paths* paths, uint slot, uint status) { paths->status[slot] = status; }
static inline uint rp_phase_of(uint status) { return status & RP_PHASE_MASK; }
static inline bool rp_is_free(uint status) { return rp_phase_of(status) == RP_PHASE_FREE; }
static inline bool rp_is_idle(uint status) { return rp_phase_of(status) == RP_PHASE_IDLE; }
static inline bool rp_extends(uint status) { return rp_phase_of(status) == RP_PHASE_EXTEND; }
static inline bool rp_connects(uint status) { return rp_phase_of(status) == RP_PHASE_SHADOW; }
static inline bool rp_is_to_shade(uint status) { return rp_phase_of(status) == RP_PHASE_SHADE; }
static inline bool rp_waits_to_shade(uint status) { return rp_phase_of(status) == RP_PHASE_SHADE_WAITS; }
static inline bool rp_waits(uint status) { return rp_phase_of(status) >= RP_PHASE_EXTEND_WAITS; }
// Nothing about such a slot changes before something comes from outside: it waits, or no samples are left for it.
static inline bool rp_can_sleep(uint status) { return rp_phase_of(status) >= RP_PHASE_IDLE; }
// Has a shadow ray, which may wait.
static inline bool rp_has_shadow_ray(uint status) { return rp_phase_of(status) == RP_PHASE_SHADOW || rp_phase_of(status) == RP_PHASE_SHADOW_WAITS; }
static inline bool rp_leaves_first_vertex(uint status) { return (status & RP_STATUS_FIRST) != 0u; }
// With streams: the block that the path met last, as far as there is room for its number.
static inline uint rp_last_block_of(uint status) { return status >> RP_STATUS_BLOCK_SHIFT; }
static inline uint rp_last_block_bits(uint block) { return min(block, ~0u >> RP_STATUS_BLOCK_SHIFT) << RP_STATUS_BLOCK_SHIFT; }
static inline uint rp_offset_exponent_of(uint status) { return status >> RP_STATUS_OFFSET_SHIFT & RP_STATUS_OFFSET_MASK; }

// Of a shadow ray: whether something on its way may be nothing, and nothing has stopped it.
static inline bool rp_has_met_cutout(uint status) { return (status & RP_STATUS_MET_CUTOUT) != 0u; }
static inline uint rp_with_cutout_met(uint status, bool met) { return met ? status | RP_STATUS_MET_CUTOUT : status; }

// With streams: what becomes of the status word of a ray whose block has come. shadow: whether it is a shadow ray.
static inline uint rp_woken_status(uint status, bool shadow, uint block) {
#ifdef RP_TEXTURES
    if (rp_waits_to_shade(status)) return (status & ~RP_PHASE_MASK) | RP_PHASE_SHADE | RP_STATUS_RESUMED;
#endif
    const uint kept = RP_STATUS_OFFSET_MASK << RP_STATUS_OFFSET_SHIFT | RP_STATUS_CONNECTED | RP_STATUS_LIT | RP_STATUS_ENDS | RP_STATUS_MET_CUTOUT;
    return (status & kept) | (shadow ? RP_PHASE_SHADOW : RP_PHASE_EXTEND) | RP_STATUS_RESUMED | rp_last_block_bits(block);
}

static inline void rp_free_slot(const rp_paths* paths, uint slot) { paths->status[slot] = RP_PHASE_FREE; }
static inline void rp_retire_slot(const rp_paths* paths, uint slot) { paths->status[slot] = RP_PHASE_IDLE; }

// ---- The flags of a path: depth, whether its last scattering was specular, refraction

static inline uint rp_path_flags(uint depth, bool specular, int refraction) {
    return depth | (specular ? RP_PATH_SPECULAR : 0u) | (uint)refraction << RP_PATH_REFRACTION_SHIFT;
}
static inline uint rp_depth_of(uint flags) { return flags & RP_PATH_DEPTH_MASK; }
static inline bool rp_was_specular(uint flags) { return (flags & RP_PATH_SPECULAR) != 0u; }
static inline int rp_refraction_of(uint flags) { return (int)flags >> RP_PATH_REFRACTION_SHIFT; }

// ---- Waiting

// The word that says what a slot waits for: a block, or, with streams, the next slot of a list of its block's (RP_DEMAND_LISTS_AT).
static inline uint rp_wait_word(const rp_paths* paths, uint slot) { return paths->status[(size_t)RP_STATUS_WORDS(paths->slot_count) + slot]; }
static inline void rp_set_wait_word(const rp_paths* paths, uint slot, uint word) {
    paths->status[(size_t)RP_STATUS_WORDS(paths->slot_count) + slot] = word;
}
// The run of these words, for who reads many.
static inline const __global uint* rp_wait_words(const __global uint* status, uint slot_count) { return status + RP_STATUS_WORDS(slot_count); }

// Where a ray that has waited goes on.
static inline uint rp_block_entry_of(const rp_paths* paths, uint slot) { return RP_PLANE(paths, RP_PLANE_SURFACE, slot).w; }
static inline void rp_set_block_entry(const rp_paths* paths, uint slot, uint block_entry) {
    ((__global uint*)&RP_PLANE(paths, RP_PLANE_SURFACE, slot))[3] = block_entry;
}

// Status words of rays that wait for a block.
static inline uint rp_extension_waits(uint offset_exponent, uint kept) {
    return RP_PHASE_EXTEND_WAITS | offset_exponent << RP_STATUS_OFFSET_SHIFT | kept;
}
static inline uint rp_shadow_waits(uint status) { return RP_PHASE_SHADOW_WAITS | (status & (RP_STATUS_ENDS | RP_STATUS_MET_CUTOUT)); }

// The ray of a slot waits for a block. waiting_status: one of the two above. demand: abi/path.h.
static inline void rp_wait_for_block(const rp_paths* paths, uint slot, uint block, uint waiting_status, volatile __global uint* demand,
                                     uint block_count) {
    paths->status[slot] = waiting_status;
    rp_set_wait_word(paths, slot, block);
    rp_request(demand, block_count, block, 1u);
}

// Address on the device of what a slot waits for, by its status word and its wait word: RP_NONE, it is absent; 0, the slot does not wait.
static inline uint rp_awaited_address(const __global rp_page* pages, uint status, uint wait_word) {
    return rp_waits(status) ? pages[wait_word].address : 0u;
}

#include "common/path_runs.cl"
#ifdef RP_INSTANCES
#include "common/path_standing.cl"
#endif

#ifdef RP_CUTOUTS
static inline void rp_set_passed(const rp_paths* paths, uint slot, float distance) {
    ((__global float*)&RP_PLANE(paths, RP_PLANE_NEXT, slot))[3] = distance;
}
#endif

// ---- Camera paths

// The pixel and sample of a path under way.
static inline rp_path_sample rp_sample_of(const rp_paths* paths, uint slot, uint status) {
    rp_path_sample sample_id;
#ifdef RP_SHORT_STATES
    if (status & RP_STATUS_CAMERA) {
        sample_id.pixel = RP_PLANE(paths, RP_PLANE_ORIGIN, slot).w;
        sample_id.sample = RP_PLANE(paths, RP_PLANE_DIRECTION, slot).w;
        return sample_id;
    }
#endif
    sample_id.pixel = RP_PLANE(paths, RP_PLANE_RADIANCE, slot).w;
    sample_id.sample = RP_PLANE(paths, RP_PLANE_SURFACE, slot).z;
    return sample_id;
}

// Planes of a new camera path that are the same for every ray, apart from pixel and sample.
static inline void rp_store_initial_planes(const rp_paths* paths, uint slot, uint pixel, uint sample) {
    RP_PLANE(paths, RP_PLANE_HIT, slot) = (uint4)((uint3)(0u), RP_NONE);
    RP_PLANE(paths, RP_PLANE_SURFACE, slot) = (uint4)(0u, 0u, sample, RP_NONE);
    RP_PLANE(paths, RP_PLANE_THROUGHPUT, slot) = (uint4)(as_uint3((float3)(1.0f)), RP_PATH_SPECULAR);
    RP_PLANE(paths, RP_PLANE_RADIANCE, slot) = (uint4)((uint3)(0u), pixel);
#ifdef RP_CUTOUTS
    rp_set_passed(paths, slot, 0.0f);
#endif
}

static inline void rp_store_camera_path(const rp_paths* paths, uint slot, uint pixel, uint sample, float3 eye, float3 direction) {
#ifdef RP_FIRST_HITS
    rp_forget_first_hit(paths, slot);
#endif
#ifdef RP_SHORT_STATES
    RP_PLANE(paths, RP_PLANE_ORIGIN, slot) = (uint4)(as_uint3(eye), pixel);
    RP_PLANE(paths, RP_PLANE_DIRECTION, slot) = (uint4)(as_uint3(direction), sample);
    paths->status[slot] = RP_PHASE_EXTEND | RP_STATUS_CAMERA;
#else
    RP_PLANE(paths, RP_PLANE_ORIGIN, slot) = (uint4)(as_uint3(eye), as_uint(INFINITY));
    RP_PLANE(paths, RP_PLANE_DIRECTION, slot) = (uint4)(as_uint3(direction), as_uint(0.0f));
    rp_store_initial_planes(paths, slot, pixel, sample);
    paths->status[slot] = RP_PHASE_EXTEND;
#endif
}

// ---- Extension rays, one by one

// primitive: of the closest hit in an earlier pass, or RP_NONE. block entry: RP_NONE for a ray that has not waited.
typedef struct rp_extension_ray {
    float3 origin, direction;
    float t;
    uint primitive, block_entry;
#if defined(RP_INSTANCES) && RP_INSTANCE_LEVELS > 1
    rp_instance_chain in;  // of the instances of that hit, the numbers
#elif defined(RP_INSTANCES)
    uint number;  // of the instance of that hit, as rp_hit has it
#endif
} rp_extension_ray;

static inline rp_extension_ray rp_extension_of(const rp_paths* paths, uint slot) {
    const uint status = paths->status[slot];
    const uint4 origin = RP_PLANE(paths, RP_PLANE_ORIGIN, slot);
    uint3 direction = RP_PLANE(paths, RP_PLANE_DIRECTION, slot).xyz;
    rp_extension_ray ray;
    ray.t = INFINITY;
    ray.primitive = ray.block_entry = RP_NONE;
#if defined(RP_INSTANCES) && RP_INSTANCE_LEVELS > 1
    ray.in = rp_instances_of_hit(paths, slot, rp_phase_of(status) == RP_PHASE_EXTEND_WAITS);
#elif defined(RP_INSTANCES)
    ray.number = rp_phase_of(status) == RP_PHASE_EXTEND_WAITS ? rp_number_of_hit(paths, slot) : 0u;
#endif
    if (rp_phase_of(status) == RP_PHASE_EXTEND_WAITS) {
        ray.t = as_float(origin.w);
        ray.primitive = RP_PLANE(paths, RP_PLANE_HIT, slot).w;
        ray.block_entry = RP_PLANE(paths, RP_PLANE_SURFACE, slot).w;
    } else if (status & RP_STATUS_CONNECTED) {
        direction = RP_PLANE(paths, RP_PLANE_HIT, slot).xyz;
    }
#ifdef RP_CUTOUTS
#ifdef RP_SHORT_STATES
    else if (!(status & RP_STATUS_CAMERA))
#else
    else
#endif
        ray.t = as_float(origin.w);  // of shadow rays: where they end
#endif
    ray.origin = as_float3(origin.xyz);
    ray.direction = as_float3(direction);
    return ray;
}

// The direction alone. REQUIRES: the planes of the slot are unfolded.
static inline float3 rp_direction_of(const rp_paths* paths, uint slot) { return as_float3(RP_PLANE(paths, RP_PLANE_DIRECTION, slot).xyz); }

// What a shadow ray brings if it arrives.
static inline float3 rp_light_in(uint4 hit, uint4 surface) { return (float3)(as_float(hit.w), as_float(surface.x), as_float(surface.y)); }
static inline float3 rp_light_on_its_way(const rp_paths* paths, uint slot) {
    return rp_light_in(RP_PLANE(paths, RP_PLANE_HIT, slot), RP_PLANE(paths, RP_PLANE_SURFACE, slot));
}

// Brings the planes of an extension ray that was CONNECTED into the form of one that is not. It has no hit yet.
static inline void rp_unfold_connected(const rp_paths* paths, uint slot, uint status) {
    if (status & RP_STATUS_LIT) {
        const uint4 radiance = RP_PLANE(paths, RP_PLANE_RADIANCE, slot);
        const float3 sum = as_float3(radiance.xyz) + rp_light_on_its_way(paths, slot);
        RP_PLANE(paths, RP_PLANE_RADIANCE, slot) = (uint4)(as_uint3(sum), radiance.w);
    }
    const uint density = RP_PLANE(paths, RP_PLANE_DIRECTION, slot).w;
    RP_PLANE(paths, RP_PLANE_DIRECTION, slot) = (uint4)(RP_PLANE(paths, RP_PLANE_HIT, slot).xyz, density);
    RP_PLANE(paths, RP_PLANE_HIT, slot).w = RP_NONE;
    RP_PLANE(paths, RP_PLANE_ORIGIN, slot).w = as_uint(INFINITY);
#ifdef RP_CUTOUTS
    rp_set_passed(paths, slot, 0.0f);
#endif
}

// The same of any extension ray: what follows does not have to know in which form it was.
static inline void rp_unfold_extension(const rp_paths* paths, uint slot, uint status) {
#ifdef RP_SHORT_STATES
    if (status & RP_STATUS_CAMERA) {
        const rp_path_sample sample_id = rp_sample_of(paths, slot, status);
        RP_PLANE(paths, RP_PLANE_ORIGIN, slot).w = as_uint(INFINITY);
        RP_PLANE(paths, RP_PLANE_DIRECTION, slot).w = as_uint(0.0f);
        rp_store_initial_planes(paths, slot, sample_id.pixel, sample_id.sample);
    }
#endif
    if (status & RP_STATUS_CONNECTED) rp_unfold_connected(paths, slot, status);
}

// The closest hit of an extension ray so far. REQUIRES: the planes of the slot are unfolded.
static inline void rp_store_hit(const rp_paths* paths, uint slot, float t, float3 position, uint primitive, uint geometric_normal,
                                uint shading_normal, uint block_entry) {
    RP_PLANE(paths, RP_PLANE_ORIGIN, slot).w = as_uint(t);
    RP_PLANE(paths, RP_PLANE_HIT, slot) = (uint4)(as_uint3(position), primitive);
    const uint sample = RP_PLANE(paths, RP_PLANE_SURFACE, slot).z;
    RP_PLANE(paths, RP_PLANE_SURFACE, slot) = (uint4)(geometric_normal, shading_normal, sample, block_entry);
}

// An extension ray is done; offset_exponent: at its hit, if it has one.
static inline void rp_finish_extension(const rp_paths* paths, uint slot, uint offset_exponent) {
    paths->status[slot] = RP_PHASE_SHADE | offset_exponent << RP_STATUS_OFFSET_SHIFT;
}

#ifdef RP_SHORT_STATES
// The same, where shading finds the surface. block: RP_NONE if there is no hit in this pass; leaf: the reference of what was hit there.
static inline void rp_finish_extension_deferred(const rp_paths* paths, uint slot, uint status, uint leaf, uint block, float t) {
    if (block != RP_NONE) {
#ifdef RP_EYE_MOVES
        const uint plane = status & RP_STATUS_CONNECTED ? RP_PLANE_DIRECTION : RP_PLANE_HIT;
#else
        const uint plane = status & RP_STATUS_CAMERA ? RP_PLANE_ORIGIN : status & RP_STATUS_CONNECTED ? RP_PLANE_DIRECTION : RP_PLANE_HIT;
#endif
        __global uint* const found = (__global uint*)&RP_PLANE(paths, plane, slot);
        found[0] = leaf;
        found[1] = block;
        found[2] = as_uint(t);
    }
    paths->status[slot] = (status & ~RP_PHASE_MASK) | RP_PHASE_SHADE | (block != RP_NONE ? RP_STATUS_FOUND : 0u);
}
#endif

// ---- Shadow rays

typedef struct rp_shadow_ray {
    float3 origin, direction;
    float t_max;
    uint block_entry;  // RP_NONE: has not waited
} rp_shadow_ray;

static inline rp_shadow_ray rp_shadow_of(const rp_paths* paths, uint slot, uint status) {
    const uint4 origin = RP_PLANE(paths, RP_PLANE_ORIGIN, slot), direction = RP_PLANE(paths, RP_PLANE_DIRECTION, slot);
    rp_shadow_ray ray;
    ray.block_entry = rp_phase_of(status) == RP_PHASE_SHADOW_WAITS ? rp_block_entry_of(paths, slot) : RP_NONE;
    ray.origin = as_float3(origin.xyz);
    ray.direction = as_float3(direction.xyz);
    ray.t_max = as_float(origin.w);
    return ray;
}

// A path that has ended behind its shadow ray.
typedef struct rp_path_end {
    bool ended;
    uint pixel;
    float3 radiance;
} rp_path_end;

// The shadow ray has been traced: the path ends, its slot is free, and its radiance is for the film; or its extension ray begins, which the planes
// will show when that has been traced (RP_STATUS_CONNECTED).
static inline rp_path_end rp_finish_shadow(const rp_paths* paths, uint slot, uint status, bool occluded) {
    rp_path_end end = {false, 0u, (float3)(0.0f)};
    if (!(status & RP_STATUS_ENDS)) {
        // Of single rays these bits hold RP_STATUS_FIRST alone.
        paths->status[slot] = RP_PHASE_EXTEND | RP_STATUS_CONNECTED | (occluded ? 0u : RP_STATUS_LIT) | (status & RP_STATUS_BLOCK_MASK);
        return end;
    }
    const uint4 radiance = RP_PLANE(paths, RP_PLANE_RADIANCE, slot);
    end.ended = true;
    end.pixel = radiance.w;
    end.radiance = occluded ? as_float3(radiance.xyz) : as_float3(radiance.xyz) + rp_light_on_its_way(paths, slot);
    paths->status[slot] = RP_PHASE_FREE;
    return end;
}

#include "common/path_arrival.cl"

// ---- The rays that leave a vertex

static inline void rp_store_throughput_and_radiance(const rp_paths* paths, uint slot, float3 throughput, uint flags, float3 radiance, uint pixel) {
    RP_PLANE(paths, RP_PLANE_THROUGHPUT, slot) = (uint4)(as_uint3(throughput), flags);
    RP_PLANE(paths, RP_PLANE_RADIANCE, slot) = (uint4)(as_uint3(radiance), pixel);
}

// Status bits that a ray leaving a vertex carries. depth: scattering events before that vertex.
static inline uint rp_departing_status(uint status, uint depth) {
#ifdef RP_SHORT_STATES
    return depth == 0u ? RP_STATUS_FIRST : 0u;
#else
    return status & RP_STATUS_BLOCK_MASK;
#endif
}

// An extension ray begins. density: of its direction by solid angle, 0 if that is specular.
static inline void rp_begin_extension(const rp_paths* paths, uint slot, uint status, uint depth, float3 origin, float3 direction, float density,
                                      uint sample) {
    RP_PLANE(paths, RP_PLANE_ORIGIN, slot) = (uint4)(as_uint3(origin), as_uint(INFINITY));
    RP_PLANE(paths, RP_PLANE_DIRECTION, slot) = (uint4)(as_uint3(direction), as_uint(density));
    RP_PLANE(paths, RP_PLANE_HIT, slot) = (uint4)((uint3)(0u), RP_NONE);
    RP_PLANE(paths, RP_PLANE_SURFACE, slot) = (uint4)(0u, 0u, sample, RP_NONE);
    paths->status[slot] = RP_PHASE_EXTEND | rp_departing_status(status, depth);
}

#ifdef RP_CUTOUTS
// A shadow ray has met nothing that stops it for certain, but something that may: it is traced anew as an extension ray, whose path has its flags. In
// the queue it comes before others, as if it left the first vertex: work-items that shade together then do the same.
static inline void rp_trace_shadow_as_extension(const rp_paths* paths, uint slot, uint status) {
    const uint4 origin = RP_PLANE(paths, RP_PLANE_ORIGIN, slot), direction = RP_PLANE(paths, RP_PLANE_DIRECTION, slot);
    const uint4 hit = RP_PLANE(paths, RP_PLANE_HIT, slot), surface = RP_PLANE(paths, RP_PLANE_SURFACE, slot);
    const float3 light = rp_light_in(hit, surface);
    rp_begin_extension(paths, slot, status, 0u, as_float3(origin.xyz), as_float3(direction.xyz), 0.0f, surface.z);
    ((__global uint*)&RP_PLANE(paths, RP_PLANE_ORIGIN, slot))[3] = origin.w;
    ((__global uint*)&RP_PLANE(paths, RP_PLANE_THROUGHPUT, slot))[3] |= RP_PATH_SHADOW;
    RP_PLANE(paths, RP_PLANE_NEXT, slot) = (uint4)(hit.xyz, origin.w);
    RP_PLANE(paths, RP_PLANE_NEXT_START, slot) = (uint4)(origin.xyz, status & RP_STATUS_ENDS ? as_uint(-1.0f) : direction.w);
    RP_SLOT_WORD(paths, RP_RUN_LIGHT, slot) = as_uint(light.x);
    RP_SLOT_WORD(paths, RP_RUN_LIGHT + 1u, slot) = as_uint(light.y);
    RP_SLOT_WORD(paths, RP_RUN_LIGHT + 2u, slot) = as_uint(light.z);
}

// The shadow ray of a path that has arrived has been traced. False: the path ends. Else its extension ray is under way.
static inline bool rp_end_shadow_as_extension(const rp_paths* paths, uint slot, uint status, const rp_arrival* a, bool occluded, float3* radiance) {
    *radiance = a->radiance;
    if (!occluded)
        *radiance += (float3)(as_float(RP_SLOT_WORD(paths, RP_RUN_LIGHT, slot)), as_float(RP_SLOT_WORD(paths, RP_RUN_LIGHT + 1u, slot)),
                              as_float(RP_SLOT_WORD(paths, RP_RUN_LIGHT + 2u, slot)));
    const uint4 next = RP_PLANE(paths, RP_PLANE_NEXT, slot), start = RP_PLANE(paths, RP_PLANE_NEXT_START, slot);
    if (as_float(start.w) < 0.0f) return false;
    rp_store_throughput_and_radiance(paths, slot, a->throughput, a->flags & ~RP_PATH_SHADOW, *radiance, a->pixel);
    rp_begin_extension(paths, slot, status, 1u, as_float3(start.xyz), as_float3(next.xyz), as_float(start.w), a->sample);
    rp_set_passed(paths, slot, 0.0f);
    return true;
}

// The ray goes on as it was behind the place where it has arrived.
static inline void rp_pass_through(const rp_paths* paths, uint slot, uint status, const rp_arrival* a, float3 start) {
    rp_store_throughput_and_radiance(paths, slot, a->throughput, a->flags, a->radiance, a->pixel);
    rp_begin_extension(paths, slot, status, a->shadow ? 0u : 1u, start, a->direction, a->bsdf_density, a->sample);
    const float left = a->passed - a->distance;
    if (a->shadow) ((__global float*)&RP_PLANE(paths, RP_PLANE_ORIGIN, slot))[3] = left > 0.0f ? left : 0.0f;
    rp_set_passed(paths, slot, a->shadow ? left : a->passed + a->distance);
}
#endif

// A shadow ray begins, and keeps the extension ray behind it: next_direction and density are that one's. ends: there is none. light: what arrives if
// nothing is in the way.
static inline void rp_begin_shadow(const rp_paths* paths, uint slot, uint status, uint depth, float3 origin, float3 direction, float reach,
                                   float3 light, bool ends, float3 next_direction, float density, uint sample) {
    const uint3 arrives = as_uint3(light);
    RP_PLANE(paths, RP_PLANE_ORIGIN, slot) = (uint4)(as_uint3(origin), as_uint(reach));
    RP_PLANE(paths, RP_PLANE_DIRECTION, slot) = (uint4)(as_uint3(direction), as_uint(density));
    RP_PLANE(paths, RP_PLANE_HIT, slot) = (uint4)(as_uint3(next_direction), arrives.x);
    RP_PLANE(paths, RP_PLANE_SURFACE, slot) = (uint4)(arrives.yz, sample, RP_NONE);
    paths->status[slot] = RP_PHASE_SHADOW | (ends ? RP_STATUS_ENDS : 0u) | rp_departing_status(status, depth);
}

#endif
