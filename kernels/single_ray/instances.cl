// A part of traverse.cl: into instances and out of them.

// Into an instance: the walk is at the top of its object's tree.
static inline void RP_GO_INSIDE(const rp_geometry* g, RP_WALK* w, const __global rp_instance* instance, uint number) {
    const __global rp_object* const object = g->objects + instance->object;
    const uint notes = w->shear.axis & RP_WALK_NOTES;
    w->ray = rp_ray_inside(instance, number, rp_load3(object->base), w->origin, w->direction);
    w->shear = rp_make_shear(&w->ray);
    w->shear.axis |= notes;
    w->far = RP_FAR(RP_END);
    RP_TO_TOP(g, w);
    w->current = object->top.root;
}

// Out again, and into the block where the instance lies. False: that is absent.
static inline bool RP_GO_OUTSIDE(const rp_geometry* g, RP_WALK* w) {
    const uint4 a = g->block_entries[2u * w->world_entry], b = g->block_entries[2u * w->world_entry + 1u];
    const uint4 page = g->pages[a.w];
    if (page.x == RP_NONE) return false;
    const uint notes = w->shear.axis & RP_WALK_NOTES;
    w->ray = rp_make_ray(w->origin, w->direction);
    w->shear = rp_make_shear(&w->ray);
    w->shear.axis |= notes;
    w->far = RP_FAR(RP_END);
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
        // Only where it is to be entered: else this launch has come from there.
        w->block.leaves_at = w->world_entry;
        w->current = RP_REF_STOPPED;
        return;
    }
    if (enters) {
        RP_PUSH(RP_REF_RETURN, -1.0f);
        RP_DESCEND(g, w, stack, rp_instance_path(instance));
    }
    RP_POP();
}

// Goes on where a ray stands with respect to an instance that lies beneath block entry `start`.
static inline void RP_RESUME_INSIDE(const rp_geometry* g, RP_WALK* w, RP_STACK_ENTRY* stack, uint start, const rp_standing* standing) {
    w->world_entry = start;
    if (standing->block_entry == RP_STANDS_BEHIND) {
        w->ray.instance = standing->instance;
        w->ray.number = standing->number;
        w->current = RP_REF_REENTER;
        return;
    }
    RP_PUSH(RP_REF_REENTER, -1.0f);
    RP_GO_INSIDE(g, w, standing->instance, standing->number);
    RP_DESCEND(g, w, stack, g->block_entry_paths[standing->block_entry]);
}

// Of a ray that has stopped at a block entry.
static inline uint RP_STANDS_AT(const RP_WALK* w, uint block_entry) {
    return !w->ray.instance ? RP_NONE : block_entry == w->world_entry ? RP_STANDS_BEHIND : block_entry;
}
static inline uint RP_ENTRY_IN_WORLD(const RP_WALK* w) { return w->world_entry; }
