// The block: a position-independent piece of geometry with its own bounding volume hierarchy (BVH), and the top tree above
// all blocks. These are the bytes that kernels read; src/store/FORMAT.md says how they lie in a block file.
//
// A block is one run of bytes. It starts with rp_block_header; each section starts at a multiple of 16 bytes:
//   nodes      rp_node[node_count]             inner nodes, two children each, directly behind the header: first those above its block entries, the
//                                              root first, so that a ray can enter the block as a whole, then those beneath them
//   leaves     rp_leaf[leaf_count]             triangle strips
//   vertices   float[3 * vertex_count]         exact positions in world space; a leaf sees a window of up to 256; or coded, see below
//   spheres    rp_sphere[sphere_count]         spheres and points, leaf by leaf
//              rp_u32[sphere_count]            right behind them: their scene-wide ids
//   ids        rp_u32[4 * leaf_count]          triangle k of leaf l has the scene-wide id ids[4 l + k]; unused: RP_NONE; or coded, see below
//   attributes with RP_BLOCK_NORMALS: rp_u32[vertex_count], octahedral shading normals (RP_NONE: this vertex has none); then, with
//              RP_BLOCK_COLORS: rp_u32[vertex_count], red | green << 8 | blue << 16, each the square root of the linear reflectance * 255
//              (RP_NONE: none); then, with RP_BLOCK_UVS: float[2 * vertex_count], u and v of each vertex (zeros: none)
// A block with RP_BLOCK_INSTANCES holds instances alone, and has one block entry: after the nodes come, at leaves_at,
//   instances  rp_instance[leaf_count]         abi/instance.h
//              rp_u32[leaf_count]              right behind them: their scene-wide numbers
#ifndef RAYPAGER_ABI_BLOCK_H
#define RAYPAGER_ABI_BLOCK_H

#include "raypager/abi/types.h"

#define RP_BLOCK_MAGIC 0x4b4c4252u  // "RBLK"
#define RP_BLOCK_ALIGNMENT 64u      // blocks start at, and have sizes that are, multiples of this
#define RP_MAX_BLOCK_BYTES (32u << 20)
#define RP_MAX_BLOCK_ENTRIES 64u    // block entries into one block
#define RP_BLOCK_MAX_DEPTH 40       // inner nodes on the way from the root to a leaf, at most; builders guarantee it, checks refuse more
#define RP_UPPER_TREE_MAX_DEPTH 12  // of these above a block entry, at most

// Child references ------------------------------------------------------------------------------------------------------
// Inner node: its index among the nodes of the block (or of the top tree); bit 31 clear.
// Leaf in a block: bit 31 set, bit 30 clear, and
//   a strip:  bits 0-1 triangles - 1 | bits 2-4 strip switches | bit 5 winding | bit 6 clear | bits 7-29 leaf index
//   spheres:  bits 0-3 spheres - 1 | bit 4 clear | bit 5 they are points | bit 6 set | bits 7-29 index of the first sphere
//   instance: bits 4 and 6 set | bits 0-3 and 5 clear | bits 7-29 its index
// Leaf of the top tree: bits 31 and 30 set, bits 0-29 block entry index; on the device, with single rays, also rp_top_grid.block_entry_count + block
// (see rp_block_entry).
#define RP_REF_LEAF 0x80000000u
#define RP_REF_BLOCK_ENTRY 0xc0000000u
#define RP_REF_EXIT 0xffffffffu     // bottom of a traversal stack; also the root of an empty scene
#define RP_REF_STOPPED 0xfffffffeu  // of a walk: it has come to an absent block
#define RP_REF_RETURN 0xfffffffdu   // on a traversal stack: leave the block, go on in the top tree
#define RP_REF_LEAVE 0xfffffffcu    // on a traversal stack: leave the instance, go on in its block
#define RP_REF_REENTER 0xfffffffbu  // on a traversal stack: leave the instance, and enter its block behind it
#define RP_REF_END 0xfffffffau      // block entries have references below this
#define RP_LEAF_MAX_PRIMITIVES 4u
#define RP_LEAF_WINDING 0x20u
#define RP_LEAF_MAX_SPHERES 16u
#define RP_LEAF_POINTS 0x20u
#define RP_LEAF_SPHERES 0x40u
#define RP_LEAF_INSTANCE 0x50u
#define RP_LEAF_INDEX_SHIFT 7
#define RP_LEAF_INDEX_MASK 0x7fffffu

