// A part of traverse.cl: streams in instances. The rays of a stream that meet an instance become a stream in the space of its object, with the same
// lanes, and go through the tree above the object's blocks and through these on the same stack, before anything else is visited.
//
// Where a ray waits inside is a unit: an instance and a block entry of its object. Within a block of instances units come in the order in which the
// ray enters them; equal ones by the number of the instance and by the block entry. Units of several such blocks must not be put in one order by
// distance: a ray has to have a block to know its units, and with two that are absent in turn it would never end. So the block entry comes first.
// When the object's block has come, the ray visits that unit alone, and then goes on behind it where the instance's block is, or waits for that.

static inline float16 rp_dot_fused16(const float* row, const float16* v) {
    return fma((float16)(row[0]), v[0], fma((float16)(row[1]), v[1], (float16)(row[2]) * v[2]));
}

// Of the stream inside: to which distance its rays have to be traced. Only of packets in which hits have changed.
static inline void rp_end_inside(rp_walk* walk, ulong rays) {
    const rp_stream* const s = &walk->inner;
    for (uint p = 0u; p < RP_PACKETS; p++)
        if (rp_lanes_of(rays, p) != 0u) walk->until[p] = rp_max(s->t[p] * (RP_BOX_WIDEN * RP_BOX_WIDEN) - s->start[p], (float16)(0.0f));
}

// outer_block_entry: block entry of the instance's block. number: as rp_ray has it. What the rays have found so far goes with them. Packets without
// rays are left as they were: often few rays of a stream meet an instance.
static RP_NOINLINE void rp_go_inside(const rp_geometry* g, rp_walk* walk, ulong rays, const __global rp_instance* instance, uint number,
                                     uint outer_block_entry) {
    const rp_stream* const world = &walk->stream;
    rp_stream* const s = &walk->inner;
    const __global rp_object* const object = g->objects + instance->object;
    const uint one = rp_lowest(rays);  // lanes of others repeat it
    float row[3][3];
    for (uint i = 0u; i < 9u; i++) row[i / 3u][i % 3u] = instance->to_object[i];
    const float reach = instance->reach;
    s->stopped = s->resumed = 0ul;
    s->signs = RP_MIXED;  // bounds of all rays are for denser streams
    for (uint p = 0u; p < RP_PACKETS; p++) {
        const uint lanes = rp_lanes_of(rays, p);
        if (lanes == 0u) continue;
        const int16 own = rp_lanes16(lanes);
        float16 o[3], d[3], to_center[3], near[3];
        for (uint a = 0u; a < 3u; a++) {
            o[a] = own ? world->origin[a][p] : (float16)(RP_OF_RAY(world->origin[a], one));
            d[a] = own ? world->direction[a][p] : (float16)(RP_OF_RAY(world->direction[a], one));
            to_center[a] = instance->center[a] - o[a];
        }
        // As rp_place_ray.
        const float16 along = fma(to_center[0], d[0], fma(to_center[1], d[1], to_center[2] * d[2])) - reach;
        const float16 start = rp_max(along, (float16)(0.0f));
        for (uint a = 0u; a < 3u; a++) near[a] = fma(start, d[a], o[a]) - instance->center[a];
        for (uint a = 0u; a < 3u; a++) {
            s->origin[a][p] = object->base[a] + rp_dot_fused16(row[a], near);
            s->direction[a][p] = rp_dot_fused16(row[a], d);
        }
        s->start[p] = start;
        s->t[p] = world->t[p];
        s->primitive[p] = world->primitive[p];
        s->number[p] = world->number[p];
        rp_prepare_packet(s, p);
        s->hit_low[p] = world->hit_low[p];
        s->hit_high[p] = world->hit_high[p];
        s->hit_instance_low[p] = world->hit_instance_low[p];
        s->hit_instance_high[p] = world->hit_instance_high[p];
    }
    s->instance_number = number;
    s->instance = (ulong)instance;
    s->active = rays;
#ifdef RP_CUTOUTS
    s->met_cutout = world->met_cutout;
#endif
    walk->inside = true;
    walk->inner_rays = rays;
    walk->inner_bottom = walk->stack.depth;
    walk->outer_block_entry = outer_block_entry;
    rp_end_inside(walk, rays);
}

