// A ray through the top tree and the resident blocks. Included twice: RP_ANY_HIT 0 defines rp_closest_walk, 1 defines rp_any_walk.
//
// Order and progress. A ray visits the block entries (sub-boxes of blocks) in the order of a depth-first walk of the top tree, near child first
// for closest hits, child 0 first for any hit. That order follows from the ray and the tree alone. A ray that comes to an absent block
// stops there and keeps nothing but the block entry: later it walks down the block entry's path again, putting on the stack what lies after it in
// the order, and goes on. So it enters each block entry at most once and always moves forward, however block bounds overlap; what a nearer hit
// has pruned is never tested. (The paper, 3.4, keeps a block number in the ray for the same purpose.) The block entries of a block are a subtree
// and follow each other: where the block is resident, the ray enters it once, in place of all of them.
// A shadow ray could look at all resident blocks before it waits, since any hit will do. That moves 3 to 9 % fewer bytes, and takes longer
// (bench/journal/gpu-paging.md).
//
// With RP_RECORD, what rays enter is logged as well (single_ray/visits.cl).
//
// With RP_INSTANCES a leaf may be an instance: the ray goes on in the space of its object, through the tree above the object's blocks, and comes back
// (kernels/single_ray/instances.cl). What it keeps where it stops in there is the block entry of the object, and the instance.
#include "single_ray/persistent.cl"
#include "single_ray/visits.cl"
#ifdef RP_INSTANCES
#include "common/instance.cl"
#endif

// The stack of a walk. With RP_SHARED_STACK its lowest entries lie in local memory, a column for each work-item: those of a sub-group that stand at
// different depths reach theirs at once there, where private memory would be read line by line. Rays that scatter gain by that
// (bench/journal/gpu-traversal.md).
#undef RP_STACK_CLEAR
#undef RP_STACK_PUT
#undef RP_STACK_DROP
#undef RP_STACK_GET
#undef RP_BLOCK_IS_OPENED
#undef RP_FAR
#ifdef RP_INSTANCES
// Inside an instance distances count from where the ray begins there. Twice as much wider: `start` is rounded, too. Never less than 0, which is more
// than what marks on the stack have.
#define RP_FAR(end) (w->ray.instance ? rp_max((end) * (RP_BOX_WIDEN * RP_BOX_WIDEN) - w->ray.start, 0.0f) : (end)*RP_BOX_WIDEN)
#else
#define RP_FAR(end) ((end)*RP_BOX_WIDEN)
#endif
// Whether a ray that comes to a block looks at its block entries one by one in the top tree. A recorded one always does: the log is of block entries.
#ifdef RP_RECORD
#define RP_BLOCK_IS_OPENED(page) true
#else
#define RP_BLOCK_IS_OPENED(page) ((page).x == RP_NONE)
#endif
#if defined(RP_SHARED_STACK) && !RP_ANY_HIT
#define RP_STACK_CLEAR() w->depth = 0u
#define RP_STACK_PUT(entry)                                \
    do {                                                   \
        if (w->depth < RP_SHARED_STACK)                    \
            w->shared[w->depth * RP_GROUP_SIZE] = (entry); \
        else                                               \
            stack[w->depth] = (entry);                     \
        w->depth++;                                        \
    } while (0)
#define RP_STACK_DROP() w->depth--
#define RP_STACK_GET() (w->depth < RP_SHARED_STACK ? w->shared[w->depth * RP_GROUP_SIZE] : stack[w->depth])
#else
#define RP_STACK_CLEAR() w->top = stack
#define RP_STACK_PUT(entry) *w->top++ = (entry)
#define RP_STACK_DROP() w->top--
#define RP_STACK_GET() (*w->top)
#endif