// Quantised boxes -------------------------------------------------------------------------------------------------------
// A coordinate is 16 bits on a grid: world = origin + cell * RP_GRID_VALUE(q), which kernels have as as_float(0x47000000 | q << 7). A box stores, for
// each axis, lower | upper << 16. Builders round outwards by at least RP_GRID_SLACK cells; tests/property/boxes shows that this suffices for the
// arithmetic of kernels/common/box.cl. An absent child has lower 65535 and upper 0 on every axis.
#define RP_GRID_VALUE(q) (RP_GRID_MIN + 0.5 * (q))
#define RP_GRID_MIN 32768.0
#define RP_GRID_MAX 65535.5
#define RP_GRID_SLACK 0.0625
#define RP_GRID_SPAN 32600.0  // cells that a builder lays over the extent of a block, between margins
#define RP_GRID_MARGIN 17.0   // cells left free below the extent
#define RP_BOX_ABSENT 0x0000ffffu

typedef struct rp_child {
    rp_u32 x, y, z;  // quantised bounds, lower | upper << 16
    rp_u32 ref;
} rp_child;

typedef struct rp_node {
    rp_child child[2];
} rp_node;

// A strip of n triangles (n <= 4) on n + 2 vertices. Triangle 0 has the vertices (0, 1, 2). Triangle k has the new vertex k + 2
// and the last vertex of triangle k - 1, and: the middle one of triangle k - 1 if switch k - 1 is clear, the first one if it is
// set. So, with (A, B, C) the triangle before: (B, C, new), or (A, C, new).
// The order (A, B, C) of triangle 0 is counter-clockwise seen from the side that its normal points to; with RP_LEAF_WINDING set it
// is clockwise. Triangle k keeps its parent's orientation if its strip neighbour was consistently oriented:
// (B, C, new) has the opposite orientation of (A, B, C), (A, C, new) has the same.
// Builders put two triangles into one strip only if that rule holds, so that one winding bit serves all of them.
typedef struct rp_leaf {
    // Bits 0-15 first vertex of the cluster, in units of RP_CLUSTER_UNIT vertices; then six bytes: vertices within the cluster.
    rp_u32 lo, hi;
} rp_leaf;

#define RP_CLUSTER_UNIT 16u
#define RP_CLUSTER_VERTICES 256u

// A sphere, or a point of a coloured cloud: a sphere whose radius takes eight bits. All leaves of a reference are of one kind.
// A point's word: radius code | red << 8 | green << 16 | blue << 24. The code is a float of five exponent and three mantissa bits:
// radius = as_float((code << 20) + RP_POINT_RADIUS_BIAS), exact on every device, from 2^-16 to RP_POINT_LARGEST_RADIUS; code 255 is not
// used. A colour is the square root of the linear reflectance: reflectance = (c / 255)^2.
typedef struct rp_sphere {
    float center[3];
    rp_u32 word;  // sphere: the bits of its radius
} rp_sphere;
#define RP_POINT_RADIUS_SHIFT 20
#define RP_POINT_RADIUS_BIAS ((127u - 16u) << 23)
#define RP_POINT_LARGEST_CODE 254u
#define RP_POINT_MIN_RADIUS 0x1p-16f
#define RP_POINT_LARGEST_RADIUS 57344.0f

// Coded ids and positions, as rp_block_header.flags says -------------------------------------------------------------------
// In scenes that were baked for few bytes a position takes RP_POSITION_STRIDE bytes, 4, 5, 6 or 8, instead of 12: from the lowest bit on,
// RP_POSITION_BITS of x, y and z each, which are multiples of a cell, a power of two, counted from the least of the block: coordinate = base + cell *
// number, where the product is exact. With a stride of 0 they are floats. The bases stand in origin[3], cell[3] and lower[3] of the header, the cell
// in upper[3]. Kernels may read the word behind a position. It lies in the block: where there are leaves, their ids follow.
// clang-format off
#define RP_POSITION_BITS(flags, axis) ((flags) >> 5 * (axis) & 31u)
// clang-format on
#define RP_POSITION_ALL_BITS 0x7fffu
#define RP_POSITION_STRIDE_SHIFT 15
#define RP_POSITION_STRIDE(flags) ((flags) >> RP_POSITION_STRIDE_SHIFT & 15u)
#define RP_POSITION_MAX_BITS 23  // an axis, so that numbers are exact as floats
// With RP_IDS_CODED ids are rp_u32 base, rp_u32 step, then a run of n bits in rp_u32[n / 32 + 2], from the lowest of each on: leaf by leaf
// RP_ID_FIRST_BITS of its first triangle's id, counted from base, and three times RP_ID_STEP_BITS of what the others' are above that, counted from
// step; all modulo 2^32. So the word behind the last bit is there as well, for whoever reads two. What a leaf does not use may be anything.
#define RP_IDS_CODED (1u << 19)
#define RP_ID_FIRST_SHIFT 20
#define RP_ID_FIRST_BITS(flags) ((flags) >> RP_ID_FIRST_SHIFT & 31u)
#define RP_ID_STEP_SHIFT 25
#define RP_ID_STEP_BITS(flags) ((flags) >> RP_ID_STEP_SHIFT & 31u)
#define RP_ID_MAX_BITS 31
#define RP_IDS_ALL_BITS (0x7ffu << 19)

