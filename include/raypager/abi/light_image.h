// Images that lights shine as or through: of a sky, or in a lamp. Always resident, but for the texels of large skies.
#ifndef RAYPAGER_ABI_LIGHT_IMAGE_H
#define RAYPAGER_ABI_LIGHT_IMAGE_H

#include "raypager/abi/types.h"

// A colour: three numbers of 16 bits, red and blue in the lower halves, times the float whose bits are exponent << 23. So lamps and shadows keep the
// same precision. The exponent is 1 to RP_TEXEL_MAX_EXPONENT: no texel is infinite.
typedef struct rp_texel {
    rp_u32 red_green, blue_exponent;
} rp_texel;
#define RP_TEXEL_MAX_EXPONENT 239u

// An image of a block file: its texels follow those of the one before it, in rows from top to bottom.
typedef struct rp_light_image {
    rp_u32 width, height;
} rp_light_image;

// Images of all directions are square. Directions lie on them as Clarberg puts them ("Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD", 2008)
// and pbrt-v4 does: +z in the middle, -z in the corners, the horizon halfway on a square that stands on its tip. All points stand for the same solid
// angle. Between the middles of texels colours are interpolated linearly, across the edges of the image, too.
//
// In words, one behind the other: the head; of a sky, how rows of cells are chosen, as steps (kernels/shading/light.cl), and for each row its cells;
// texels. Cells divide the image evenly. Each is chosen in proportion to what shines from it, and within it all points alike.
#define RP_IMAGE_WIDTH 0u  // words of the head: texels
#define RP_IMAGE_HEIGHT 1u
#define RP_IMAGE_CELLS 2u  // a side; 0: directions are not drawn from this image
// Of a sky whose texels are not here but in pages: which image of abi/texture.h has them, and the level of it that surfaces see which scatter light.
// Cells are in proportion to what shines from that level.
#define RP_IMAGE_IN_PAGES 3u
#define RP_IMAGE_LEVEL 4u
#define RP_IMAGE_HEAD 16u

#endif
