// A ray through the top tree and the resident blocks. Included twice: RP_ANY_HIT 0 defines rp_find_closest, 1 defines rp_find_any.
//
// Order and progress. A ray visits the portals (sub-boxes of blocks) in the order of a depth-first walk of the top tree, near child first
// for closest hits, child 0 first for any hit. That order follows from the ray and the tree alone. A closest-hit ray that comes to an
// absent block stops there and keeps nothing but the portal: later it walks down the portal's path again, putting on the stack what lies
// after it in the order, and goes on. So it enters each portal at most once and always moves forward, however block bounds overlap; what a
// nearer hit has pruned is never tested. (The paper, 3.4, keeps a block number in the ray for the same purpose.)
// A shadow ray may take hits in any order: it tests all resident blocks first and waits for the first absent one it came by. When it
// goes on, blocks that were resident in its last pass (resident_since <= tested_until) are behind it and are not tested again.

#if RP_ANY_HIT
#define RP_PUSH(reference, entry) stack[depth++] = (reference)
#define RP_POP() current = stack[--depth]
#else
#define RP_PUSH(reference, entry) stack[depth++] = (uint2)((reference), as_uint(entry))
// Skips what lies beyond the closest hit so far; equal distances stay, for the tie is decided by primitive id.
#define RP_POP()                                                        \
    do {                                                                \
        --depth;                                                        \
        current = stack[depth].x;                                       \
    } while (as_float(stack[depth].y) > t_limit * RP_BOX_WIDEN)
#endif

#if RP_ANY_HIT
// The first portal to wait at, or RP_NONE if all was tested; *hit tells whether something was hit (then RP_NONE).
static uint rp_find_any(const rp_geometry* g, const rp_ray* ray, float t_limit, uint start, uint tested_until, uint round, bool* hit) {
    uint stack[RP_STACK_SIZE];
    uint first_absent = RP_NONE;
    *hit = false;
#else
// The portal to wait at, or RP_NONE if the closest hit is found. Improves *best, whose t is the distance so far (INFINITY at first).
// *served is set if the ray had waited at `start`: 1 if a hit was found behind it, 2 if not.
static uint rp_find_closest(const rp_geometry* g, const rp_ray* ray, rp_hit* best, uint start, uint round, uint* served) {
    uint2 stack[RP_STACK_SIZE];
    float t_limit = best->t;
    *served = 0u;
    bool waited = start != RP_NONE;
#endif
    const rp_shear shear = rp_make_shear(ray);
    const float3 top_origin = (float3)(g->top_grid->origin[0], g->top_grid->origin[1], g->top_grid->origin[2]);
    const float3 top_cell = (float3)(g->top_grid->cell[0], g->top_grid->cell[1], g->top_grid->cell[2]);
    rp_frame frame = rp_make_frame(ray, top_origin, top_cell);
    const __global uint4* nodes = g->top_nodes;
    rp_block_view block;
    uint block_address = RP_NONE, current = g->top_grid->root, depth = 0u;
    RP_PUSH(RP_REF_EXIT, -1.0f);

    if (start != RP_NONE) {
        // Walk down to where the ray stands.
        const ulong path = g->portal_paths[start];
        for (int level = 62 - (int)clz(path); level >= 0; level--) {
            const uint4 child0 = nodes[2u * current], child1 = nodes[2u * current + 1u];
            const float entry0 = rp_box_entry(child0, ray, &frame), entry1 = rp_box_entry(child1, ray, &frame);
            const uint taken = (uint)(path >> level) & 1u;
            const uint4 sibling = taken ? child0 : child1;
            const float sibling_entry = taken ? entry0 : entry1;
#if RP_ANY_HIT
            const uint first = 0u;
#else
            const uint first = entry1 < entry0 ? 1u : 0u;
#endif
            if (taken == first && sibling_entry <= rp_box_exit(sibling, ray, &frame, t_limit)) RP_PUSH(sibling.w, sibling_entry);
            current = taken ? child1.w : child0.w;
        }
    }

    for (;;) {
        while (!(current & RP_REF_LEAF)) {
            const uint4 child0 = nodes[2u * current], child1 = nodes[2u * current + 1u];
            const float entry0 = rp_box_entry(child0, ray, &frame), entry1 = rp_box_entry(child1, ray, &frame);
            const bool hit0 = entry0 <= rp_box_exit(child0, ray, &frame, t_limit), hit1 = entry1 <= rp_box_exit(child1, ray, &frame, t_limit);
            if (hit0 && hit1) {
#if RP_ANY_HIT
                RP_PUSH(child1.w, entry1);
                current = child0.w;
#else
                const bool swap = entry1 < entry0;
                RP_PUSH(swap ? child0.w : child1.w, swap ? entry0 : entry1);
                current = swap ? child1.w : child0.w;
#endif
            } else if (hit0 || hit1) {
                current = hit0 ? child0.w : child1.w;
            } else {
                RP_POP();
            }
        }
        if (current < RP_REF_PORTAL) {
#if RP_ANY_HIT
            if (rp_leaf_any(ray, &shear, &block, current, t_limit)) {
                *hit = true;
                return RP_NONE;
            }
#else
            rp_leaf_closest(ray, &shear, &block, block_address, current, best);
            t_limit = best->t;
#endif
            RP_POP();
        } else if (current == RP_REF_EXIT) {
            break;
        } else if (current == RP_REF_RETURN) {
            nodes = g->top_nodes;
            frame = rp_make_frame(ray, top_origin, top_cell);
#if !RP_ANY_HIT
            if (waited) *served = best->found_in != RP_NONE ? 1u : 2u;
            waited = false;
#endif
            RP_POP();
        } else {
            const uint portal = current & ~RP_REF_PORTAL;
            const uint4 a = g->portals[2u * portal], b = g->portals[2u * portal + 1u];
            const uint2 page = g->pages[a.w];
#if RP_ANY_HIT
            if (page.x == RP_NONE || (start != RP_NONE && page.y <= tested_until)) {
                if (page.x == RP_NONE && first_absent == RP_NONE) first_absent = portal;
                RP_POP();
                continue;
            }
#else
            if (page.x == RP_NONE) return portal;
#endif
            if (g->used[a.w] != round) g->used[a.w] = round;
            block_address = page.x;
            block = rp_view_block(rp_block_address(g, page.x));
            nodes = block.nodes;
            frame = rp_make_frame(ray, as_float3_xyz(a), as_float3_xyz(b));
            RP_PUSH(RP_REF_RETURN, -1.0f);
            current = b.w;
        }
    }
#if RP_ANY_HIT
    return first_absent;
#else
    return RP_NONE;
#endif
}

#undef RP_PUSH
#undef RP_POP
