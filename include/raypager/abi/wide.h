// The wide form: a block, or the top tree, as it lies in the memory of a CPU. A vector unit tests one ray against eight boxes, or one
// box against sixteen rays, so nodes have eight children, and what is tested together lies side by side. src/block/wide_* makes it from
// the stored form (block.h) in linear time; kernels/stream/traverse.cl walks it.
//
// Records (nodes and leaves) are multiples of RP_WIDE_UNIT bytes. The children of a node follow each other, in order, from
// node + RP_WIDE_UNIT * children on: no reference needs a base, and a record may lie anywhere.
//
// A block, or the top tree: rp_wide_header | records | RP_WIDE_GUARD bytes of nothing, for vector loads that reach past a record.
// A root is a word: its offset from the start, in units, times two, plus one if it is a leaf. Those of a block stand in the block entries.
#ifndef RAYPAGER_ABI_WIDE_H
#define RAYPAGER_ABI_WIDE_H

#include "raypager/abi/types.h"

#define RP_WIDE_CHILDREN 8
#define RP_WIDE_UNIT 16u
#define RP_WIDE_GUARD 64u
#define RP_MAX_WIDE_BYTES (128u << 20)  // of a block
#define RP_WIDE_MAX_DEPTH 40            // nodes on the way from a root to a leaf, in a block or in the top tree, at most

// A plane lies at origin + cell * q, with cell = as_float(exponent << 23). Cells are so large that this is exact in single precision.
typedef struct rp_wide_node {
    float origin[3];
    rp_u32 children;  // where the first child lies, in units from here
    rp_u8 exponent[3];
    rp_u8 leaves;       // bit k: child k is a leaf
    rp_u8 size[8];      // of each child, in units; their sum is at most 255
    rp_u8 lower[3][8];  // by axis, by child
    rp_u8 upper[3][8];
    rp_u8 count;  // children; they are the first ones
    rp_u8 pad[3];
} rp_wide_node;

// A leaf begins with this word, and goes on as its kind says.
#define RP_WIDE_TRIANGLES 0u
#define RP_WIDE_SPHERES 1u
#define RP_WIDE_BLOCK_ENTRY 2u
#define RP_WIDE_INSTANCE 3u
#define RP_WIDE_NORMALS 1u
#define RP_WIDE_POINTS 2u
#define RP_WIDE_COLORS 4u
#define RP_WIDE_UVS 8u
typedef struct rp_wide_leaf {
    rp_u8 kind;
    rp_u8 count;     // primitives
    rp_u8 vertices;  // that the triangles share
    rp_u8 flags;     // RP_WIDE_NORMALS, RP_WIDE_POINTS, RP_WIDE_COLORS, RP_WIDE_UVS
    rp_u32 block;    // index
    // Triangles: float x[vertices], y[vertices], z[vertices]; rp_u8 corner[3][count], padded to a multiple of 4; rp_u32 id[count];
    //   with RP_WIDE_NORMALS: rp_u32 normal[vertices] (octahedral; RP_NONE: none). Corners 0, 1, 2 are counter-clockwise seen from the side
    //   of the normal. With RP_WIDE_COLORS: then rp_u32 color[vertices], as in block.h. With RP_WIDE_UVS: then float u[vertices], v[vertices].
    // Spheres: after 8 bytes of nothing rp_sphere sphere[count], rp_u32 id[count]. With RP_WIDE_POINTS they are points.
    // Block entry: rp_u32 root in the block, rp_u32 index of the block entry. `count` is 0.
    // Instance: rp_u32 its scene-wide number, rp_u32 0, rp_instance. `count` is 0.
} rp_wide_leaf;

// What stands beside the wide top tree for each block entry: its bounds, with slack, inside those that the top tree has for it.
// The block lies where rp_block_entry has it.
typedef struct rp_wide_block_entry {
    float lower[3];
    rp_u32 block;
    float upper[3];
    rp_u32 root;  // word
} rp_wide_block_entry;

#define RP_WIDE_LEAF_TRIANGLES 16u
#define RP_WIDE_LEAF_VERTICES 16u
#define RP_WIDE_LEAF_SPHERES 16u

#define RP_WIDE_MAGIC 0x4b4c4257u  // "WBLK"
typedef struct rp_wide_header {
    rp_u32 magic, bytes;
    rp_u32 block;  // index; RP_NONE: the top tree
    rp_u32 root;   // of the top tree; RP_NONE: the scene is empty
} rp_wide_header;

// Boxes are made larger on every side by these shares of their longest edge and of the largest coordinate in them, for the roundings of
// kernels/stream/stream.cl.
#define RP_WIDE_SLACK_OF_EXTENT 0x1p-20
#define RP_WIDE_SLACK_OF_COORDINATE 0x1p-25

#endif
