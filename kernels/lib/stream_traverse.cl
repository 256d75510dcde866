// A stream of rays through the wide top tree and the resident blocks.
//
// Order and progress. Hits do not depend on the order of visits (primitive.cl), so a stream visits what its rays meet in whatever order
// suits them together. Rays that come to an absent block note it and go on: when the stream ends, each ray has been tested against all
// resident blocks on its way, and a ray that met an absent one looks up the first absent portal in its own order (first_absent.cl),
// which is the order of traverse.cl, from where it stood. There it waits, and keeps the round. When it goes on, blocks that have been
// resident since that round or before are behind it. So a ray waits at each portal at most once and always moves forward.
#ifndef RP_STREAM_TRAVERSE_CL
#define RP_STREAM_TRAVERSE_CL

#include "lib/geometry.cl"
#include "lib/wide_leaf.cl"
#include "lib/wide_node.cl"

#define RP_STREAM_STACK (2 * RP_WIDE_MAX_DEPTH * (RP_WIDE_CHILDREN - 1) + 2)
#define RP_ENTRY_LEAF 0x80000000u  // beside the bits of a distance, which is not negative

typedef struct rp_stream_stack {
    const __global uchar* record[RP_STREAM_STACK];
    ulong rays[RP_STREAM_STACK];
    uint entry[RP_STREAM_STACK];  // least distance at which one of the rays enters; with RP_ENTRY_LEAF: the record is a leaf
    uint depth;
} rp_stream_stack;

// A root, from its word (abi/wide.h).
static inline const __global uchar* rp_wide_root(const __global uchar* base, uint word, bool* leaf) {
    *leaf = (word & 1u) != 0u;
    return base + (size_t)(word >> 1) * RP_WIDE_UNIT;
}

static inline void rp_fetch_record(const __global uchar* record) {
    rp_fetch_early(record);
    rp_fetch_early(record + 64);
    rp_fetch_early(record + 128);
}

// Puts the children that are met onto the stack, the nearest on top.
static inline void rp_push_children(rp_stream_stack* stack, const __global rp_wide_node* node, const rp_children_met* met, uint children,
                                    const bool any_hit) {
    const __global uchar* first = (const __global uchar*)node + (size_t)node->children * RP_WIDE_UNIT;
    // Byte k: units before child k.
    const ulong places = as_ulong(vload8(0, node->size)) * 0x0101010101010100ul;
    const uint leaves = node->leaves, bottom = stack->depth;
    for (; children != 0u; children &= children - 1u) {
        const uint k = rp_lowest(children);
        const __global uchar* record = first + ((uint)(places >> (8u * k)) & 255u) * RP_WIDE_UNIT;
        rp_fetch_record(record);
        uint place = stack->depth++;
        uint entry = 0u;
        if (!any_hit) {
            entry = as_uint(met->entry[k]);
            for (; place > bottom && (stack->entry[place - 1u] & ~RP_ENTRY_LEAF) < entry; place--) {
                stack->record[place] = stack->record[place - 1u];
                stack->rays[place] = stack->rays[place - 1u];
                stack->entry[place] = stack->entry[place - 1u];
            }
        }
        stack->record[place] = record;
        stack->rays[place] = met->rays[k];
        stack->entry[place] = entry | (leaves >> k & 1u ? RP_ENTRY_LEAF : 0u);
    }
}

// Of the rays, those whose closest hit is not before `entry`.
static inline ulong rp_not_before_hit(const rp_stream* s, ulong rays, float entry) {
    ulong left = 0ul;
    for (uint p = 0u; p < RP_PACKETS; p++) left |= (ulong)rp_mask16(entry <= s->t[p] * RP_BOX_WIDEN) << (RP_PACKET_RAYS * p);
    return rays & left;
}

// Rays that did not test the block in an earlier launch.
static inline ulong rp_without_tested(const rp_stream* s, ulong rays, uint resident_since) {
    for (ulong resumed = rays & s->resumed; resumed != 0ul; resumed &= resumed - 1ul) {
        const uint r = rp_lowest(resumed);
        if (resident_since <= s->tested_until[r]) rays &= ~(1ul << r);
    }
    return rays;
}

// A stream on its way through the scene.
typedef struct rp_walk {
    rp_stream stream;
    rp_stream_stack stack;
    const __global uchar* record;  // that comes next, ...
    ulong rays;                    // ... and the rays that meet it; 0: the walk has ended
    bool leaf;
} rp_walk;

// Begins with the active rays at the root of the top tree.
static inline void rp_begin_walk(rp_walk* walk, const __global uchar* top) {
    walk->stack.depth = 0u;
    walk->rays = 0ul;
    const uint root = ((const __global rp_wide_header*)top)->root;
    if (root == RP_NONE) return;
    walk->record = rp_wide_root(top, root, &walk->leaf);
    walk->rays = walk->stream.active;
}

// Takes the next record off the stack that a ray still has to visit.
static inline void rp_pop_record(rp_walk* walk, const bool any_hit) {
    rp_stream_stack* stack = &walk->stack;
    ulong rays = 0ul;
    while (rays == 0ul && stack->depth > 0u) {
        stack->depth--;
        const uint entry = stack->entry[stack->depth];
        rays = stack->rays[stack->depth] & walk->stream.active;
        if (!any_hit && rays != 0ul) rays = rp_not_before_hit(&walk->stream, rays, as_float(entry & ~RP_ENTRY_LEAF));
        walk->record = stack->record[stack->depth];
        walk->leaf = (entry & RP_ENTRY_LEAF) != 0u;
    }
    walk->rays = rays;
}

// Visits a record and finds the next one. When the walk has ended, the stream's t, primitive and hit_* tell the closest hits, or, if any_hit
// is set, rays that hit something are not active any more; `stopped`: rays that met an absent block.
static inline void rp_step(const rp_geometry* g, rp_walk* walk, uint round, const bool any_hit) {
    rp_stream* s = &walk->stream;
    ulong rays = walk->rays;
    if (!walk->leaf) {
        rp_children_met met;
        const __global rp_wide_node* node = (const __global rp_wide_node*)walk->record;
        const uint children = rp_meet_children(s, node, rays, any_hit, &met);
        if (children != 0u) {
            rp_push_children(&walk->stack, node, &met, children, any_hit);
            // The nearest one needs no further look.
            const uint top = --walk->stack.depth;
            walk->record = walk->stack.record[top];
            walk->rays = walk->stack.rays[top];
            walk->leaf = (walk->stack.entry[top] & RP_ENTRY_LEAF) != 0u;
            return;
        }
    } else {
        const __global rp_wide_leaf* content = (const __global rp_wide_leaf*)walk->record;
        const uint kind = content->kind;
        if (kind == RP_WIDE_PORTAL) {
            const uint4 page = g->pages[content->block];
            if (page.x == RP_NONE) {
                s->stopped |= rays;
            } else {
                rays = rp_without_tested(s, rays, page.y);
                if (rays != 0ul) {
                    if (g->used[content->block] != round) g->used[content->block] = round;
                    walk->record = rp_wide_root(rp_block_address(g, page.x), ((const __global uint*)(content + 1))[0], &walk->leaf);
                    walk->rays = rays;
                    rp_fetch_record(walk->record);
                    return;
                }
            }
        } else {
            const ulong hit = kind == RP_WIDE_TRIANGLES ? rp_hit_triangles(s, rays, content, any_hit) : rp_hit_spheres(s, rays, content, any_hit);
            if (any_hit) s->active &= ~hit;
        }
    }
    rp_pop_record(walk, any_hit);
}

#endif