static inline void rp_go_outside(rp_walk* walk) {
    rp_stream* const world = &walk->stream;
    const rp_stream* const s = &walk->inner;
    for (uint p = 0u; p < RP_PACKETS; p++) {
        const uint lanes = rp_lanes_of(walk->inner_rays, p);
        if (lanes == 0u) continue;
        const int16 own = rp_lanes16(lanes);
        world->t[p] = own ? s->t[p] : world->t[p];
        world->primitive[p] = own ? s->primitive[p] : world->primitive[p];
        world->number[p] = own ? s->number[p] : world->number[p];
        world->hit_low[p] = own ? s->hit_low[p] : world->hit_low[p];
        world->hit_high[p] = own ? s->hit_high[p] : world->hit_high[p];
        world->hit_instance_low[p] = own ? s->hit_instance_low[p] : world->hit_instance_low[p];
        world->hit_instance_high[p] = own ? s->hit_instance_high[p] : world->hit_instance_high[p];
    }
    world->active &= ~(walk->inner_rays & ~s->active);
#ifdef RP_CUTOUTS
    world->met_cutout |= s->met_cutout & walk->inner_rays;
#endif
    walk->inside = false;
}

// Of the rays of a packet inside, those that meet a block entry of the object, and not before what they are behind; and where, in the world.
static inline uint rp_ahead_inside(rp_walk* walk, uint p, ulong rays, const __global uint4* block_entries, uint block_entry, float16* entry) {
    const uint lanes = rp_lanes_of(rays, p);
    if (lanes == 0u) return 0u;
    const float16* const until = rp_until(walk);
    const uint meets =
        lanes & rp_enter_bounds(&walk->inner, p, until[p], block_entries[2u * block_entry], block_entries[2u * block_entry + 1u], entry);
    *entry += walk->inner.start[p];
    const uint16 number = (uint16)(walk->inner.instance_number), unit = (uint16)(block_entry);
    const uint here = (uint)(walk->behind >> (RP_PACKET_RAYS * p)) & rp_mask16(walk->stream.from_block_entry[p] == (uint16)(walk->outer_block_entry));
    const int16 later =
        (*entry > walk->from_entry[p]) |
        ((*entry == walk->from_entry[p]) & ((number > walk->from_number[p]) | ((number == walk->from_number[p]) & (unit > walk->from_unit[p]))));
    return meets & (~here | rp_mask16(later));
}

static inline ulong rp_still_before_inside(rp_walk* walk, ulong rays, const __global uint4* block_entries, uint block_entry) {
    ulong ahead = 0ul;
    float16 entry;
    for (uint p = 0u; p < RP_PACKETS; p++) ahead |= (ulong)rp_ahead_inside(walk, p, rays, block_entries, block_entry, &entry) << (RP_PACKET_RAYS * p);
    return ahead;
}

