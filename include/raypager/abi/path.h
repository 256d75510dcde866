// Path state, queues and counters of the wavefront tracer in device memory, shared by its kernels and the host.
#ifndef RAYPAGER_ABI_PATH_H
#define RAYPAGER_ABI_PATH_H

#include "raypager/abi/types.h"

// A path occupies one slot and has one ray under way at a time: its extension ray (closest hit), or the shadow ray of its last vertex.
// The state lies in planes of 16 bytes a slot. Planes are read in pairs, and slots in no order, by devices that fetch 32 bytes at a time: so two
// planes lie together, slot by slot.
//   RP_PLANE_ORIGIN      ray origin xyz | extension: closest hit so far, shadow: end of the ray (distances along the unit direction)
//   RP_PLANE_DIRECTION   ray direction xyz (unit) | density of the last BSDF sample by solid angle (for MIS)
//   RP_PLANE_THROUGHPUT  throughput rgb | flags (RP_PATH_*)
//   RP_PLANE_RADIANCE    radiance gathered so far rgb | pixel index
//   RP_PLANE_HIT         extension: hit point xyz, primitive (RP_NONE: no hit yet); shadow: direction of the next extension ray xyz, light r
//   RP_PLANE_SURFACE     extension: geometric normal, shading normal (octahedral); shadow: light g, light b | sample index | block entry
// The block entry is where a ray that waits, or has just waited, stands in its order of visits; that of others says nothing: they start at the root
// of the top tree.
#define RP_PLANE_ORIGIN 0u
#define RP_PLANE_DIRECTION 1u
#define RP_PLANE_THROUGHPUT 2u
#define RP_PLANE_RADIANCE 3u
#define RP_PLANE_HIT 4u
#define RP_PLANE_SURFACE 5u
// In scenes with cut-outs (RP_CUTOUTS), where shadow rays that meet some are traced as extension rays are, there are two more:
//   RP_PLANE_NEXT        shadow: direction of the next extension ray xyz | how far the ray still has to go; extension: nothing | how far it has come
//                        before its origin, which is behind the last thing that it has passed
//   RP_PLANE_NEXT_START  shadow: where the next extension ray begins xyz | its density; less than 0: there is none
#define RP_PLANE_NEXT 6u
#define RP_PLANE_NEXT_START 7u
#define RP_PATH_PLANES 6u
#define RP_PATH_PLANES_WITH_CUTOUTS 8u
// In scenes with instances five more units of 16 bytes a slot follow behind all planes, slot by slot. They mean something only of a ray that waits:
// first a copy of the instance in which it is (four units), then, in RP_STANDING_AT, four words: block entry (RP_NONE, RP_STANDS_BEHIND: see
// kernels/common/instance.cl) | number of the instance + 1 | that of the closest hit so far, or 0 | with streams the block entry, also where the
// first word is RP_STANDS_BEHIND
#define RP_STANDING_UNITS 5u
#define RP_STANDING_AT 4u
#define RP_STANDS_BEHIND 0xfffffffeu
#define RP_PLANE_PAIR(plane) ((plane) / 2u)
// In units of 16 bytes; the type of slot_count is to be large enough for it.
#define RP_PLANE_INDEX(plane, slot_count, slot) (((slot_count)*RP_PLANE_PAIR(plane) + (slot)) * 2u + (plane) % 2u)

#define RP_PATH_DEPTH_MASK 0xffffu  // scattering events so far
#define RP_PATH_SPECULAR 0x10000u   // the last one was specular, or there was none: emission counts in full
#define RP_PATH_SHADOW 0x20000u     // with RP_CUTOUTS: the ray that is traced as an extension ray is a shadow ray
// The rest: how much less the throughput is because radiance spreads where the path is (square of the index of refraction there over that where it
// began), as a signed binary logarithm in steps of about 1/256 (kernels/shading/scatter.cl). Russian roulette must not end paths for that.
#define RP_PATH_REFRACTION_SHIFT 18
#define RP_PATH_MAX_REFRACTION 7680

// Slots that sleep together have a word of 64 bits (single_ray/wake.cl), the low ones of which stand for blocks: bit b * bit_scale / 2^32, less
// than RP_SLEEP_BITS, for block b.
#define RP_SLEEP_GROUP 16u
#define RP_SLEEP_BITS 58u

// With streams a bit of each slot says whether it is awake: to be looked at in this round. Those that wait are in lists (RP_DEMAND_LISTS_AT).
#define RP_AWAKE_SLOTS 64u  // in a word, the first in its lowest bit; changed in halves, too, which takes a device whose low bytes come first
#define RP_AWAKE_WORDS(slot_count) (((slot_count) + (RP_AWAKE_SLOTS - 1u)) / RP_AWAKE_SLOTS)

// With streams, rays that can go on are queued in bundles of those that are in the same block or in blocks that lie together: bundle
// b * bundle_scale / 2^32, less than this, for block b (stream/wake.cl).
#define RP_BUNDLES 2048u

