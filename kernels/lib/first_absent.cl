// Where a ray that came to absent blocks must wait: the first portal of an absent block in the ray's order of visits (traverse.cl), from
// where it stood. All resident blocks on its way have been tested when this is asked. Included twice, as traverse.cl is.

#if RP_ANY_HIT
static uint rp_first_absent_any(const rp_geometry* g, const rp_ray* ray, float t_limit, uint start) {
#else
static uint rp_first_absent_closest(const rp_geometry* g, const rp_ray* ray, float t_limit, uint start) {
#endif
    uint stack[RP_TOP_MAX_DEPTH + 1];
    const float3 origin = (float3)(g->top_grid->origin[0], g->top_grid->origin[1], g->top_grid->origin[2]);
    const float3 cell = (float3)(g->top_grid->cell[0], g->top_grid->cell[1], g->top_grid->cell[2]);
    const rp_frame frame = rp_make_frame(ray, origin, cell);
    const ulong path = start == RP_NONE ? 1ul : g->portal_paths[start];
    int level = 62 - (int)clz(path);  // steps of the path that are left, minus one
    uint current = g->top_grid->root, depth = 0u;
    stack[depth++] = RP_REF_EXIT;
    for (;;) {
        if (!(current & RP_REF_LEAF)) {
            const uint4 child0 = g->top_nodes[2u * current], child1 = g->top_nodes[2u * current + 1u];
            const float entry0 = rp_box_entry(child0, ray, &frame), entry1 = rp_box_entry(child1, ray, &frame);
            const bool hit0 = entry0 <= rp_box_exit(child0, ray, &frame, t_limit), hit1 = entry1 <= rp_box_exit(child1, ray, &frame, t_limit);
#if RP_ANY_HIT
            const bool swap = false;
#else
            const bool swap = entry1 < entry0;
#endif
            const bool second_hit = swap ? hit0 : hit1;
            const uint first = swap ? child1.w : child0.w, second = swap ? child0.w : child1.w;
            if (level >= 0) {
                // On the way down to where the ray stands: what comes before is done.
                const bool took_second = ((uint)(path >> level) & 1u) != (swap ? 1u : 0u);
                if (!took_second && second_hit) stack[depth++] = second;
                current = took_second ? second : first;
                level--;
                continue;
            }
            const bool first_hit = swap ? hit1 : hit0;
            if (first_hit && second_hit) stack[depth++] = second;
            if (first_hit || second_hit) {
                current = first_hit ? first : second;
                continue;
            }
        } else if (current == RP_REF_EXIT) {
            return RP_NONE;
        } else {
            const uint portal = current & ~RP_REF_PORTAL;
            if (g->pages[g->portals[2u * portal].w].x == RP_NONE) return portal;
        }
        current = stack[--depth];
    }
}
