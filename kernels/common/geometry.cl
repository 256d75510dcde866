// Where the kernels find blocks: the top tree, the page table, and the slabs of the pool.
#ifndef RP_GEOMETRY_CL
#define RP_GEOMETRY_CL

#include "common/demand.cl"
#include "common/primitive.cl"

// Parameters that every kernel with access to geometry takes, and the argument list that passes them on. RP_SLABS (1 to 8) is set by the
// host: one slab is the common case and costs no selection.
#if RP_SLABS == 1
#define RP_SLAB_PARAMETERS const __global uchar* restrict slab0
#else
#define RP_SLAB_PARAMETERS                                                                                                \
    const __global uchar *restrict slab0, const __global uchar *restrict slab1, const __global uchar *restrict slab2,     \
        const __global uchar *restrict slab3, const __global uchar *restrict slab4, const __global uchar *restrict slab5, \
        const __global uchar *restrict slab6, const __global uchar *restrict slab7
#endif
#ifdef RP_INSTANCES
#define RP_OBJECT_PARAMETER , const __global rp_object* restrict objects
#else
#define RP_OBJECT_PARAMETER
#endif
#define RP_GEOMETRY_PARAMETERS                                                                                                  \
    const rp_top_grid top_grid, const __global uint4 *restrict top_nodes, const __global uint4 *restrict block_entries,         \
        const __global ulong *restrict block_entry_paths, const __global uint4 *restrict pages, __global uint *restrict demand, \
        RP_SLAB_PARAMETERS RP_OBJECT_PARAMETER

typedef struct rp_geometry {
    rp_top_grid top_grid;
    const __global uint4* top_nodes;
    const __global uint4* block_entries;
    const __global ulong* block_entry_paths;
    const __global uint4* pages;   // rp_page
    volatile __global uint* used;  // RP_DEMAND_USED
    volatile __global uchar* marks;
#ifdef RP_INSTANCES
    const __global rp_object* objects;
#endif
    const __global uchar* slab0;
#if RP_SLABS > 1
    const __global uchar *slab1, *slab2, *slab3, *slab4, *slab5, *slab6, *slab7;
#endif
} rp_geometry;

#if RP_SLABS == 1
#define RP_SLAB_ARGUMENTS slab0
#else
#define RP_SLAB_ARGUMENTS slab0, slab1, slab2, slab3, slab4, slab5, slab6, slab7
#endif
#ifdef RP_INSTANCES
#define RP_OBJECT_ARGUMENT objects,
#else
#define RP_OBJECT_ARGUMENT
#endif
#define RP_MAKE_GEOMETRY(block_count)                                                                                \
    {                                                                                                                \
        top_grid, top_nodes, block_entries, block_entry_paths, pages, demand + RP_DEMAND_USED*(size_t)(block_count), \
            rp_marks_of(demand, block_count), RP_OBJECT_ARGUMENT RP_SLAB_ARGUMENTS                                   \
    }

// atomic_add whose result nobody wants. NVIDIA's compiler makes one with a result of it all the same, and where a loop has one, work-items
// of a sub-group that have parted take turns in each pass (YIELD): shadow rays take 1.18 times as long (H100, bench/journal/gpu-paging.md).
static inline void rp_add_without_result(volatile __global uint* word, uint number) {
#ifdef RP_NV_PTX
    asm volatile("red.global.add.u32 [%0], %1;" : : "l"(word), "r"(number));
#else
    atomic_add(word, number);
#endif
}

// `rays` rays enter a block together. origin, reciprocal: of one of their stream. Whether they are counted follows from these bits, since a walk has
// no register left for a number of its own: origins differ where directions are the same, and the other way round. RP_TRACK_ENTERS: 2^k - 1, one in
// 2^k is counted. Rounds count from 1.
static inline void rp_note_entry(const rp_geometry* g, float2 origin, float2 reciprocal, uint rays, uint block, uint round) {
#ifdef RP_TRACK_ENTERS
    const uint2 bits = as_uint2(origin) ^ as_uint2(reciprocal);
    // By a product, since last bits are often 0 where coordinates were subtracted.
    if (((bits.x ^ bits.y) * 0x9e3779b9u >> 16 & RP_TRACK_ENTERS) != 0u) return;
    rp_add_without_result(g->used + block, rays);
    rp_mark(g->marks, block);
#elif defined(RP_TRACK_LAST_ROUND)
    if (g->used[block] == round) return;
    g->used[block] = round;
    rp_mark(g->marks, block);
#endif
}

// A resident block's first byte, from its page table entry.
static inline const __global uchar* rp_block_address(const rp_geometry* g, uint address) {
    const size_t offset = (size_t)(address & RP_PAGE_OFFSET_MASK) * RP_BLOCK_ALIGNMENT;
#if RP_SLABS == 1
    return g->slab0 + offset;
#else
    const uint slab = address >> RP_PAGE_SLAB_SHIFT;
    const __global uchar* low = slab < 2u ? (slab == 0u ? g->slab0 : g->slab1) : (slab == 2u ? g->slab2 : g->slab3);
    const __global uchar* high = slab < 6u ? (slab == 4u ? g->slab4 : g->slab5) : (slab == 6u ? g->slab6 : g->slab7);
    return (slab < 4u ? low : high) + offset;
#endif
}

