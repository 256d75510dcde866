// A part of path_state.cl: where a ray that waits stands with respect to instances (RP_STANDING_UNITS).
#ifndef RP_PATH_STANDING_CL
#define RP_PATH_STANDING_CL

#include "common/instance.cl"

#ifdef RP_CUTOUTS
#define RP_STANDING_PLANES RP_PATH_PLANES_WITH_CUTOUTS
#else
#define RP_STANDING_PLANES RP_PATH_PLANES
#endif

#if RP_INSTANCE_LEVELS > 1
#define RP_STANDING_UNITS_OF_SLOT (RP_STANDING_UNITS * RP_INSTANCE_LEVELS)
#else
#define RP_STANDING_UNITS_OF_SLOT RP_STANDING_UNITS
#endif

static inline __global uint4* rp_standing_units(const rp_paths* paths, uint slot) {
    return paths->planes + (size_t)paths->slot_count * RP_STANDING_PLANES + (size_t)slot * RP_STANDING_UNITS_OF_SLOT;
}
#if RP_INSTANCE_LEVELS > 1
// waited: whether the ray has. Else there is no hit yet.
static inline rp_instance_chain rp_instances_of_hit(const rp_paths* paths, uint slot, bool waited) {
    const __global uint4* const units = rp_standing_units(paths, slot);
    rp_instance_chain in;
    for (uint i = 0u; i < RP_INSTANCE_LEVELS; i++) {
        in.instance[i] = 0;
        in.number[i] = waited ? units[RP_STANDING_UNITS * i + RP_STANDING_AT].z : 0u;
    }
    return in;
}

// waited: whether the ray has. Else it stands nowhere.
static inline rp_standing rp_standing_of(const rp_paths* paths, uint slot, bool waited) {
    const __global uint4* const units = rp_standing_units(paths, slot);
    rp_standing standing;
    standing.block_entry = RP_NONE;
    standing.depth = 0u;
    if (!waited || units[RP_STANDING_AT].x == RP_NONE) return standing;
    for (; standing.depth < RP_INSTANCE_LEVELS; standing.depth++) {
        const __global uint4* const level = units + RP_STANDING_UNITS * standing.depth;
        if (level[RP_STANDING_AT].x == RP_NONE) break;
        standing.block_entry = level[RP_STANDING_AT].x;
        standing.chain.number[standing.depth] = level[RP_STANDING_AT].y;
        standing.chain.instance[standing.depth] = (const __global rp_instance*)level;
        standing.entry_around[standing.depth] = level[RP_STANDING_AT].w;
    }
    return standing;
}

// Of a ray that is about to wait. ray: as it stopped; entry_around: as rp_standing has it; block_entry: as rp_stands_at has it. hit_numbers: as
// rp_hit has them, or null: of a shadow ray.
static inline void rp_set_standing(const rp_paths* paths, uint slot, const rp_ray* ray, const uint* entry_around, uint block_entry,
                                   const uint* hit_numbers) {
    __global uint4* const units = rp_standing_units(paths, slot);
    const uint depth = block_entry == RP_NONE ? 0u : rp_instance_depth(&ray->chain);
    for (uint i = 0u; i < RP_INSTANCE_LEVELS; i++) {
        __global uint4* const level = units + RP_STANDING_UNITS * i;
        const uint at = i < depth ? block_entry : RP_NONE, number = i < depth ? ray->chain.number[i] : 0u;
        level[RP_STANDING_AT] = (uint4)(at, number, hit_numbers ? hit_numbers[i] : 0u, i < depth ? entry_around[i] : RP_NONE);
        const __global uint4* const instance = (const __global uint4*)ray->chain.instance[i];
        if (i >= depth || instance == level) continue;
        for (uint k = 0u; k < RP_STANDING_AT; k++) level[k] = instance[k];
    }
}
#else
static inline uint rp_number_of_hit(const rp_paths* paths, uint slot) { return rp_standing_units(paths, slot)[RP_STANDING_AT].z; }

// waited: whether the ray has. Else it stands nowhere.
static inline rp_standing rp_standing_of(const rp_paths* paths, uint slot, bool waited) {
    const __global uint4* const units = rp_standing_units(paths, slot);
    rp_standing standing = {RP_NONE, 0u, 0};
    if (!waited) return standing;
    standing.block_entry = units[RP_STANDING_AT].x;
    standing.number = units[RP_STANDING_AT].y;
    standing.instance = (const __global rp_instance*)units;
    return standing;
}

// Of a ray that is about to wait. ray: as it stopped; block_entry: as rp_stands_at has it. hit_number: as rp_hit has it.
static inline void rp_set_standing(const rp_paths* paths, uint slot, const rp_ray* ray, uint block_entry, uint hit_number) {
    __global uint4* const units = rp_standing_units(paths, slot);
    units[RP_STANDING_AT] = (uint4)(block_entry, ray->number, hit_number, 0u);
    const __global uint4* const instance = (const __global uint4*)ray->instance;
    if (block_entry == RP_NONE || instance == units) return;
    for (uint i = 0u; i < RP_STANDING_AT; i++) units[i] = instance[i];
}

// The same of a ray of a stream. instance: null, it has its copy already. unit: the block entry, also of a ray that stands behind.
static inline void rp_set_standing_of_stream(const rp_paths* paths, uint slot, const __global rp_instance* instance, uint block_entry, uint number,
                                             uint hit_number, uint unit) {
    __global uint4* const units = rp_standing_units(paths, slot);
    units[RP_STANDING_AT] = (uint4)(block_entry, number, hit_number, unit);
    if (!instance || (const __global uint4*)instance == units) return;
    for (uint i = 0u; i < RP_STANDING_AT; i++) units[i] = ((const __global uint4*)instance)[i];
}
static inline uint rp_inner_block_entry(const rp_paths* paths, uint slot) { return rp_standing_units(paths, slot)[RP_STANDING_AT].w; }
#endif

#endif
