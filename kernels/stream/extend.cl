// On CPUs, what single_ray/extend.cl does, with streams of rays over the wide form of the blocks, surfaces included. In a render this is a part
// of stream/trace.cl.
#include "common/noinline.cl"
#include "common/path_state.cl"
#include "common/queue.cl"
#include "stream/stream_slots.cl"
#include "stream/traverse.cl"
#include "common/waiting_lists.cl"
#include "stream/wide_surface.cl"

// What is known of the rays of a stream beside their paths through space.
typedef struct rp_extend_rays {
    uint first, count;  // in the queue
    uint slot[RP_STREAM_RAYS], sample[RP_STREAM_RAYS], block_entry[RP_STREAM_RAYS], status[RP_STREAM_RAYS], density[RP_STREAM_RAYS];
} rp_extend_rays;

static inline void rp_load_extend_stream(const rp_geometry* g, const rp_paths* paths, const __global uint* queue, rp_walk* walk, rp_extend_rays* e,
                                         const rp_share* share, uint round) {
    rp_stream* const s = &walk->stream;
    const uint count = e->count;
    uint next;
    const uint next_count = rp_expected_stream(share, &next);
    for (uint r = 0u; r < next_count; r++) rp_prefetch_extension(paths, rp_extend_entry(queue, next + r));
    for (uint r = 0u; r < RP_STREAM_RAYS; r++) {
        e->slot[r] = rp_extend_entry(queue, e->first + min(r, count - 1u));
        e->status[r] = rp_status_of(paths, e->slot[r]);
    }
    for (uint i = 0u; i < RP_STREAM_RAYS / 8u; i++) {
        rp_extension_rays8 rays;
        rp_extensions_of8(paths, e->slot + 8u * i, vload8(i, e->status), &rays);
        rp_set_stream_rays(s, i, rays.origin, rays.direction, rays.t, rays.primitive);
        vstore8(rays.density, i, e->density);
        vstore8(rays.sample, i, e->sample);
        vstore8(rays.block_entry, i, e->block_entry);
    }
    s->active = count < RP_STREAM_RAYS ? (1ul << count) - 1ul : ~0ul;
    rp_prepare_stream(s);
    for (ulong resumed = rp_resumed_rays(e->status) & s->active; resumed != 0ul; resumed &= resumed - 1ul) {
        const uint r = rp_lowest(resumed);
        rp_resume_ray(s, r, g->block_entries, e->block_entry[r]);
    }
#ifdef RP_INSTANCES
    rp_begin_in_world(walk, paths, e->slot, s->resumed);
    rp_resume_standing(g, walk, paths, e->slot, s->resumed, round, false);
#endif
}

// Counts of one work-item: extension rays that had waited, those of them that hit nothing in the block they had waited for, and rays that wait
// from now on.
typedef struct rp_extend_counts {
    uint served, no_hit, waiting;
} rp_extend_counts;

// row: if it has a hit, what its planes are to say of it (rp_lay_out_hits8).
static inline void rp_store_extend_ray(const rp_geometry* g, const rp_walk* walk, const rp_extend_rays* e, const rp_wide_surfaces* surfaces, uint r,
                                       uint block_entry, uint8 row, uint block_count, volatile __global uint* demand, const rp_paths* paths,
                                       rp_pending_lists* lists, rp_extend_counts* counts) {
    const rp_stream* const s = &walk->stream;
    const uint slot = e->slot[r], status = e->status[r], waited_at = e->block_entry[r];
    const float t = RP_OF_RAY(s->t, r);
    const bool has_hit = rp_hit_in_launch(s, r);
    uint offset_exponent = rp_offset_exponent_of(status), last_block = rp_kept_last_block(status);
    if (has_hit) {
        offset_exponent = surfaces->offset_exponent[r];
#ifdef RP_VERTEX_COLORS
        rp_set_color(paths, slot, surfaces->color[r]);
#endif
#ifdef RP_UVS
        rp_set_uv(paths, slot, surfaces->texture[r].uv, surfaces->texture[r].density);
#endif
#ifdef RP_TANGENTS
        rp_set_tangent(paths, slot, surfaces->texture[r].tangent);
#endif
#ifdef RP_TRAITS
        rp_set_traits(paths, slot, rp_instance_traits_number(rp_hit_instance(s, r)));
#endif
#if defined(RP_HIT_IDS) && defined(RP_INSTANCES)
        rp_set_ids(paths, slot, rp_hit_instance(s, r), ((const uint*)s->number)[r]);
#endif
        last_block = rp_last_block_bits(rp_hit_leaf(s, r)->block);
    }
    const uint kept = rp_store_stream_extension(paths, slot, status, has_hit, t, block_entry, row);
    if (waited_at != RP_NONE) {
        counts->served++;
        if (!has_hit || rp_hit_leaf(s, r)->block != rp_block_entry_block(g, waited_at)) counts->no_hit++;
    }
    if (block_entry == RP_NONE) {
        rp_finish_stream_extension(paths, slot, offset_exponent, kept, last_block);
#ifdef RP_TRACK_BOUNCES
        if (has_hit) rp_note_bounce(demand, block_count, rp_hit_leaf(s, r)->block);
#endif
    } else {
        counts->waiting++;
#ifdef RP_INSTANCES
        const uint block = rp_stand(g, walk, paths, slot, r, block_entry);
#else
        const uint block = rp_block_entry_block(g, block_entry);
#endif
        rp_wait_for_block_in_list(lists, paths, slot, block, rp_extension_waits(offset_exponent, kept), demand, block_count);
    }
}

