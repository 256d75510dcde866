// How a light is chosen for next-event estimation where several have a place: by a tree that says what each could give there.
#ifndef RAYPAGER_ABI_LIGHT_TREE_H
#define RAYPAGER_ABI_LIGHT_TREE_H

#include "raypager/abi/types.h"

// What lights of a subtree have in common: they lie in a sphere, and each shines at most 90 degrees away from a direction within `spread` of the
// axis.
typedef struct rp_light_node {
    float center[3], radius;
    float power;    // relative: what they give a surface that faces them, times squared distance
    rp_u32 axis;    // three numbers of 10 bits with a sign, in units of 1/511
    rp_u32 spread;  // cosine in units of 1/32767, with a sign; sine << 16 in units of 1/65535
    rp_u32 next;    // the pair of its children, or, with RP_LIGHT_LEAF, the one light
} rp_light_node;

#define RP_LIGHT_LEAF 0x80000000u

// In words, one behind the other: the head, pairs of nodes (the children of the root first), for each light the way from the root to it in two words
// (a bit a step, the first one lowest, then a 1), and the choice between the tree and each light that has no place: as steps
// (kernels/shading/light.cl), of which the first is the tree's, and the numbers of these lights.
#define RP_LIGHT_TREE_WAYS 0u    // words of the head: where the ways begin,
#define RP_LIGHT_TREE_STEPS 1u   // the steps,
#define RP_LIGHT_TREE_COUNT 2u   // how many these are,
#define RP_LIGHT_TREE_OTHERS 3u  // and where the numbers begin
#define RP_LIGHT_TREE_PAIRS 16u

#endif
