// On CPUs, what single_ray/connect.cl does, with streams of rays over the wide form of the blocks. In a render this is a part of stream/trace.cl.
#include "common/noinline.cl"
#include "common/end_path.cl"
#include "common/path_state.cl"
#include "common/queue.cl"
#include "stream/stream_slots.cl"
#include "stream/traverse.cl"
#include "common/waiting_lists.cl"

// What the shadow rays of a scene need beside its geometry.
typedef struct rp_connect_scene {
    __constant rp_render_params* params;
    const __global rp_primitive_range* ranges;
    __global uint* film;
} rp_connect_scene;

typedef struct rp_connect_rays {
    uint first, count;  // in the queue
    uint slot[RP_STREAM_RAYS], status[RP_STREAM_RAYS];
} rp_connect_rays;

static inline void rp_load_connect_stream(const rp_geometry* g, const rp_paths* paths, const __global uint* queue, rp_walk* walk, rp_connect_rays* c,
                                          const rp_share* share, uint round) {
    rp_stream* const s = &walk->stream;
    const uint count = c->count;
    uint next;
    const uint next_count = rp_expected_stream(share, &next);
    for (uint r = 0u; r < next_count; r++) rp_prefetch_shadow(paths, rp_shadow_entry(queue, paths->slot_count, next + r));
    for (uint r = 0u; r < RP_STREAM_RAYS; r++) {
        c->slot[r] = rp_shadow_entry(queue, paths->slot_count, c->first + min(r, count - 1u));
        c->status[r] = rp_status_of(paths, c->slot[r]);
    }
    for (uint i = 0u; i < RP_STREAM_RAYS / 8u; i++) {
        rp_shadow_rays8 rays;
        rp_shadows_of8(paths, c->slot + 8u * i, &rays);
        rp_set_stream_rays(s, i, rays.origin, rays.direction, rays.t_max, (uint8)(RP_NONE));
    }
    s->active = count < RP_STREAM_RAYS ? (1ul << count) - 1ul : ~0ul;
    rp_prepare_stream(s);
    for (ulong resumed = rp_resumed_rays(c->status) & s->active; resumed != 0ul; resumed &= resumed - 1ul) {
        const uint r = rp_lowest(resumed);
        rp_resume_ray(s, r, g->block_entries, rp_block_entry_of(paths, c->slot[r]));
    }
#ifdef RP_CUTOUTS
    s->met_cutout = 0ul;
    for (uint r = 0u; r < count; r++) s->met_cutout |= rp_has_met_cutout(c->status[r]) ? 1ul << r : 0ul;
#endif
#ifdef RP_INSTANCES
    rp_begin_in_world(walk, paths, c->slot, 0ul);
    rp_resume_standing(g, walk, paths, c->slot, s->resumed, round, true);
#endif
}

// Returns whether the ray waits from now on.
static inline bool rp_store_connect_ray(const rp_geometry* g, const rp_walk* walk, const rp_connect_rays* c, uint r, uint block_count,
                                        volatile __global uint* demand, const rp_paths* paths, const rp_connect_scene* scene,
                                        rp_pending_lists* lists) {
    const rp_stream* const s = &walk->stream;
#ifdef RP_INSTANCES
    const bool occluded = !((s->active | walk->kept) >> r & 1ul);
    const uint block_entry = occluded ? RP_NONE : rp_waits_with_instances(walk, r);
#else
    const bool occluded = !(s->active >> r & 1ul);
    const uint block_entry = occluded ? RP_NONE : rp_waits_at(s, r);
#endif
    uint status = c->status[r];
#ifdef RP_CUTOUTS
    const bool met_cutout = (s->met_cutout >> r & 1ul) != 0ul;
    if (!occluded && block_entry == RP_NONE && met_cutout) {
        rp_trace_shadow_as_extension(paths, c->slot[r], status);
        return false;
    }
    status = rp_with_cutout_met(status, met_cutout);
#endif
    if (block_entry == RP_NONE) {
        const rp_path_end end = rp_finish_shadow(paths, c->slot[r], status, occluded);
        if (end.ended) rp_add_sample(scene->params, paths, c->slot[r], scene->film, end.pixel, end.radiance);
        return false;
    }
    rp_set_block_entry(paths, c->slot[r], block_entry);
#ifdef RP_INSTANCES
    const uint block = rp_stand(g, walk, paths, c->slot[r], r, block_entry);
#else
    const uint block = rp_block_entry_block(g, block_entry);
#endif
    rp_wait_for_block_in_list(lists, paths, c->slot[r], block, rp_shadow_waits(status), demand, block_count);
    return true;
}

