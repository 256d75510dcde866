// A stream of rays through the wide top tree and the resident blocks.
//
// Order and progress. Hits do not depend on the order of visits (primitive.cl), so a stream visits what its rays meet in whatever order
// suits them together. Waiting has an order, by ray: block entries as the ray enters their bounds, equal ones by number. A ray waits at the
// first absent block entry in this order. What comes before it has been tested then, in this launch or in one before; what comes after it is
// left for later. So a ray that goes on begins at the block entry it had waited at, waits at each block entry at most once, and always moves
// forward, however blocks come and go. Distances of block entries are computed anew, to the same bits, whenever they are asked for.
// Shadow rays do the same: to try all resident blocks first saved neither time nor loads (bench/journal/cpu-paging.md).
#ifndef RP_STREAM_TRAVERSE_CL
#define RP_STREAM_TRAVERSE_CL

#include "common/geometry.cl"
#include "common/prefetch.cl"
#ifdef RP_CUTOUTS
#include "common/primitive_ranges.cl"
#endif
#include "stream/wide_leaf.cl"
#include "stream/wide_node.cl"
#ifdef RP_INSTANCES
#include "common/instance.cl"
#include "common/path_state.cl"
#endif

#ifdef RP_INSTANCES
#define RP_STREAM_STACK (4 * RP_WIDE_MAX_DEPTH * (RP_WIDE_CHILDREN - 1) + 2)
#else
#define RP_STREAM_STACK (2 * RP_WIDE_MAX_DEPTH * (RP_WIDE_CHILDREN - 1) + 2)
#endif
#define RP_ENTRY_LEAF 0x80000000u  // beside the bits of a distance, which is not negative

typedef struct rp_stream_stack {
    // The last places are for what rp_push_sorted writes beyond the top.
    ulong record[RP_STREAM_STACK + RP_WIDE_CHILDREN];  // addresses
    ulong rays[RP_STREAM_STACK + RP_WIDE_CHILDREN];
    // Least distance at which one of the rays enters, or up to seven floats less; with RP_ENTRY_LEAF: the record is a leaf.
    uint entry[RP_STREAM_STACK + RP_WIDE_CHILDREN];
    uint depth;
} rp_stream_stack;

static inline const __global uchar* rp_stacked(const rp_stream_stack* stack, uint place) { return (const __global uchar*)stack->record[place]; }

// A root, from its word (abi/wide.h).
static inline const __global uchar* rp_wide_root(const __global uchar* base, uint word, bool* leaf) {
    *leaf = (word & 1u) != 0u;
    return base + (size_t)(word >> 1) * RP_WIDE_UNIT;
}

static inline void rp_prefetch_record(const __global uchar* record) {
    rp_prefetch(record);
    rp_prefetch(record + 64);
    rp_prefetch(record + 128);
}

// Puts the children that are met onto the stack, the nearest on top. With as few branches as can be: how many children are met, and in which
// order, is often mispredicted, and each mistake costs a CPU as much as testing a ray. So all eight places are written, those that are met first.
// rays: that were tested; one alone meets all that is met.
static inline void rp_push_sorted(rp_stream_stack* stack, const __global rp_wide_node* node, const rp_children_met* met, uint children, ulong rays) {
    const uint8 lane = (uint8)(0u, 1u, 2u, 3u, 4u, 5u, 6u, 7u);
    const int8 is_met = ((uint8)(children) >> lane & 1u) != 0u;
    // Distances less their last three bits, in whose place the number of the child stands: not greater, so that no ray misses what it enters there.
    const uint8 key = rp_sort8(is_met ? ((as_uint8(vload8(0, met->entry)) & ~7u) + 8u) | lane : (uint8)(0u));
    const uint8 order = key & 7u;
    // Byte k: units before child k.
    const ulong places = as_ulong(vload8(0, node->size)) * 0x0101010101010100ul;
    const ulong first = (ulong)((const __global uchar*)node + (size_t)node->children * RP_WIDE_UNIT);
    const uint bottom = stack->depth, count = popcount(children);
    const uint8 place = as_uint8(rp_pick8(as_float8(convert_uint8(as_uchar8(places))), order));
    vstore8(first + convert_ulong8(place * RP_WIDE_UNIT), 0, stack->record + bottom);
    vstore8(rp_is_single(rays) ? (ulong8)(rays) : rp_pick_long8(vload8(0, met->rays), order), 0, stack->rays + bottom);
    vstore8(((key - 8u) & ~7u) | (uint8)(node->leaves) >> order << 31, 0, stack->entry + bottom);
    stack->depth += count;
    // One to three without a branch that depends on their number.
    rp_prefetch_record(rp_stacked(stack, bottom));
    rp_prefetch_record(rp_stacked(stack, bottom + count / 2u));
    rp_prefetch_record(rp_stacked(stack, bottom + count - 1u));
    if (count > 3u)
        for (uint i = 1u; i + 1u < count; i++) rp_prefetch_record(rp_stacked(stack, bottom + i));
}

