// The visit log: which blocks the rays of some paths entered, as kernels built with RP_RECORD write it and the host reads it after each
// round. Only measurements record; see kernels/single_ray/visits.cl.
#ifndef RAYPAGER_ABI_VISITS_H
#define RAYPAGER_ABI_VISITS_H

#include "raypager/abi/types.h"

// The log starts with RP_VISIT_HEADER words; then come events of RP_VISIT_WORDS words: pixel, sample, kind | block.
#define RP_VISIT_HEADER 4u
#define RP_VISIT_RESERVED 0u   // header word: events that were asked for in this round; those from the capacity on were not written
#define RP_VISIT_CAPACITY 1u   // header word: events that there is room for
#define RP_VISIT_THRESHOLD 2u  // header word: paths with rp_path_hash at most this are recorded
#define RP_VISIT_WORDS 3u

// A ray's events come in the order in which it was traced. Each pass of a ray begins with a head (BEGIN or RESUME), which is written when
// the pass is over and so names what it found; its block is RP_VISIT_NO_BLOCK where nothing was.
#define RP_VISIT_BEGIN_EXTEND 0u   // a new extension ray; block: where its closest hit so far is
#define RP_VISIT_RESUME_EXTEND 1u  // it goes on; block: where the pass found a closer hit
#define RP_VISIT_BEGIN_SHADOW 2u   // a new shadow ray; block: one that stops it. Its candidates follow
#define RP_VISIT_RESUME_SHADOW 3u
#define RP_VISIT_ENTER 4u  // extension: the ray enters the block; shadow: the block is a candidate, in the ray's order
#define RP_VISIT_STOPS 5u  // shadow: the block stops the ray, too
#define RP_VISIT_KIND_SHIFT 29
#define RP_VISIT_BLOCK_MASK 0x1fffffffu
#define RP_VISIT_NO_BLOCK RP_VISIT_BLOCK_MASK

#endif