// Returns how many of them wait from now on.
static inline uint rp_store_connect_stream(const rp_geometry* g, const rp_walk* walk, const rp_connect_rays* c, uint block_count,
                                           volatile __global uint* demand, const rp_paths* paths, const rp_connect_scene* scene) {
    rp_pending_lists lists;
    rp_begin_pending_lists(&lists, c->first / RP_STREAM_RAYS, true);
    uint waiting = 0u;
    for (uint r = 0u; r < c->count; r++) waiting += rp_store_connect_ray(g, walk, c, r, block_count, demand, paths, scene, &lists) ? 1u : 0u;
    rp_end_pending_lists(&lists, paths, demand, block_count);
    return waiting;
}

// As rp_extend_streams.
static RP_NOINLINE void rp_connect_streams(const rp_geometry* g, rp_share share, const __global uchar* restrict wide_top, uint block_count,
                                           uint round, const __global uint* restrict queue, volatile __global uint* demand, rp_paths all_paths,
                                           volatile __global uint* restrict counters, rp_connect_scene scene) {
    const rp_paths* const paths = &all_paths;
    rp_walk walks[RP_WALKS];
    rp_connect_rays rays[RP_WALKS];
    for (uint w = 0u; w < RP_WALKS; w++) walks[w].rays = 0ul, rays[w].count = 0u;
    uint running = (1u << RP_WALKS) - 1u, waiting = 0u;
    for (uint w = 0u; running != 0u; w = w + 1u < RP_WALKS ? w + 1u : 0u) {
        if (!(running >> w & 1u)) continue;
        if (walks[w].rays != 0ul) {
            rp_step(g, &walks[w], round, true);
            continue;
        }
#ifdef RP_INSTANCES
        if (rays[w].count != 0u && rp_look_again(&walks[w])) continue;
#endif
        if (rays[w].count != 0u) waiting += rp_store_connect_stream(g, &walks[w], &rays[w], block_count, demand, paths, &scene);
        rays[w].count = rp_next_stream(&share, counters + RP_COUNT_SHADOW_TAKEN, &rays[w].first);
        if (rays[w].count == 0u) {
            running &= ~(1u << w);
        } else {
#ifdef RP_CUTOUTS
            walks[w].ranges = scene.ranges;
            walks[w].range_count = scene.params->range_count;
#endif
            rp_load_connect_stream(g, paths, queue, &walks[w], &rays[w], &share, round);
            rp_begin_walk(&walks[w], wide_top);
        }
    }
    if (waiting != 0u) atomic_add(counters + RP_COUNT_IN_LISTS, waiting);
}

#ifndef RP_WITHOUT_KERNELS
__kernel void rp_connect_stream(RP_GEOMETRY_PARAMETERS, const __global uchar* restrict wide_top, uint block_count, uint round, uint slot_count,
                                const __global uint* restrict queue, __global uint* restrict status, __global uint4* restrict planes,
                                volatile __global uint* restrict counters, __constant rp_render_params* restrict params,
                                const __global rp_primitive_range* restrict ranges, __global uint* restrict film) {
    const rp_geometry geometry = RP_MAKE_GEOMETRY(block_count);
    const rp_paths paths = {slot_count, status, planes};
    const rp_connect_scene scene = {params, ranges, film};
    rp_connect_streams(&geometry, rp_share_of(counters[RP_COUNT_SHADOW]), wide_top, block_count, round, queue, demand, paths, counters, scene);
}
#endif