// The status word of a slot: its phase, which is what it is about (RP_PHASE_*, low bits); of an extension ray that has a hit the offset exponent
// there (surface.cl), unless shading is to find its surface; and with streams the block that its path met last, or the greatest number that there is
// room for (131,071; then rays of the blocks behind it are in one bundle): waking reads no more.
// Behind RP_STATUS_WORDS of these words stands, for each slot that waits, the block that it waits for, or, with streams, the next slot of a list
// of that block's (RP_DEMAND_LISTS_AT).
// In scenes whose meshes have colours at their vertices (RP_VERTEX_COLORS) a third run of words follows: the interpolated colour at the closest hit
// of the slot's extension ray. Where they have coordinates of textures (RP_UVS), there follow three runs of numbers: u and v there, and the density
// of the texture. Where instances have traits (RP_TRAITS), one more: the number of those of the instance that the closest hit is in, or 0. In
// scenes with textures (RP_TEXTURES) there are more runs: the cone of the extension ray, and the texels that its hit has so far
// (abi/texture.h); and in those with cut-outs, between the two, what a shadow ray brings if it arrives, red, green and blue.
#define RP_PHASE_FREE 0u
#define RP_PHASE_EXTEND 1u        // extension ray under way
#define RP_PHASE_SHADOW 2u        // shadow ray under way
#define RP_PHASE_SHADE 3u         // extension ray done
#define RP_PHASE_IDLE 4u          // free, and no samples are left
#define RP_PHASE_EXTEND_WAITS 5u  // extension ray that came to an absent block
#define RP_PHASE_SHADOW_WAITS 6u  // the same of a shadow ray
#define RP_PHASE_SHADE_WAITS 7u   // extension ray done, and a page is absent of a texture there, or of the sky
#define RP_PHASE_MASK 7u
#define RP_STATUS_OFFSET_SHIFT 3
#define RP_STATUS_OFFSET_MASK 0xffu
#define RP_STATUS_BLOCK_SHIFT 15
#define RP_STATUS_BLOCK_MASK (~0u << RP_STATUS_BLOCK_SHIFT)
#define RP_STATUS_WORDS(slot_count) (((slot_count) + (RP_SLEEP_GROUP - 1u)) / RP_SLEEP_GROUP * RP_SLEEP_GROUP)
// Shadow ray: something on its way may be nothing, and nothing has stopped it so far. A bit of the offset exponent, which only extension rays have.
#define RP_STATUS_MET_CUTOUT 0x8u

// The planes are not always as said above, since most of what would be written is only read again by the stage that comes next. The status word says
// so:
// Extension ray behind a shadow ray: the planes are still as for that one, so it has no hit. Single rays are this until they wait. With streams
// they are until they have a hit and wait, and keep their block entry in its place; and once they are done ORIGIN is hit point xyz, primitive
// (RP_NONE: no hit, and then this is all that holds), and DIRECTION geometric normal, shading normal, distance, density.
#define RP_STATUS_CONNECTED 0x800u
#define RP_STATUS_LIT 0x1000u      // CONNECTED, and the light of the shadow ray has arrived, but is not added to the radiance yet
#define RP_STATUS_ENDS 0x2000u     // shadow ray: the path ends behind it
#define RP_STATUS_RESUMED 0x4000u  // with streams: ray that had waited, and goes on from its block entry, or from the texels that it has
// With single rays (stages built with RP_SHORT_STATES):
// Camera ray: throughput 1, radiance 0, specular. Only ORIGIN and DIRECTION hold anything, and in their last words stand pixel and sample.
#define RP_STATUS_CAMERA 0x8000u
// Extension ray done: the leaf's reference, the block and the distance of its closest hit are in HIT.xyz, in DIRECTION.xyz if it is CONNECTED, in
// ORIGIN.xyz (which is the camera's place, and known without it) if it is a CAMERA ray; with RP_EYE_MOVES, where each camera ray has a place of its
// own to begin, in HIT.xyz then as well. The stage `shade` finds the surface there, in the same round.
#define RP_STATUS_FOUND 0x10000u
// Shadow or extension ray that leaves the first vertex of its path and has not waited: the stage `wake` puts these first in their queues. Means
// nothing once the ray is done.
#define RP_STATUS_FIRST 0x20000u

// So many blocks that have come are named to the stage that wakes rays: as many as an OpenCL vector has components.
#define RP_MAX_NAMED 16u

// What a path is traced for: one sample of one pixel.
typedef struct rp_path_sample {
    rp_u32 pixel, sample;
} rp_path_sample;

