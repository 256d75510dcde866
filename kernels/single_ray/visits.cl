// Recording which blocks rays enter (abi/visits.h). Everything here exists only where a kernel is built with RP_RECORD; without it the
// macros leave nothing behind.
//
// Nothing is lost when the log is full: a ray that finds no room stops where it is, as if the next block were absent, and the next round
// wakes it. So for a render to end the log has to hold two events, and all blocks that a shadow ray may pass (rp_visit_candidates).
#ifndef RP_VISITS_CL
#define RP_VISITS_CL

#ifdef RP_RECORD

#include "common/geometry.cl"
#include "common/path_state.cl"
#include "raypager/abi/visits.h"

// One pass of a ray.
typedef struct rp_visit_log {
    volatile __global uint* words;
    uint pixel, sample;
    uint head, kind;  // where its first event will be written, and its kind
    uint stopped_by;  // a block that stops the shadow ray, or RP_VISIT_NO_BLOCK
    bool on;          // whether this path is recorded
} rp_visit_log;

// Last parameter of kernels that record, and the argument that hands it on.
#define RP_VISIT_PARAMETER , volatile __global uint* restrict visit_words
#define RP_VISIT_ARGUMENT , visit_words

// Spreads the paths that are recorded evenly over pixels and samples (finalizer of MurmurHash3, Appleby 2011, over both).
static inline uint rp_path_hash(uint pixel, uint sample) {
    uint h = pixel ^ sample * 0x9e3779b9u;
    h = (h ^ h >> 16) * 0x85ebca6bu;
    h = (h ^ h >> 13) * 0xc2b2ae35u;
    return h ^ h >> 16;
}

// Room for one event, or RP_NONE.
static inline uint rp_visit_reserve(const rp_visit_log* log) {
    const uint at = atomic_inc(log->words + RP_VISIT_RESERVED);
    return at < log->words[RP_VISIT_CAPACITY] ? at : RP_NONE;
}

static inline void rp_visit_write(const rp_visit_log* log, uint at, uint kind, uint block) {
    volatile __global uint* event = log->words + RP_VISIT_HEADER + RP_VISIT_WORDS * (size_t)at;
    event[0] = log->pixel;
    event[1] = log->sample;
    event[2] = kind << RP_VISIT_KIND_SHIFT | (block & RP_VISIT_BLOCK_MASK);
}

// False if there is no room. True, and nothing is done, for paths that are not recorded.
static inline bool rp_visit_add(const rp_visit_log* log, uint kind, uint block) {
    if (!log->on) return true;
    const uint at = rp_visit_reserve(log);
    if (at == RP_NONE) return false;
    rp_visit_write(log, at, kind, block);
    return true;
}

// Begins a pass of the ray in a slot; kind: that of its first event. False if the log is full: then the ray must be left as it is, for the
// next round. If it had waited for a block, which may be gone by then, it wants that again.
static inline bool rp_visit_begin(rp_visit_log* log, const rp_geometry* g, volatile __global uint* words, volatile __global uint* demand,
                                  uint block_count, const rp_paths* paths, uint slot, uint begin_kind, uint resume_kind) {
    const uint status = rp_status_of(paths, slot);
    const rp_path_sample sample_id = rp_sample_of(paths, slot, status);
    log->words = words;
    log->pixel = sample_id.pixel;
    log->sample = sample_id.sample;
    const bool resumed = rp_waits(status);
    log->kind = resumed ? resume_kind : begin_kind;
    log->stopped_by = RP_VISIT_NO_BLOCK;
    log->on = rp_path_hash(log->pixel, log->sample) <= words[RP_VISIT_THRESHOLD];
    log->head = log->on ? rp_visit_reserve(log) : 0u;
    if (log->head != RP_NONE) return true;
    if (resumed) rp_request(demand, block_count, rp_block_entry_block(g, rp_block_entry_of(paths, slot)), 1u);
    return false;
}

// Ends it. block: what its first event tells.
static inline void rp_visit_end(const rp_visit_log* log, uint block) {
    if (log->on) rp_visit_write(log, log->head, log->kind, block);
}

// A shadow ray ends in this block. The first is kept for its head, so that it cannot be lost; further ones are logged if there is room.
static inline void rp_visit_stop(rp_visit_log* log, uint block) {
    if (log->stopped_by == RP_VISIT_NO_BLOCK)
        log->stopped_by = block;
    else
        (void)rp_visit_add(log, RP_VISIT_STOPS, block);
}

// Logs every block that a shadow ray passes up to t_limit, in the order of rp_traverse_any: the top tree alone, no geometry. False if the log
// is full; then the ray's next head tells that what was written so far is to be forgotten.
static bool rp_visit_candidates(const rp_visit_log* log, const rp_geometry* g, const rp_ray* ray, float t_limit) {
    uint stack[RP_STACK_SIZE];
    const float3 origin = (float3)(g->top_grid.origin[0], g->top_grid.origin[1], g->top_grid.origin[2]);
    const float3 cell = (float3)(g->top_grid.cell[0], g->top_grid.cell[1], g->top_grid.cell[2]);
    const rp_grid_ray grid_ray = rp_make_grid_ray(ray, origin, cell);
    const float far = t_limit * RP_BOX_WIDEN;
    uint depth = 0u, current = g->top_grid.root, last = RP_NONE;
    stack[depth++] = RP_REF_EXIT;
    while (current != RP_REF_EXIT) {
        if (current >= RP_REF_BLOCK_ENTRY && (current & ~RP_REF_BLOCK_ENTRY) >= g->top_grid.block_entry_count) {
            current = rp_beneath_block(g, current);
            continue;
        }
        if (current & RP_REF_LEAF) {
            const uint block = g->block_entries[2u * (current & ~RP_REF_BLOCK_ENTRY)].w;
            if (block != last && !rp_visit_add(log, RP_VISIT_ENTER, block)) return false;
            last = block;
            current = stack[--depth];
            continue;
        }
        const uint4 child0 = g->top_nodes[2u * current], child1 = g->top_nodes[2u * current + 1u];
        const bool hit0 = rp_box_is_met(rp_box_entry(child0, ray, &grid_ray), rp_box_exit(child0, ray, &grid_ray, far));
        const bool hit1 = rp_box_is_met(rp_box_entry(child1, ray, &grid_ray), rp_box_exit(child1, ray, &grid_ray, far));
        if (hit0 && hit1) stack[depth++] = child1.w;
        current = hit0 ? child0.w : hit1 ? child1.w : stack[--depth];
    }
    return true;
}

#else
#define RP_VISIT_PARAMETER
#define RP_VISIT_ARGUMENT
#endif

#endif