#if RP_ANY_HIT
#define RP_WALK rp_any_walk
#define RP_BEGIN rp_begin_any
#define RP_TRAVERSE rp_traverse_any
#define RP_LEAF rp_any_at_leaf
#define RP_ENTER rp_any_enter
#define RP_TO_TOP rp_any_to_top
#define RP_STOPPED_AT rp_any_block_entry
#define RP_STEP rp_any_step
#define RP_DESCEND rp_any_descend
#define RP_GO_INSIDE rp_any_go_inside
#define RP_GO_OUTSIDE rp_any_go_outside
#define RP_LEAVE_INSTANCE rp_any_leave_instance
#define RP_RESUME_INSIDE rp_any_resume_inside
#define RP_TAKE_PLACED rp_any_take_placed
#define RP_STANDS_AT rp_any_stands_at
#define RP_ENTRY_IN_WORLD rp_any_entry_in_world
#define RP_STACK_ENTRY uint
#define RP_PUSH(reference, entry) RP_STACK_PUT(reference)
#define RP_POP()                     \
    do {                             \
        RP_STACK_DROP();             \
        w->current = RP_STACK_GET(); \
    } while (0)
#define RP_END w->search.t_limit
#else
#define RP_WALK rp_closest_walk
#define RP_BEGIN rp_begin_closest
#define RP_TRAVERSE rp_traverse_closest
#define RP_LEAF rp_closest_at_leaf
#define RP_ENTER rp_closest_enter
#define RP_TO_TOP rp_closest_to_top
#define RP_STOPPED_AT rp_closest_block_entry
#define RP_STEP rp_closest_step
#define RP_DESCEND rp_closest_descend
#define RP_GO_INSIDE rp_closest_go_inside
#define RP_GO_OUTSIDE rp_closest_go_outside
#define RP_LEAVE_INSTANCE rp_closest_leave_instance
#define RP_RESUME_INSIDE rp_closest_resume_inside
#define RP_TAKE_PLACED rp_closest_take_placed
#define RP_STANDS_AT rp_closest_stands_at
#define RP_ENTRY_IN_WORLD rp_closest_entry_in_world
#define RP_STACK_ENTRY uint2
#define RP_PUSH(reference, entry) RP_STACK_PUT((uint2)((reference), as_uint(entry)))
// Skips what lies beyond the closest hit so far; equal distances stay, for the tie is decided by primitive id.
// The entry is read twice: with a copy of it kept, what Mesa's llvmpipe 22.3 compiled crashed.
#define RP_POP()                       \
    do {                               \
        RP_STACK_DROP();               \
        w->current = RP_STACK_GET().x; \
    } while (as_float(RP_STACK_GET().y) > w->far)
#define RP_END w->best.t
#endif

#undef RP_STANDING_PARAMETER
#ifdef RP_INSTANCES
#define RP_STANDING_PARAMETER , const rp_standing* standing
#else
#define RP_STANDING_PARAMETER
#endif

#ifndef RP_WALK_WAITS
// What a walk has to remember shares a word with the axis of its shear, since registers are short.
#define RP_WALK_WAITS 1u    // it is entering the block that it waited for
#define RP_WALK_SERVED 2u   // a hit was found in the block that it had waited for
#define RP_WALK_IN_VAIN 4u  // none was
#define RP_WALK_NOTES 7u
#endif

// A ray on its way. It has ended when current is RP_REF_EXIT, or RP_REF_STOPPED where it has to wait.
typedef struct RP_WALK {
    rp_ray ray;
    rp_shear shear;
    rp_grid_ray grid_ray;
    // The block in which it is; of the top tree there are only nodes. Of a walk that has stopped, leaves_at is the block entry.
    rp_block_view block;
    uint current;
    float far;  // where the walk ends, times RP_BOX_WIDEN
#ifdef RP_INSTANCES
    float3 origin, direction;  // of the ray in the world
#if RP_INSTANCE_LEVELS > 1
    uint chain_count;                       // how many instances it is inside of
    uint entry;                             // the block entry at which it is, in the innermost space
    uint entry_around[RP_INSTANCE_LEVELS];  // likewise where each of its instances lies
    bool behind;                            // it has stopped where an instance ends, at the block where that lies
#else
    uint world_entry;  // the block entry at which the ray is there
#endif
#endif
#if defined(RP_SHARED_STACK) && !RP_ANY_HIT
    uint depth;
    __local RP_STACK_ENTRY* shared;  // this work-item's column of the stack, set by the kernel
#else
    RP_STACK_ENTRY* top;  // where the next entry goes: NVIDIA's compiler makes two instructions less of it than of a depth
#endif
#if RP_ANY_HIT
    rp_any_search search;
    bool hit;
#else
    rp_hit best;
    uint block_index;
#endif
#ifdef RP_RECORD
    rp_visit_log visits;
#endif
} RP_WALK;