// As rp_meet_absent.
static inline void rp_meet_absent_inside(rp_walk* walk, ulong rays, const __global uint4* block_entries, uint block_entry) {
    rp_stream* const s = &walk->stream;
    const uint16 outer_block_entry = (uint16)(walk->outer_block_entry), number = (uint16)(walk->inner.instance_number), unit = (uint16)(block_entry);
    for (uint p = 0u; p < RP_PACKETS; p++) {
        float16 entry, page;
        uint first = rp_ahead_inside(walk, p, rays, block_entries, block_entry, &entry);
        if (first == 0u) continue;
        // The block of the instance is met: no hit lies before it.
        rp_enter_bounds(s, p, s->t[p], block_entries[2u * walk->outer_block_entry], block_entries[2u * walk->outer_block_entry + 1u], &page);
        const int16 before_unit =
            (entry < walk->wait_entry[p]) |
            ((entry == walk->wait_entry[p]) & ((number < walk->wait_number[p]) | ((number == walk->wait_number[p]) & (unit < walk->wait_unit[p]))));
        first &= rp_mask16((page < s->wait[p]) | ((page == s->wait[p]) & ((outer_block_entry < s->wait_block_entry[p]) |
                                                                          ((outer_block_entry == s->wait_block_entry[p]) & before_unit))));
        const int16 better = rp_lanes16(first);
        s->wait[p] = better ? page : s->wait[p];
        s->wait_block_entry[p] = better ? outer_block_entry : s->wait_block_entry[p];
        walk->wait_entry[p] = better ? entry : walk->wait_entry[p];
        walk->wait_number[p] = better ? number : walk->wait_number[p];
        walk->wait_unit[p] = better ? unit : walk->wait_unit[p];
        s->stopped |= (ulong)first << (RP_PACKET_RAYS * p);
        for (; first != 0u; first &= first - 1u) walk->wait_instance[RP_PACKET_RAYS * p + rp_lowest(first)] = walk->inner.instance;
    }
}

// Before a new stream sets out. paths, slots: of its rays. resumed: those that have waited.
static inline void rp_begin_in_world(rp_walk* walk, const rp_paths* paths, const uint* slot, ulong resumed) {
    walk->inside = false;
    walk->behind = walk->kept = 0ul;
    walk->stream.instance_number = 0u;
    walk->stream.instance = 0ul;
    for (uint p = 0u; p < RP_PACKETS; p++) {
        walk->stream.start[p] = (float16)(0.0f);
        walk->stream.number[p] = walk->wait_number[p] = (uint16)(0u);
    }
    for (; resumed != 0ul; resumed &= resumed - 1ul) {
        const uint r = rp_lowest(resumed);
        ((uint*)walk->stream.number)[r] = rp_number_of_hit(paths, slot[r]);
    }
}

// A ray that has waited for a block of instances, or in one, goes on. REQUIRES: rp_resume_ray was called. unit: its block entry inside.
static RP_NOINLINE void rp_resume_inside(const rp_geometry* g, rp_walk* walk, uint r, const rp_standing* standing, uint unit, uint round,
                                         const bool any_hit) {
    const ulong ray = 1ul << r;
    const uint p = r / RP_PACKET_RAYS;
    float16 entry;
    float entries[RP_PACKET_RAYS];
    walk->stack.depth = 0u;
    rp_go_inside(g, walk, ray, standing->instance, standing->number, ((const uint*)walk->stream.from_block_entry)[r]);
    rp_enter_bounds(&walk->inner, p, walk->inner.t[p], g->block_entries[2u * unit], g->block_entries[2u * unit + 1u], &entry);
    vstore16(entry + walk->inner.start[p], 0, entries);
    RP_SET_OF_RAY(walk->from_entry, r, entries[r % RP_PACKET_RAYS]);
    ((uint*)walk->from_number)[r] = standing->number;
    ((uint*)walk->from_unit)[r] = unit;
    walk->behind |= ray;
    walk->rays = 0ul;
    if (standing->block_entry != RP_STANDS_BEHIND) {
        const uint4 bounds = g->block_entries[2u * unit], more = g->block_entries[2u * unit + 1u], page = g->pages[bounds.w];
        if (page.x == RP_NONE) {
            walk->kept |= ray;
            walk->stream.active &= ~ray;
        } else {
            walk->record = rp_wide_root(rp_block_address(g, page.x), more.w, &walk->leaf);
            walk->rays = ray;
            while (walk->inside) rp_step(g, walk, round, any_hit);
            return;
        }
    }
    rp_go_outside(walk);
}

