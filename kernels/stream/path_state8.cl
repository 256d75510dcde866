// The state of paths for streams (path_state.cl, of which this is a part): eight slots at a time, one word of all of them in a vector.
#ifndef RP_PATH_STATE8_CL
#define RP_PATH_STATE8_CL

#include "common/path_state.cl"
#include "stream/transpose.cl"

static inline int8 rp_have_waited8(uint8 status) { return (status & RP_STATUS_RESUMED) != 0u; }

// A plane and the one beside it (RP_PLANE_PAIR) of eight slots: words[k] is word k of all of them; the second plane's begin with 4.
static inline void rp_read_planes8(const rp_paths* paths, uint plane, const uint* slot, uint8* words) {
#pragma unroll
    for (uint i = 0u; i < 8u; i++) words[i] = vload8(0, (const __global uint*)&RP_PLANE(paths, plane, slot[i]));
    rp_transpose8(words);
}

// As rp_extension_ray; density and sample go with the ray, since its planes may have to be written anew.
typedef struct rp_extension_rays8 {
    uint8 origin[3], direction[3], t, primitive, block_entry, density, sample;
} rp_extension_rays8;

static inline void rp_extensions_of8(const rp_paths* paths, const uint* slot, uint8 status, rp_extension_rays8* rays) {
    uint8 ray[8], hit[8];
    rp_read_planes8(paths, RP_PLANE_ORIGIN, slot, ray);
    rp_read_planes8(paths, RP_PLANE_HIT, slot, hit);
    const int8 connected = (status & RP_STATUS_CONNECTED) != 0u;
#pragma unroll
    for (uint a = 0u; a < 3u; a++) {
        rays->origin[a] = ray[a];
        rays->direction[a] = connected ? hit[a] : ray[4u + a];
    }
    rays->t = connected ? as_uint8((float8)(INFINITY)) : ray[3];
    rays->primitive = connected ? (uint8)(RP_NONE) : hit[3];
    rays->block_entry = rp_have_waited8(status) ? hit[7] : (uint8)(RP_NONE);
    rays->density = ray[7];
    rays->sample = hit[6];
}

// As rp_shadow_ray, of which the block entry is not read.
typedef struct rp_shadow_rays8 {
    uint8 origin[3], direction[3], t_max;
} rp_shadow_rays8;

static inline void rp_shadows_of8(const rp_paths* paths, const uint* slot, rp_shadow_rays8* rays) {
    uint8 ray[8];
    rp_read_planes8(paths, RP_PLANE_ORIGIN, slot, ray);
#pragma unroll
    for (uint a = 0u; a < 3u; a++) {
        rays->origin[a] = ray[a];
        rays->direction[a] = ray[4u + a];
    }
    rays->t_max = ray[3];
}

// The surfaces at the hits of eight extension rays of a stream, laid out for their slots. block entry: RP_NONE for rays that are done.
typedef struct rp_hits8 {
    uint8 position[3], primitive, geometric_normal, shading_normal, t, block_entry, density, sample;
} rp_hits8;

// rows[k]: for rp_store_stream_extension of ray k.
static inline void rp_lay_out_hits8(const rp_hits8* hits, uint8 status, uint8* rows) {
    const int8 stays_connected = ((status & RP_STATUS_CONNECTED) != 0u) & (hits->block_entry == RP_NONE);
    rows[0] = hits->position[0];
    rows[1] = hits->position[1];
    rows[2] = hits->position[2];
    rows[3] = hits->primitive;
    rows[4] = hits->geometric_normal;
    rows[5] = hits->shading_normal;
    rows[6] = stays_connected ? hits->t : hits->sample;
    rows[7] = stays_connected ? hits->density : hits->block_entry;
    rp_transpose8(rows);
}

// The state of an extension ray behind a pass in a stream. Returns what of its status word stays (for rp_extension_waits and
// rp_finish_stream_extension). has_hit: a hit was found in this pass; row: of rp_lay_out_hits8 then.
static inline uint rp_store_stream_extension(const rp_paths* paths, uint slot, uint status, bool has_hit, float t, uint block_entry, uint8 row) {
    uint connected = status & (RP_STATUS_CONNECTED | RP_STATUS_LIT);
    if (has_hit) {
        if (connected != 0u && block_entry != RP_NONE) {
            rp_unfold_connected(paths, slot, status);
            connected = 0u;
        }
        if (connected == 0u) RP_PLANE(paths, RP_PLANE_ORIGIN, slot).w = as_uint(t);
        vstore8(row, 0, (__global uint*)&RP_PLANE(paths, connected != 0u ? RP_PLANE_ORIGIN : RP_PLANE_HIT, slot));
    } else if (block_entry != RP_NONE) {
        rp_set_block_entry(paths, slot, block_entry);
    } else if (connected != 0u) {
        RP_PLANE(paths, RP_PLANE_ORIGIN, slot).w = RP_NONE;
    }
    return connected;
}

// kept: see rp_store_stream_extension; last_block: bits of the status word (rp_last_block_bits).
static inline void rp_finish_stream_extension(const rp_paths* paths, uint slot, uint offset_exponent, uint kept, uint last_block) {
    paths->status[slot] = RP_PHASE_SHADE | offset_exponent << RP_STATUS_OFFSET_SHIFT | kept | last_block;
}
static inline uint rp_kept_last_block(uint status) { return status & RP_STATUS_BLOCK_MASK; }

#endif