static inline void rp_push_child(rp_stream_stack* stack, uint place, const __global uchar* first, ulong places, uint k, uint entry, ulong rays) {
    const __global uchar* record = first + ((uint)(places >> (8u * k)) & 255u) * RP_WIDE_UNIT;
    rp_prefetch_record(record);
    stack->record[place] = (ulong)record;
    stack->rays[place] = rays;
    stack->entry[place] = entry;
}

// The same for rays whose order of visits does not matter.
static inline void rp_push_children(rp_stream_stack* stack, const __global rp_wide_node* node, const rp_children_met* met, uint children,
                                    ulong rays) {
    const __global uchar* first = (const __global uchar*)node + (size_t)node->children * RP_WIDE_UNIT;
    const ulong places = as_ulong(vload8(0, node->size)) * 0x0101010101010100ul;
    const uint leaves = children & node->leaves;
    const bool single = rp_is_single(rays);
    uint place = stack->depth;
    stack->depth += popcount(children);
    // Leaves on top: what is hit there needs no further look.
    for (uint left = children & ~leaves; left != 0u; left &= left - 1u) {
        const uint k = rp_lowest(left);
        rp_push_child(stack, place++, first, places, k, 0u, single ? rays : met->rays[k]);
    }
    for (uint left = leaves; left != 0u; left &= left - 1u) {
        const uint k = rp_lowest(left);
        rp_push_child(stack, place++, first, places, k, RP_ENTRY_LEAF, single ? rays : met->rays[k]);
    }
}

// Of the rays, those that are at `entry` before their closest hit.
static inline ulong rp_not_behind_hit(const float16* t, ulong rays, float entry) {
    if (rp_is_single(rays)) return entry <= RP_OF_RAY(t, rp_lowest(rays)) * RP_BOX_WIDEN ? rays : 0ul;
    ulong left = 0ul;
    for (uint p = 0u; p < RP_PACKETS; p++) left |= (ulong)rp_mask16(entry <= t[p] * RP_BOX_WIDEN) << (RP_PACKET_RAYS * p);
    return rays & left;
}

// Where the rays of a packet enter a block entry's bounds. Returns those that meet them, before their closest hit. The arithmetic is that of
// rp_packet_meets: bounds inside others are never entered before them.
// end: of the rays.
static inline uint rp_enter_bounds(const rp_stream* s, uint p, float16 end, uint4 lower, uint4 upper, float16* entry) {
    float16 enter = (float16)(0.0f), leave = end;
    for (uint a = 0u; a < 3u; a++) {
        const float16 low = (float16)(as_float(a == 0u ? lower.x : a == 1u ? lower.y : lower.z));
        const float16 high = (float16)(as_float(a == 0u ? upper.x : a == 1u ? upper.y : upper.z));
        const float16 inverse = s->inverse[a][p];
        const int16 negative = as_int16(inverse) < (int16)(0);
        // In this order of operands neither a -0 nor a NaN takes the place of a distance.
        enter = rp_max(fma(negative ? high : low, inverse, s->near_shift[a][p]), enter);
        leave = rp_min(fma(negative ? low : high, inverse, s->far_shift[a][p]), leave);
    }
    *entry = enter;
    return rp_mask16(enter <= leave * RP_BOX_WIDEN);
}
static inline uint rp_enter_block_entry(const rp_stream* s, uint p, uint4 lower, uint4 upper, float16* entry) {
    return rp_enter_bounds(s, p, s->t[p], lower, upper, entry);
}