static inline void rp_store_extend_stream(const rp_geometry* g, rp_walk* walk, const rp_extend_rays* e, uint block_count,
                                          volatile __global uint* demand, const rp_paths* paths, rp_extend_counts* counts) {
    const rp_stream* const s = &walk->stream;
    rp_wide_surfaces surfaces;
#ifdef RP_INSTANCES
    rp_find_surfaces_in_world(g, s, &walk->inner, &surfaces);
#else
    rp_find_surfaces(s, &surfaces);
#endif
    rp_pending_lists lists;
    rp_begin_pending_lists(&lists, e->first / RP_STREAM_RAYS, false);
    for (uint first = 0u; first < e->count; first += 8u) {
        const uint i = first / 8u;
        uint block_entry[8];
#ifdef RP_INSTANCES
        for (uint k = 0u; k < 8u; k++) block_entry[k] = rp_waits_with_instances(walk, first + k);
#else
        for (uint k = 0u; k < 8u; k++) block_entry[k] = rp_waits_at(s, first + k);
#endif
        // Where there is no hit, nothing of this is used.
        const rp_hits8 hits = {
            {as_uint8(vload8(i, surfaces.position[0])), as_uint8(vload8(i, surfaces.position[1])), as_uint8(vload8(i, surfaces.position[2]))},
            vload8(i, (const uint*)s->primitive),
            vload8(i, surfaces.geometric_normal),
            vload8(i, surfaces.shading_normal),
            as_uint8(vload8(i, (const float*)s->t)),
            vload8(0, block_entry),
            vload8(i, e->density),
            vload8(i, e->sample)};
        uint8 rows[8];
        rp_lay_out_hits8(&hits, vload8(i, e->status), rows);
        for (uint k = 0u; k < min(e->count - first, 8u); k++)
            rp_store_extend_ray(g, walk, e, &surfaces, first + k, block_entry[k], rows[k], block_count, demand, paths, &lists, counts);
    }
    rp_end_pending_lists(&lists, paths, demand, block_count);
}

// Traces RP_WALKS streams of 64 rays in turn: while one computes, the next record of another is on its way from memory.
static RP_NOINLINE void rp_extend_streams(const rp_geometry* g, rp_share share, const __global uchar* restrict wide_top, uint block_count, uint round,
                                          const __global uint* restrict queue, volatile __global uint* demand, rp_paths all_paths,
                                          volatile __global uint* restrict counters) {
    const rp_paths* const paths = &all_paths;
    rp_extend_counts counts = {0u, 0u, 0u};
    rp_walk walks[RP_WALKS];
    rp_extend_rays rays[RP_WALKS];
    // To begin with, each is at the end of a stream of no rays: so there is one place where the next one is taken.
    for (uint w = 0u; w < RP_WALKS; w++) walks[w].rays = 0ul, rays[w].count = 0u;
    uint running = (1u << RP_WALKS) - 1u;
    for (uint w = 0u; running != 0u; w = w + 1u < RP_WALKS ? w + 1u : 0u) {
        if (!(running >> w & 1u)) continue;
        if (walks[w].rays != 0ul) {
            rp_step(g, &walks[w], round, false);
            continue;
        }
#ifdef RP_INSTANCES
        if (rays[w].count != 0u && rp_look_again(&walks[w])) continue;
#endif
        if (rays[w].count != 0u) rp_store_extend_stream(g, &walks[w], &rays[w], block_count, demand, paths, &counts);
        rays[w].count = rp_next_stream(&share, counters + RP_COUNT_EXTEND_TAKEN, &rays[w].first);
        if (rays[w].count == 0u) {
            running &= ~(1u << w);
        } else {
            rp_load_extend_stream(g, paths, queue, &walks[w], &rays[w], &share, round);
            rp_begin_walk(&walks[w], wide_top);
        }
    }
    rp_count_add(counters + RP_COUNT_REQUESTS_SERVED, counts.served);
    rp_count_add(counters + RP_COUNT_REQUESTS_NO_HIT, counts.no_hit);
    if (counts.waiting != 0u) atomic_add(counters + RP_COUNT_IN_LISTS, counts.waiting);
}

#ifndef RP_WITHOUT_KERNELS
__kernel void rp_extend_stream(RP_GEOMETRY_PARAMETERS, const __global uchar* restrict wide_top, uint block_count, uint round, uint slot_count,
                               const __global uint* restrict queue, __global uint* restrict status, __global uint4* restrict planes,
                               volatile __global uint* restrict counters) {
    const rp_geometry geometry = RP_MAKE_GEOMETRY(block_count);
    const rp_paths paths = {slot_count, status, planes};
    rp_extend_streams(&geometry, rp_share_of(counters[RP_COUNT_EXTEND]), wide_top, block_count, round, queue, demand, paths, counters);
}
#endif
