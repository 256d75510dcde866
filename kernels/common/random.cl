// Random numbers of a path: a pure function of (pixel, sample, depth, purpose), so that pictures do not depend on the order of work. Over the
// samples of a pixel they are spread evenly: the two numbers of a pair are a (0,2)-sequence, that of Sobol, scrambled as Owen does it, with
// samples in an order of their own for each pair. After Burley 2020, "Practical Hash-based Owen
// Scrambling". Any 2^k samples that begin at a multiple of 2^k lie evenly in every way in which the unit square can be cut into 2^k boxes.
#ifndef RP_RANDOM_CL
#define RP_RANDOM_CL

// What four numbers are for; xy and zw are pairs.
#define RP_RANDOM_CAMERA 0u   // xy position in the pixel, zw on the lens
#define RP_RANDOM_LIGHT 1u    // x choice of light and point on it, y point on it; z rest of x (rp_choose_light), w Russian roulette
#define RP_RANDOM_BSDF 2u     // xy direction; z lobe, w shadow ray or continuation
#define RP_RANDOM_MIX 3u      // which of the materials that are mixed; one number for each mix within another
#define RP_RANDOM_TEXTURE 4u  // of images: xy texel, z level
#define RP_RANDOM_SHADOW 5u   // as RP_RANDOM_MIX, for what a shadow ray meets
#define RP_RANDOM_SKY 6u      // xy texel of a sky that is in pages

#define RP_LANES 1
#include "common/random_lanes.cl"
#undef RP_LANES

#endif
