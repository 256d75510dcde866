// A part of traverse.cl: instances that lie in objects that instances place, several levels deep; what instances.cl is for one level. A ray keeps the
// chain of instances in which it is, and where in the space around it each of them lies. The ray in the innermost space is made anew from the ray in
// the world through the whole chain when it comes out one level.

// The ray of the walk is now that of the first w->chain_count instances of its chain.
static inline void RP_TAKE_PLACED(const rp_geometry* g, RP_WALK* w, const rp_placed_ray* placed, float start) {
    const uint notes = w->shear.axis & RP_WALK_NOTES;
    const rp_instance_chain chain = w->ray.chain;
    w->ray = rp_make_ray(placed->origin, placed->direction);
    w->ray.chain = chain;
    w->ray.start = start;
    w->ray.instance = w->chain_count > 0u ? chain.instance[w->chain_count - 1u] : 0;
    w->shear = rp_make_shear(&w->ray);
    w->shear.axis |= notes;
    w->far = RP_FAR(RP_END);
}

// One level deeper: the walk is at the top of the object's tree.
static inline void RP_GO_INSIDE(const rp_geometry* g, RP_WALK* w, const __global rp_instance* instance, uint number) {
    const float3 base = rp_base_of(g->objects, instance);
    const rp_placed_ray placed = w->chain_count == 0u ? rp_place_ray(instance, base, w->ray.origin, w->ray.direction)
                                                      : rp_place_ray_inside(instance, base, w->ray.origin, w->ray.direction);
    // As rp_place_ray_in_chain adds them up.
    const float start = w->chain_count == 0u ? placed.start : rp_add(w->ray.start, placed.start);
    w->ray.chain.instance[w->chain_count] = instance;
    w->ray.chain.number[w->chain_count] = number;
    w->entry_around[w->chain_count] = w->entry;
    w->chain_count++;
    RP_TAKE_PLACED(g, w, &placed, start);
    RP_TO_TOP(g, w);
    w->current = g->objects[instance->object].top.root;
}

// One level up, and into the block where the instance lies. False: that is absent, and the walk is where it was.
static inline bool RP_GO_OUTSIDE(const rp_geometry* g, RP_WALK* w) {
    const uint entry = w->entry_around[w->chain_count - 1u];
    const uint4 a = g->block_entries[2u * entry], b = g->block_entries[2u * entry + 1u];
    const uint4 page = g->pages[a.w];
    if (page.x == RP_NONE) return false;
    w->chain_count--;
    w->ray.chain.number[w->chain_count] = 0u;
    rp_placed_ray placed = {w->origin, w->direction, 0.0f};
    if (w->chain_count > 0u) placed = rp_place_ray_in_chain(g->objects, &w->ray.chain, w->chain_count, w->origin, w->direction);
    RP_TAKE_PLACED(g, w, &placed, placed.start);
    w->entry = entry;
    w->block = rp_view_block(g, page);
    w->grid_ray = rp_make_grid_ray(&w->ray, as_float3_xyz(a), as_float3_xyz(b));
    w->current = b.w;
    return true;
}

// At the end of an instance.
static inline void RP_LEAVE_INSTANCE(const rp_geometry* g, RP_WALK* w, RP_STACK_ENTRY* stack) {
    const __global rp_instance* const instance = w->ray.instance;
    const bool enters = w->current == RP_REF_REENTER;
    if (!RP_GO_OUTSIDE(g, w)) {
        w->block.leaves_at = w->entry_around[w->chain_count - 1u];
        w->behind = true;
        w->current = RP_REF_STOPPED;
        return;
    }
    if (enters) {
        RP_PUSH(RP_REF_RETURN, -1.0f);
        RP_DESCEND(g, w, stack, rp_instance_path(instance));
    }
    RP_POP();
}

// Goes on where a ray stands with respect to instances of which the outermost lies beneath block entry `start`.
static inline void RP_RESUME_INSIDE(const rp_geometry* g, RP_WALK* w, RP_STACK_ENTRY* stack, uint start, const rp_standing* standing) {
    w->entry = start;
    for (uint i = 0u; i < standing->depth; i++) {
        const bool last = i + 1u == standing->depth;
        if (last && standing->block_entry == RP_STANDS_BEHIND) {
            // Not to be gone into any more.
            w->ray.chain.instance[i] = w->ray.instance = standing->chain.instance[i];
            w->ray.chain.number[i] = standing->chain.number[i];
            w->entry_around[i] = w->entry;
            w->chain_count++;
            w->current = RP_REF_REENTER;
            return;
        }
        RP_PUSH(RP_REF_REENTER, -1.0f);
        RP_GO_INSIDE(g, w, standing->chain.instance[i], standing->chain.number[i]);
        w->entry = last ? standing->block_entry : standing->entry_around[i + 1u];
        RP_DESCEND(g, w, stack, g->block_entry_paths[w->entry]);
    }
}

static inline uint RP_STANDS_AT(const RP_WALK* w, uint block_entry) {
    return w->chain_count == 0u ? RP_NONE : w->behind ? RP_STANDS_BEHIND : block_entry;
}
// The block entry in the world at which the ray is, which has stopped somewhere.
static inline uint RP_ENTRY_IN_WORLD(const RP_WALK* w) { return w->entry_around[0]; }