static inline uint rp_block_entry_block(const rp_geometry* g, uint block_entry) { return g->block_entries[2u * block_entry].w; }
// From the reference to a block as a whole to that of its block entries in the top tree.
static inline uint rp_beneath_block(const rp_geometry* g, uint ref) { return g->block_entries[2u * (ref & ~RP_REF_BLOCK_ENTRY) + 1u].w; }

// A block as traversal reads it. Offsets instead of pointers, because registers are short there, and from the nodes, which it has to have at hand.
typedef struct rp_block_view {
    const __global uint4* nodes;
    uint leaves_at, vertices_at;
} rp_block_view;

static inline const __global uint4* rp_block_nodes(const __global uchar* base) { return (const __global uint4*)(base + sizeof(rp_block_header)); }
static inline const __global uchar* rp_block_of_nodes(const __global uint4* nodes) { return (const __global uchar*)nodes - sizeof(rp_block_header); }
static inline rp_block_view rp_view_block(const rp_geometry* g, uint4 page) {
    rp_block_view view;
    view.nodes = rp_block_nodes(rp_block_address(g, page.x));
    view.leaves_at = page.y - (uint)sizeof(rp_block_header);
    view.vertices_at = page.z - (uint)sizeof(rp_block_header);
    return view;
}
// In 64 bits, which GPUs multiply and add at once; an index of 32 bits would have to wrap first.
static inline const __global uint4* rp_node_at(const __global uint4* nodes, uint index) { return nodes + (ulong)index * 2u; }

// Of a strip's leaf; of spheres: the index of the first one.
static inline uint rp_leaf_index(uint ref) { return ref >> RP_LEAF_INDEX_SHIFT & RP_LEAF_INDEX_MASK; }
static inline uint2 rp_leaf_record(const rp_block_view* block, uint ref) {
    return ((const __global uint2*)((const __global uchar*)block->nodes + block->leaves_at))[rp_leaf_index(ref)];
}
// `width` bits, fewer than 32, from bit `at` on. Reads the word behind theirs, too.
static inline uint rp_run_of_bits(const __global uint* words, uint at, uint width) {
    const ulong both = (ulong)words[(at >> 5) + 1u] << 32 | words[at >> 5];
    return (uint)(both >> (at & 31u)) & ((1u << width) - 1u);
}
// ref: of a strip's leaf, with the number of the triangle in bits 0-1.
static inline uint rp_triangle_id(const __global uchar* block, uint ref) {
    const __global rp_block_header* header = (const __global rp_block_header*)block;
    const uint leaf = rp_leaf_index(ref), k = ref & 3u;
    const uint flags = header->flags;
    if (flags & RP_IDS_CODED) {
        const __global uint* const words = (const __global uint*)(block + header->ids_at);
        const uint first_bits = RP_ID_FIRST_BITS(flags), step_bits = RP_ID_STEP_BITS(flags), at = leaf * (first_bits + 3u * step_bits);
        const uint id = words[0] + rp_run_of_bits(words + 2, at, first_bits);
        return k == 0u ? id : id + words[1] + rp_run_of_bits(words + 2, at + first_bits + (k - 1u) * step_bits, step_bits);
    }
    return ((const __global uint*)(block + header->ids_at))[4u * leaf + k];
}

// The spheres of a block, as rp_sphere: centre, word.
static inline const __global uint4* rp_spheres(const __global uchar* block) {
    const __global rp_block_header* header = (const __global rp_block_header*)block;
    return (const __global uint4*)(block + header->spheres_at);
}
#ifdef RP_INSTANCES
// The instances of a block that holds such alone.
static inline const __global rp_instance* rp_instances(const rp_block_view* block) {
    return (const __global rp_instance*)((const __global uchar*)block->nodes + block->leaves_at);
}
static inline uint rp_instance_number(const rp_block_view* block, uint index) {
    const __global rp_block_header* header = (const __global rp_block_header*)rp_block_of_nodes(block->nodes);
    return ((const __global uint*)(rp_instances(block) + header->leaf_count))[index];
}
#endif

static inline uint rp_sphere_id(const __global uchar* block, uint index) {
    const __global rp_block_header* header = (const __global rp_block_header*)block;
    return ((const __global uint*)(rp_spheres(block) + header->sphere_count))[index];
}
// ref: of a leaf, as in rp_hit.
static inline uint rp_primitive_id(const __global uchar* block, uint ref) {
    return ref & RP_LEAF_SPHERES ? rp_sphere_id(block, rp_leaf_index(ref)) : rp_triangle_id(block, ref);
}

// Centre and radius. ref: of the sphere's leaf.
static inline float4 rp_decode_sphere(uint4 sphere, uint ref) {
    const uint of_point = ((sphere.w & 255u) << RP_POINT_RADIUS_SHIFT) + RP_POINT_RADIUS_BIAS;
    return (float4)(as_float3(sphere.xyz), as_float(ref & RP_LEAF_POINTS ? of_point : sphere.w));
}

#endif