static inline void RP_TO_TOP(const rp_geometry* g, RP_WALK* w) {
    float3 origin = (float3)(g->top_grid.origin[0], g->top_grid.origin[1], g->top_grid.origin[2]);
    float3 cell = (float3)(g->top_grid.cell[0], g->top_grid.cell[1], g->top_grid.cell[2]);
#ifdef RP_INSTANCES
    if (w->ray.instance) {
        const __global rp_top_grid* const top = &g->objects[w->ray.instance->object].top;
        origin = rp_load3(top->origin);
        cell = rp_load3(top->cell);
    }
#endif
    w->grid_ray = rp_make_grid_ray(&w->ray, origin, cell);
    w->block.nodes = g->top_nodes;
}

// At the end: the block entry to wait at, or RP_NONE if the walk is complete.
static inline uint RP_STOPPED_AT(const RP_WALK* w) { return w->current == RP_REF_STOPPED ? w->block.leaves_at : RP_NONE; }

// From `current` down to what a path leads to; what comes after that is put on the stack.
static inline void RP_DESCEND(const rp_geometry* g, RP_WALK* w, RP_STACK_ENTRY* stack, ulong path) {
    for (int level = 62 - (int)clz(path); level >= 0; level--) {
#ifdef RP_RECORD
        // The ray may have stopped at any block entry of a block, where the log was full.
        if (w->current >= RP_REF_BLOCK_ENTRY) w->current = rp_beneath_block(g, w->current);
#endif
        // A block as a whole: this block entry is the first of it that the ray has come to, or it would have stopped there.
        if (w->current >= RP_REF_BLOCK_ENTRY) break;
        const __global uint4* const node = rp_node_at(w->block.nodes, w->current);
        const uint4 child0 = node[0], child1 = node[1];
        const float entry0 = rp_box_entry(child0, &w->ray, &w->grid_ray), entry1 = rp_box_entry(child1, &w->ray, &w->grid_ray);
        const uint taken = (uint)(path >> level) & 1u;
        const uint4 sibling = taken ? child0 : child1;
        const float sibling_entry = taken ? entry0 : entry1;
#if RP_ANY_HIT
        const uint first = 0u;
#else
        const uint first = entry1 < entry0 ? 1u : 0u;
#endif
        if (taken == first && rp_box_is_met(sibling_entry, rp_box_exit(sibling, &w->ray, &w->grid_ray, w->far))) RP_PUSH(sibling.w, sibling_entry);
        w->current = taken ? child1.w : child0.w;
    }
}

#if defined(RP_INSTANCES) && RP_INSTANCE_LEVELS > 1
#include "single_ray/nested.cl"
#elif defined(RP_INSTANCES)
#include "single_ray/instances.cl"
#endif