// Of the rays of a packet, those that meet the block entry, and not before the place they begin at; and where they enter it.
static inline uint rp_ahead(const rp_stream* s, uint p, ulong rays, const __global uint4* block_entries, uint block_entry, float16* entry) {
    const uint lanes = rp_lanes_of(rays, p);
    if (lanes == 0u) return 0u;
    const uint meets = lanes & rp_enter_block_entry(s, p, block_entries[2u * block_entry], block_entries[2u * block_entry + 1u], entry);
    return meets & rp_mask16((*entry > s->from[p]) | ((*entry == s->from[p]) & ((uint16)(block_entry) >= s->from_block_entry[p])));
}

// The same of all rays; the block entry is behind the others.
static inline ulong rp_still_before(const rp_stream* s, ulong rays, const __global uint4* block_entries, uint block_entry) {
    ulong ahead = 0ul;
    float16 entry;
    for (uint p = 0u; p < RP_PACKETS; p++) ahead |= (ulong)rp_ahead(s, p, rays, block_entries, block_entry, &entry) << (RP_PACKET_RAYS * p);
    return ahead;
}

// The block entry of an absent block: rays for which it is the first one so far will wait there.
#ifdef RP_INSTANCES
#define RP_WAIT_NUMBERS , uint16* wait_number
#else
#define RP_WAIT_NUMBERS
#endif
static inline void rp_meet_absent(rp_stream* s, ulong rays, const __global uint4* block_entries, uint block_entry RP_WAIT_NUMBERS) {
    const uint16 number = (uint16)(block_entry);
    for (uint p = 0u; p < RP_PACKETS; p++) {
        float16 entry;
        uint first = rp_ahead(s, p, rays, block_entries, block_entry, &entry);
        if (first == 0u) continue;
        first &= rp_mask16((entry < s->wait[p]) | ((entry == s->wait[p]) & (number < s->wait_block_entry[p])));
        const int16 better = rp_lanes16(first);
        s->wait[p] = better ? entry : s->wait[p];
        s->wait_block_entry[p] = better ? number : s->wait_block_entry[p];
#ifdef RP_INSTANCES
        wait_number[p] = better ? (uint16)(0u) : wait_number[p];
#endif
        s->stopped |= (ulong)first << (RP_PACKET_RAYS * p);
    }
}

// The ray goes on from a block entry at which it had waited.
static inline void rp_resume_ray(rp_stream* s, uint r, const __global uint4* block_entries, uint block_entry) {
    float16 entry;
    float entries[RP_PACKET_RAYS];
    rp_enter_block_entry(s, r / RP_PACKET_RAYS, block_entries[2u * block_entry], block_entries[2u * block_entry + 1u], &entry);
    vstore16(entry, 0, entries);
    RP_SET_OF_RAY(s->from, r, entries[r % RP_PACKET_RAYS]);
    ((uint*)s->from_block_entry)[r] = block_entry;
    s->resumed |= 1ul << r;
}

// Where the ray has to wait: at an absent block entry that it enters before its closest hit; RP_NONE: nowhere.
static inline uint rp_waits_at(const rp_stream* s, uint r) {
    if (!(s->stopped >> r & 1ul) || RP_OF_RAY(s->wait, r) > RP_OF_RAY(s->t, r) * RP_BOX_WIDEN) return RP_NONE;
    return ((const uint*)s->wait_block_entry)[r];
}

// A stream on its way through the scene.
typedef struct rp_walk {
    rp_stream stream;
    rp_stream_stack stack;
    const __global uchar* record;  // that comes next, ...
    ulong rays;                    // ... and the rays that meet it; 0: the walk has ended
    bool leaf;
    const __global uchar *top, *top_end;
    float16 until[RP_PACKETS];
#ifdef RP_INSTANCES
    // Inside an instance: the stream there, of these rays, whose part of the stack begins there; and the block entry of the instance's block.
    rp_stream inner;
    bool inside;
    ulong inner_rays;
    uint inner_bottom, outer_block_entry;
    // Units (instances.cl): where the ray enters it in the world, number of the instance + 1 (0: it waits in the world), block entry of the object.
    float16 from_entry[RP_PACKETS], wait_entry[RP_PACKETS];
    uint16 from_number[RP_PACKETS], wait_number[RP_PACKETS], from_unit[RP_PACKETS], wait_unit[RP_PACKETS];
    ulong wait_instance[RP_STREAM_RAYS];
    ulong behind;  // rays that have visited all units of from_block_entry up to that one
    ulong kept;    // rays whose block is not there: they stand where they stood
#endif
#ifdef RP_CUTOUTS
    const __global rp_primitive_range* ranges;  // of walks of shadow rays
    uint range_count;
#endif
} rp_walk;