// What vertices have beside a position, as rp_block_header.flags says.
#define RP_BLOCK_NORMALS (1u << 30)
#define RP_BLOCK_COLORS (1u << 31)
// No bits are left there: this one is of attributes_at, where the offset has none so low.
#define RP_BLOCK_UVS 1u
#define RP_BLOCK_INSTANCES 2u  // likewise
#define RP_BLOCK_ATTRIBUTES_AT(attributes_at) ((attributes_at) & ~(RP_BLOCK_UVS | RP_BLOCK_INSTANCES))
#define RP_BLOCK_HAS_UVS(attributes_at) (((attributes_at)&RP_BLOCK_UVS) != 0u)

typedef struct rp_block_header {
    rp_u32 magic, block_index, bytes, flags;
    rp_u32 node_count, leaf_count, vertex_count, sphere_count;
    rp_u32 nodes_at, leaves_at, vertices_at, spheres_at;  // byte offsets from the start of the block
    rp_u32 ids_at, attributes_at /* with RP_BLOCK_UVS, RP_BLOCK_INSTANCES; 0: none */, triangle_count, block_entry_count;
    float origin[4];           // grid: xyz; coded positions: base of x
    float cell[4];             // grid: xyz; base of y
    float lower[4], upper[4];  // exact bounds: xyz; base of z, cell
} rp_block_header;

// A sub-box of a block, and a leaf of the top tree: where a ray enters the block's BVH. The grid is that of the block.
typedef struct rp_block_entry {
    float origin[3];
    rp_u32 block;
    float cell[3];
    rp_u32 root;  // child reference inside the block
} rp_block_entry;
// On the device, with single rays, a record of this kind for each block follows. Where all block entries of a block, two or more, are a subtree of
// the top tree, the reference to that leads to the block's record, and `root` there is the reference: a ray enters the block at node 0 if it is
// resident, and goes on in the subtree if not, to find out which block entry it has to wait at.

// Each block entry also has a rp_u64 path: the way from the root of the top tree down to it, one bit a level (which child), the first
// step in the most significant place, below a leading 1 bit. So a ray that waits at a block entry needs nothing but its index to go on.
#define RP_TOP_MAX_DEPTH 40  // inner nodes on the way from the root of the top tree to a block entry, at most

typedef struct rp_top_grid {
    float origin[3];
    rp_u32 root;  // child reference; RP_REF_EXIT for an empty scene
    float cell[3];
    rp_u32 block_entry_count;
} rp_top_grid;

// Page table: one entry a block. Where it lies (slab << RP_PAGE_SLAB_SHIFT | offset / RP_BLOCK_ALIGNMENT), or RP_NONE while it is
// absent, and two of its header's offsets, so that entering a block needs nothing but this entry, which
// kernels read as one uint4.
typedef struct rp_page {
    rp_u32 address, leaves_at, vertices_at;
    rp_u32 block;  // 0 in the table; in rp_page_changes, whose entry it is
} rp_page;

// Entries that change together, as one argument of a kernel. block: RP_NONE behind the last one.
#define RP_PAGE_CHANGES 48  // with what else kernels take less than the 1024 bytes of arguments that every device takes
typedef struct rp_page_changes {
    rp_page pages[RP_PAGE_CHANGES];
} rp_page_changes;
#define RP_PAGE_SLAB_SHIFT 28
#define RP_PAGE_OFFSET_MASK 0x0fffffffu
#define RP_MAX_SLABS 8

#endif
