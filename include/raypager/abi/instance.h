// Instances: objects that are placed in the world by affine transforms.
#ifndef RAYPAGER_ABI_INSTANCE_H
#define RAYPAGER_ABI_INSTANCE_H

#include "raypager/abi/block.h"
#include "raypager/abi/types.h"

// Where an object is, seen from a ray: object = base + to_object (world - center), where base is the middle of the object's box, in its own space,
// and center the place in the world where that has come to. Both are floats, and what they say is the placement: the other way is their exact
// inverse.
typedef struct rp_instance {
    float to_object[9];  // linear part, rows
    float center[3];
    float reach;                 // of the placed object around center, rounded up
    rp_u32 object;               // its number
    rp_u32 path_low, path_high;  // from the root of its block to its leaf, as of block entries (abi/block.h)
} rp_instance;

// Instances may lie in the blocks of objects, too, but only of objects with fewer levels of them: so there are no cycles.
#define RP_INSTANCE_MAX_LEVELS 4u

// An object has a tree of its own above its blocks, in its own space. Its nodes lie among those of the top tree, its block entries among all others.
typedef struct rp_object {
    rp_top_grid top;
    float base[3];  // the middle of its box
    rp_u32 levels;  // of instances in it: 0, there are none
} rp_object;

// A placed object reaches beyond the box of its placed corners by this share of its extent and of its coordinates: so rays that meet it by the
// arithmetic of kernels/common/instance.cl meet its box in the world, too.
#define RP_INSTANCE_SLACK 0x1p-20f

#endif