static inline bool rp_in_top(const rp_walk* walk) { return walk->record >= walk->top && walk->record < walk->top_end; }

// Begins with the active rays at the root of the top tree.
static inline void rp_begin_walk(rp_walk* walk, const __global uchar* top) {
    walk->stack.depth = 0u;
    walk->rays = 0ul;
#ifdef RP_INSTANCES
    walk->inside = false;
#endif
    const __global rp_wide_header* header = (const __global rp_wide_header*)top;
    const uint root = header->root;
    walk->top = top;
    walk->top_end = top + header->bytes;
    if (root == RP_NONE) return;
    walk->record = rp_wide_root(top, root, &walk->leaf);
    walk->rays = walk->stream.active;
}

// How far the rays have to be traced: in a block that is entered to their closest hit, in the top tree to where they will wait. (Where they
// begin holds for both: what lies in a block entry's bounds is not entered before them.)
static inline const float16* rp_until(rp_walk* walk) {
#ifdef RP_INSTANCES
    if (walk->inside) return walk->until;
#endif
    const rp_stream* s = &walk->stream;
    if (s->stopped == 0ul || !rp_in_top(walk)) return s->t;
    for (uint p = 0u; p < RP_PACKETS; p++) walk->until[p] = rp_min(s->t[p], s->wait[p]);
    return walk->until;
}

#ifdef RP_INSTANCES
#define RP_STREAM_OF(walk) ((walk)->inside ? &(walk)->inner : &(walk)->stream)
#define RP_BOTTOM_OF(walk) ((walk)->inside ? (walk)->inner_bottom : 0u)
#define RP_END_OF_HITS(walk) ((walk)->inside ? rp_until(walk) : (walk)->stream.t)
static inline void rp_go_outside(rp_walk* walk);
#else
#define RP_STREAM_OF(walk) (&(walk)->stream)
#define RP_BOTTOM_OF(walk) 0u
#define RP_END_OF_HITS(walk) ((walk)->stream.t)
#endif

// Takes the next record off the stack that a ray still has to visit.
static inline void rp_pop_record(rp_walk* walk, const bool any_hit) {
    rp_stream_stack* stack = &walk->stack;
    for (;;) {
        const rp_stream* const s = RP_STREAM_OF(walk);
        const uint bottom = RP_BOTTOM_OF(walk);
        ulong rays = 0ul;
        while (rays == 0ul && stack->depth > bottom) {
            stack->depth--;
            const uint entry = stack->entry[stack->depth];
            rays = stack->rays[stack->depth] & s->active;
            if (!any_hit && rays != 0ul) rays = rp_not_behind_hit(RP_END_OF_HITS(walk), rays, as_float(entry & ~RP_ENTRY_LEAF));
            walk->record = rp_stacked(stack, stack->depth);
            walk->leaf = (entry & RP_ENTRY_LEAF) != 0u;
        }
        walk->rays = rays;
#ifdef RP_INSTANCES
        if (rays == 0ul && walk->inside) {
            rp_go_outside(walk);
            continue;
        }
#endif
        return;
    }
}

static inline ulong rp_hit_primitives(rp_stream* s, ulong rays, const __global rp_wide_leaf* leaf, const bool any_hit) {
    return leaf->kind == RP_WIDE_TRIANGLES ? rp_hit_triangles(s, rays, leaf, any_hit) : rp_hit_spheres(s, rays, leaf, any_hit);
}

// The rays against all primitives of a leaf. Returns those that are stopped by one, if any_hit is set.
static inline ulong rp_visit_leaf(rp_walk* walk, ulong rays, const __global rp_wide_leaf* leaf, const bool any_hit) {
    rp_stream* s = RP_STREAM_OF(walk);
#ifdef RP_CUTOUTS
    const uint all = (1u << leaf->count) - 1u;
    const uint passed = any_hit ? rp_which_may_be_nothing(walk->ranges, walk->range_count, rp_ids_of_leaf(leaf), leaf->count) : 0u;
    ulong stopped = 0ul;
    s->tested = all & ~passed;
    if (s->tested != 0u) stopped = rp_hit_primitives(s, rays, leaf, any_hit);
    s->tested = passed;
    rays &= ~(stopped | s->met_cutout);
    if (passed != 0u && rays != 0ul) s->met_cutout |= rp_hit_primitives(s, rays, leaf, any_hit);
    return stopped;
#else
    return rp_hit_primitives(s, rays, leaf, any_hit);
#endif
}