// Counters of one round; the first RP_COUNTERS_PER_ROUND words are zeroed before it, the others add up over the render.
#define RP_COUNT_EXTEND 0u        // extension rays that can go on
#define RP_COUNT_SHADOW 1u        // shadow rays that can go on
#define RP_COUNT_FREE 2u          // free slots
#define RP_COUNT_GENERATED 3u     // with streams: work-groups that have given out free slots
#define RP_COUNT_WAITING 4u       // rays that wait for an absent block
#define RP_COUNT_IDLE 5u          // slots that are none of these, before new camera paths begin
#define RP_COUNT_SHADOW_TAKEN 6u  // what work-items have taken from the queue of shadow rays, on CPUs: streams of them
// The same of extension rays; on GPUs rays, of each part of the queue (kernels/single_ray/persistent.cl), of which there are at most RP_MAX_PARTS.
// In the end it is more than there were, by what was asked for in vain.
#define RP_COUNT_EXTEND_TAKEN 7u
#define RP_MAX_PARTS 256u
// Slots whose page of a texture, or of the sky, has come: listed from the end of the free list on.
#define RP_COUNT_TEXTURED (RP_COUNT_EXTEND_TAKEN + RP_MAX_PARTS)
#define RP_COUNTERS_PER_ROUND (RP_COUNT_TEXTURED + 1u)
#define RP_COUNT_SAMPLES (RP_COUNTERS_PER_ROUND + 0u)      // begun by number (rp_sample_numbers). 64 bits: low, high
#define RP_COUNT_CAMERA_RAYS (RP_COUNTERS_PER_ROUND + 2u)  // 64 bits each from here on
#define RP_COUNT_BOUNCE_RAYS (RP_COUNTERS_PER_ROUND + 4u)
#define RP_COUNT_SHADOW_RAYS (RP_COUNTERS_PER_ROUND + 6u)
#define RP_COUNT_REQUESTS_SERVED (RP_COUNTERS_PER_ROUND + 8u)   // times that a waiting extension ray entered the block that it had waited for
#define RP_COUNT_REQUESTS_NO_HIT (RP_COUNTERS_PER_ROUND + 10u)  // of these: nothing was hit behind it
#define RP_COUNT_IN_LISTS (RP_COUNTERS_PER_ROUND + 12u)         // with streams: rays in the lists of blocks (RP_DEMAND_LISTS_AT)
#define RP_COUNTER_WORDS (RP_COUNTERS_PER_ROUND + 13u)

// Demand: arrays of one word a block, one after the other. Whoever changes a word of a block's marks the block.
#define RP_DEMAND_REQUESTS 0u  // rays that wait for the block
#define RP_DEMAND_BOUNCES 1u   // with RP_TRACK_BOUNCES: extension rays of this round that found their closest hit in the block and ended with it
// With RP_TRACK_LAST_ROUND: the last round in which a ray entered the block; with RP_TRACK_ENTERS: how many have so far, of a
// sample of rays, modulo 2^32 (streams, and rays that are recorded, enter it by each of its block entries).
// A residency policy needs one or the other, and where everything is resident none is kept.
#define RP_DEMAND_USED 2u
#define RP_DEMAND_ARRAYS 3u
// The host is told of what has changed alone (rp_block_demand). Behind the arrays stand, for each block, two words: its requests and its use, as
// they were told last. Behind these a mark, one byte for RP_MARK_BLOCKS blocks that follow each other: not 0 if anything may have changed of them
// since. block_count: size_t on devices.
#define RP_MARK_BLOCKS 8u
#define RP_MARK_WORDS(block_count) (((block_count) + (4u * RP_MARK_BLOCKS - 1u)) / (4u * RP_MARK_BLOCKS))
#define RP_DEMAND_TOLD_AT(block_count) (RP_DEMAND_ARRAYS * (block_count))
#define RP_DEMAND_MARKS_AT(block_count) ((RP_DEMAND_ARRAYS + 2u) * (block_count))
#define RP_DEMAND_WORDS(block_count) (RP_DEMAND_MARKS_AT(block_count) + RP_MARK_WORDS(block_count))
// With streams there is more, which the host has no use for. The slots of the rays that wait for a block are lists, linked through the words of
// their places (RP_STATUS_WORDS): extension rays and shadow rays each for themselves, and either in RP_LISTS of them, which are gone through
// together, since the next link has to come from far each time. Those of a stream that wait for the same block are in one list, so that most stay
// neighbours.
#define RP_LISTS 8u
// A word a list, for each block RP_LISTS of extension rays, then RP_LISTS of shadow rays: the link to the slot that came last, which is its number
// plus one; 0: to none.
#define RP_DEMAND_LISTS_AT(block_count) RP_DEMAND_WORDS(block_count)
#define RP_DEMAND_WORDS_OF_STREAMS(block_count) (RP_DEMAND_WORDS(block_count) + 2u * RP_LISTS * (block_count))

// What a round tells of a block whose requests or use have changed in it, or on whose surfaces rays have ended: the words of the demand.
typedef struct rp_block_demand {
    rp_u32 block, requests, bounces, used;
} rp_block_demand;

// The report of a round, which is read back after it: its counters, how many blocks it tells of, and, from word RP_REPORT_HEAD on, these, in no
// order (kernels/common/report.cl). Two reports lie one behind the other, for rounds in turn.
#define RP_REPORT_COUNT RP_COUNTER_WORDS
#define RP_REPORT_HEAD ((RP_COUNTER_WORDS + 4u) / 4u * 4u)
#define RP_REPORT_WORDS(block_count) (RP_REPORT_HEAD + 4u * (block_count))

#endif