// All rays of a stream that stand in instances, or behind one.
static inline void rp_resume_standing(const rp_geometry* g, rp_walk* walk, const rp_paths* paths, const uint* slot, ulong resumed, uint round,
                                      const bool any_hit) {
    for (; resumed != 0ul; resumed &= resumed - 1ul) {
        const uint r = rp_lowest(resumed);
        const rp_standing standing = rp_standing_of(paths, slot[r], true);
        if (standing.block_entry != RP_NONE) rp_resume_inside(g, walk, r, &standing, rp_inner_block_entry(paths, slot[r]), round, any_hit);
    }
}

// Where the first unit at which a ray would wait turned out to lie behind its closest hit, others may not: it looks again behind that unit. Returns
// whether there are such rays, with which the walk has begun anew.
static inline bool rp_look_again(rp_walk* walk) {
    rp_stream* const s = &walk->stream;
    ulong again = 0ul;
    for (ulong left = s->stopped & s->active; left != 0ul; left &= left - 1ul) {
        const uint r = rp_lowest(left);
        const float end = RP_OF_RAY(s->t, r) * RP_BOX_WIDEN;
        if (((const uint*)walk->wait_number)[r] == 0u || RP_OF_RAY(s->wait, r) > end || RP_OF_RAY(walk->wait_entry, r) <= end) continue;
        again |= 1ul << r;
        RP_SET_OF_RAY(s->from, r, RP_OF_RAY(s->wait, r));
        ((uint*)s->from_block_entry)[r] = ((const uint*)s->wait_block_entry)[r];
        RP_SET_OF_RAY(walk->from_entry, r, RP_OF_RAY(walk->wait_entry, r));
        ((uint*)walk->from_number)[r] = ((const uint*)walk->wait_number)[r];
        ((uint*)walk->from_unit)[r] = ((const uint*)walk->wait_unit)[r];
        RP_SET_OF_RAY(s->wait, r, INFINITY);
        ((uint*)s->wait_block_entry)[r] = RP_NONE;
        ((uint*)walk->wait_number)[r] = 0u;
    }
    if (again == 0ul) return false;
    s->resumed |= again;
    s->stopped &= ~again;
    walk->behind |= again;
    rp_begin_walk(walk, walk->top);
    walk->rays = again;
    return true;
}

// The block entry at which a ray waits from now on; RP_NONE: nowhere.
static inline uint rp_waits_with_instances(const rp_walk* walk, uint r) {
    return walk->kept >> r & 1ul ? ((const uint*)walk->stream.from_block_entry)[r] : rp_waits_at(&walk->stream, r);
}

// Puts down where a ray stands that waits at a block entry. Returns the block that it waits for.
static inline uint rp_stand(const rp_geometry* g, const rp_walk* walk, const rp_paths* paths, uint slot, uint r, uint block_entry) {
    const uint number = ((const uint*)walk->wait_number)[r], hit_number = ((const uint*)walk->stream.number)[r];
    if (!(walk->kept >> r & 1ul) && number != 0u) {
        const uint unit = ((const uint*)walk->wait_unit)[r];
        rp_set_standing_of_stream(paths, slot, (const __global rp_instance*)walk->wait_instance[r], unit, number, hit_number, unit);
        return rp_block_entry_block(g, unit);
    }
    const uint unit = ((const uint*)walk->from_unit)[r];
    const bool kept = (walk->kept >> r & 1ul) != 0ul;
    const bool behind = (walk->behind >> r & 1ul) != 0ul && ((const uint*)walk->stream.from_block_entry)[r] == block_entry;
    rp_set_standing_of_stream(paths, slot, 0,
                              kept     ? unit
                              : behind ? RP_STANDS_BEHIND
                                       : RP_NONE,
                              ((const uint*)walk->from_number)[r], hit_number, unit);
    return rp_block_entry_block(g, kept ? unit : block_entry);
}