#ifdef RP_INSTANCES
static inline void rp_step(const rp_geometry* g, rp_walk* walk, uint round, const bool any_hit);
#include "stream/instances.cl"
#endif

// Visits a record and finds the next one. When the walk has ended, the stream's t, primitive and hit_* tell the closest hits, or, if any_hit
// is set, rays that hit something are not active any more; rp_waits_at: where they wait.
static inline void rp_step(const rp_geometry* g, rp_walk* walk, uint round, const bool any_hit) {
    rp_stream* s = RP_STREAM_OF(walk);
    ulong rays = walk->rays;
    if (!walk->leaf) {
        rp_children_met met;
        const __global rp_wide_node* node = (const __global rp_wide_node*)walk->record;
        const uint children = rp_meet_children(s, node, rp_until(walk), rays, any_hit, &met);
        if (children != 0u) {
            if (any_hit)
                rp_push_children(&walk->stack, node, &met, children, rays);
            else
                rp_push_sorted(&walk->stack, node, &met, children, rays);
            // The nearest one needs no further look.
            const uint top = --walk->stack.depth;
            walk->record = rp_stacked(&walk->stack, top);
            walk->rays = walk->stack.rays[top];
            walk->leaf = (walk->stack.entry[top] & RP_ENTRY_LEAF) != 0u;
            return;
        }
    } else {
        const __global rp_wide_leaf* content = (const __global rp_wide_leaf*)walk->record;
        const uint kind = content->kind;
        if (kind == RP_WIDE_BLOCK_ENTRY) {
            const uint4 page = g->pages[content->block];
            const uint root = ((const __global uint*)(content + 1))[0], block_entry = ((const __global uint*)(content + 1))[1];
            if (page.x == RP_NONE) {
#ifdef RP_INSTANCES
                if (walk->inside)
                    rp_meet_absent_inside(walk, rays, g->block_entries, block_entry);
                else
                    rp_meet_absent(s, rays, g->block_entries, block_entry, walk->wait_number);
#else
                rp_meet_absent(s, rays, g->block_entries, block_entry);
#endif
            } else {
#ifdef RP_INSTANCES
                if (walk->inside && (rays & walk->behind) != 0ul) rays = rp_still_before_inside(walk, rays, g->block_entries, block_entry);
#endif
                if ((rays & s->resumed) != 0ul) rays = rp_still_before(s, rays, g->block_entries, block_entry);
                if (rays != 0ul) {
                    if (round != 0u)  // else nothing is noted
                        rp_note_entry(g, (float2)(RP_OF_RAY(s->origin[0], 0), RP_OF_RAY(s->origin[1], 0)),
                                      (float2)(RP_OF_RAY(s->inverse[0], 0), RP_OF_RAY(s->inverse[1], 0)), (uint)popcount(rays), content->block,
                                      round);
                    walk->record = rp_wide_root(rp_block_address(g, page.x), root, &walk->leaf);
                    walk->rays = rays;
                    rp_prefetch_record(walk->record);
                    return;
                }
            }
#ifdef RP_INSTANCES
        } else if (kind == RP_WIDE_INSTANCE) {
            const __global rp_instance* const instance = (const __global rp_instance*)(content + 2);
            rp_go_inside(g, walk, rays, instance, ((const __global uint*)(content + 1))[0] + 1u, g->pages[content->block].y);
            walk->record = rp_wide_root(walk->top, g->objects[instance->object].top.root, &walk->leaf);
            return;
#endif
        } else {
            const ulong hit = rp_visit_leaf(walk, rays, content, any_hit);
            if (any_hit) s->active &= ~hit;
#ifdef RP_INSTANCES
            if (!any_hit && walk->inside) rp_end_inside(walk, rays);
#endif
        }
    }
    rp_pop_record(walk, any_hit);
}

#endif