// Puts the walk at block entry `start`, or at the beginning (RP_NONE). REQUIRES: ray, and search or best, are set.
static inline void RP_BEGIN(const rp_geometry* g, RP_WALK* w, RP_STACK_ENTRY* stack, uint start RP_STANDING_PARAMETER) {
    w->shear = rp_make_shear(&w->ray);
    RP_TO_TOP(g, w);
    w->current = g->top_grid.root;
    RP_STACK_CLEAR();
    w->far = RP_FAR(RP_END);
#ifdef RP_INSTANCES
    w->origin = w->ray.origin;
    w->direction = w->ray.direction;
#if RP_INSTANCE_LEVELS > 1
    w->chain_count = 0u;
    w->behind = false;
#endif
#endif
#if RP_ANY_HIT
    w->hit = false;
#else
    if (start != RP_NONE) w->shear.axis |= RP_WALK_WAITS;
    w->block_index = RP_NONE;
#endif
    RP_PUSH(RP_REF_EXIT, -1.0f);
    if (start == RP_NONE) return;
    RP_DESCEND(g, w, stack, g->block_entry_paths[start]);
#ifdef RP_INSTANCES
    if (standing->block_entry != RP_NONE) RP_RESUME_INSIDE(g, w, stack, start, standing);
#endif
}

// From an inner node to one of its children, or to what comes next on the stack.
static inline void RP_STEP(RP_WALK* w, RP_STACK_ENTRY* stack) {
    const __global uint4* const node = rp_node_at(w->block.nodes, w->current);
    const uint4 child0 = node[0], child1 = node[1];
    const float entry0 = rp_box_entry(child0, &w->ray, &w->grid_ray), entry1 = rp_box_entry(child1, &w->ray, &w->grid_ray);
    const bool hit0 = rp_box_is_met(entry0, rp_box_exit(child0, &w->ray, &w->grid_ray, w->far));
    const bool hit1 = rp_box_is_met(entry1, rp_box_exit(child1, &w->ray, &w->grid_ray, w->far));
#if RP_ANY_HIT
    if (hit0 && hit1) {
        RP_PUSH(child1.w, entry1);
        w->current = child0.w;
    } else if (hit0 || hit1) {
        w->current = hit0 ? child0.w : child1.w;
    } else {
        RP_POP();
    }
#else
    // Without branches but for what is done with the stack: in most steps some work-items of a sub-group go each way.
    const bool second = !hit0 || (hit1 && entry1 < entry0);
    if (hit0 && hit1) RP_PUSH(second ? child0.w : child1.w, second ? entry0 : entry1);
    w->current = second ? child1.w : child0.w;
    if (!(hit0 || hit1)) RP_POP();
#endif
}

// At a leaf.
static inline void RP_LEAF(const rp_geometry* g, RP_WALK* w, RP_STACK_ENTRY* stack) {
#ifdef RP_INSTANCES
    if ((w->current & RP_LEAF_INSTANCE) == RP_LEAF_INSTANCE) {
        const uint index = rp_leaf_index(w->current);
        RP_PUSH(RP_REF_LEAVE, -1.0f);
        RP_GO_INSIDE(g, w, rp_instances(&w->block) + index, rp_instance_number(&w->block, index) + 1u);
        return;
    }
#endif
#if RP_ANY_HIT
    if (!rp_leaf_any(&w->ray, &w->shear, &w->block, w->current, &w->search)) {
        RP_POP();
        return;
    }
    w->hit = true;
#ifdef RP_RECORD
    if (w->visits.on) {
        // The log marks all blocks on the way that stop the ray, up to an absent one: goes on behind this block entry.
        rp_visit_stop(&w->visits, ((const __global rp_block_header*)rp_block_of_nodes(w->block.nodes))->block_index);
        do RP_POP();
        while (w->current != RP_REF_RETURN);
        return;
    }
#endif
    w->current = RP_REF_EXIT;
#else
    rp_leaf_closest(g, &w->ray, &w->shear, &w->block, w->block_index, w->current, &w->best);
    w->far = RP_FAR(RP_END);
    RP_POP();
#endif
}

