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
    float reach;    // of the placed object around center, rounded up
    rp_u32 object;  // its number
    // From the root of its block to its leaf, as of block entries (abi/block.h); the high bits of path_high are the number of its traits.
    rp_u32 path_low, path_high;
} rp_instance;
#define RP_INSTANCE_PATH_HIGH 0x1ffu  // the bits of path_high that are of the path
#define RP_INSTANCE_TRAITS_SHIFT 9    // from here on: the number of the instance's traits, from 1; 0: it has none
#define RP_MAX_INSTANCE_TRAITS 0x7fffffu

// What some instances have that others of their object do not. Those that shine have traits of their own; others share equal ones.
typedef struct rp_instance_traits {
    float color[3];      // from 0 to 1: diffuse reflectances and transmittances are multiplied by it
    rp_u32 material;     // in place of those of the object; RP_NONE: they stay
    rp_u32 first_light;  // of the instance, among all lights; RP_NONE: it does not shine, and then these say nothing:
    rp_u32 light_count;  // first those of the object's primitives, in the order of their ids, then unseen ones
    rp_u32 object;
    rp_u32 unused;
} rp_instance_traits;

// Instances may lie in the blocks of objects, too, but only of objects with fewer levels of them: so there are no cycles.
#define RP_INSTANCE_MAX_LEVELS 4u

// An object has a tree of its own above its blocks, in its own space. Its nodes lie among those of the top tree, its block entries among all others.
typedef struct rp_object {
    rp_top_grid top;
    float base[3];       // the middle of its box
    rp_u32 levels;       // of instances in it: 0, there are none
    rp_u32 first_range;  // of its primitives, among the ranges of primitives; its last is the one before the next object's first
    rp_u32 unused[3];
} rp_object;

// A placed object reaches beyond the box of its placed corners by this share of its extent and of its coordinates: so rays that meet it by the
// arithmetic of kernels/common/instance.cl meet its box in the world, too.
#define RP_INSTANCE_SLACK 0x1p-20f

#endif