// At a block entry: enters its block, opens it, or stops.
static inline void RP_ENTER(const rp_geometry* g, RP_WALK* w, RP_STACK_ENTRY* stack, uint round) {
    const uint block_entry = w->current & ~RP_REF_BLOCK_ENTRY;
    const uint4 a = g->block_entries[2u * block_entry], b = g->block_entries[2u * block_entry + 1u];
    const bool whole = block_entry >= g->top_grid.block_entry_count;
    uint4 page;
    // A branch, so that the page of a whole block need not wait for its record.
    if (whole)
        page = g->pages[block_entry - g->top_grid.block_entry_count];
    else
        page = g->pages[a.w];
    if (whole && RP_BLOCK_IS_OPENED(page)) {
        w->current = b.w;
        return;
    }
    if (page.x == RP_NONE) {
        w->block.leaves_at = block_entry;
        w->current = RP_REF_STOPPED;
        return;
    }
#if !RP_ANY_HIT
    w->block_index = a.w;
#endif
#ifdef RP_RECORD
#if RP_ANY_HIT
    if (!w->hit)  // what it tests beyond its end is not used
#else
    if (!rp_visit_add(&w->visits, RP_VISIT_ENTER, a.w)) {
        w->block.leaves_at = block_entry;
        w->current = RP_REF_STOPPED;
        return;
    }
#endif
#endif
        rp_note_entry(g, w->ray.origin.xy, w->ray.reciprocal.xy, 1u, a.w, round);
#ifdef RP_INSTANCES
#if RP_INSTANCE_LEVELS > 1
    w->entry = block_entry;
#else
    if (!w->ray.instance) w->world_entry = block_entry;
#endif
#endif
    w->block = rp_view_block(g, page);
    w->grid_ray = rp_make_grid_ray(&w->ray, as_float3_xyz(a), as_float3_xyz(b));
    RP_PUSH(RP_REF_RETURN, -1.0f);
    w->current = whole ? 0u : b.w;
}

// Goes on to the end of the walk. With RP_PERSISTENT, all work-items of a sub-group come here together, those whose walks have ended as
// well, and return together when too few have walks left. Leaves, returns and block entries are looked at in turn, so that a ray that comes from
// one to the next does not wait for the others to go round the loop.
static inline void RP_TRAVERSE(const rp_geometry* g, RP_WALK* w, RP_STACK_ENTRY* stack, uint round) {
    do {
        RP_WHILE_INNER(w->current) {
            RP_STEP(w, stack);
#ifdef RP_MIN_INNER
            // A vote costs a fifth of a step.
            if (!(w->current & RP_REF_LEAF)) RP_STEP(w, stack);
#endif
        }
        RP_CONVERGE();
        if (RP_AT_LEAF(w->current)) RP_LEAF(g, w, stack);
        RP_CONVERGE();
        if (w->current == RP_REF_RETURN) {
            RP_TO_TOP(g, w);
#if !RP_ANY_HIT
            if (w->shear.axis & RP_WALK_WAITS) w->shear.axis ^= RP_WALK_WAITS | (w->best.found_in != RP_NONE ? RP_WALK_SERVED : RP_WALK_IN_VAIN);
#endif
            RP_POP();
        }
#ifdef RP_INSTANCES
        if (w->current == RP_REF_LEAVE || w->current == RP_REF_REENTER) RP_LEAVE_INSTANCE(g, w, stack);
#endif
        if (w->current >= RP_REF_BLOCK_ENTRY && w->current < RP_REF_END) RP_ENTER(g, w, stack, round);
    } while (RP_GOES_ON(w->current));
#if defined(RP_RECORD) && RP_ANY_HIT
    if (w->hit) w->current = RP_REF_EXIT;
#endif
}

#undef RP_WALK
#undef RP_BEGIN
#undef RP_TRAVERSE
#undef RP_LEAF
#undef RP_ENTER
#undef RP_TO_TOP
#undef RP_STOPPED_AT
#undef RP_STEP
#undef RP_DESCEND
#undef RP_GO_INSIDE
#undef RP_GO_OUTSIDE
#undef RP_LEAVE_INSTANCE
#undef RP_RESUME_INSIDE
#undef RP_TAKE_PLACED
#undef RP_STANDS_AT
#undef RP_ENTRY_IN_WORLD
#undef RP_STACK_ENTRY
#undef RP_PUSH
#undef RP_POP
#undef RP_END
