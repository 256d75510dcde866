// Textures: programs that say how the parameters of a material vary over surfaces, and the images that they read, in pages.
#ifndef RAYPAGER_ABI_TEXTURE_H
#define RAYPAGER_ABI_TEXTURE_H

#include "raypager/abi/types.h"

// Images ----------------------------------------------------------------------------------------------------------------
// An image has levels: level 0 is the image as it was given, and each other has half the texels of the one before it along each axis, rounded up,
// down to a single texel. A page is RP_TEXTURE_PAGE_BYTES, and has a number in the page table behind the blocks' (abi/block.h): page p is entry
// block_count + p. A level of more than RP_IMAGE_TAIL_SIZE texels along an axis is cut into tiles, a page each, row by row from the top left;
// texels within a tile lie in Morton order, x in the lowest bit, and those outside the image repeat the nearest inside. The smaller levels
// of an image, its tail, lie one behind the other in a page that the tails of other images may share, each in rows from the top.
#define RP_TEXTURE_PAGE_BYTES 65536u
#define RP_IMAGE_TAIL_SIZE 64u
#define RP_IMAGE_MAX_SIZE (1u << 20)  // texels along an axis: their numbers are exact as floats
#define RP_IMAGE_MAX_LEVELS 21u

// Formats of texels. Channels are red, green, blue, alpha, or one, grey; the first in the lowest bits.
#define RP_TEXEL_GRAY8 0u  // unsigned integers stand for 0 to 1
#define RP_TEXEL_GRAY16 1u
#define RP_TEXEL_GRAY_HALF 2u
#define RP_TEXEL_RGBA8 3u
#define RP_TEXEL_RGBA16 4u
#define RP_TEXEL_RGBA_HALF 5u
#define RP_TEXEL_FORMATS 6u
// Of the image that a sky has in pages (abi/light_image.h): rp_texel, which programs do not read.
#define RP_TEXEL_SKY 6u
// clang-format off
// Binary logarithms: of bytes per texel, of the texels along a tile, and across it.
#define RP_TEXEL_LOG_BYTES(format) ((format) == RP_TEXEL_GRAY8 ? 0u : (format) <= RP_TEXEL_GRAY_HALF ? 1u : (format) == RP_TEXEL_RGBA8 ? 2u : 3u)
#define RP_TILE_LOG_WIDTH(log_bytes) ((17u - (log_bytes)) / 2u)
#define RP_TILE_LOG_HEIGHT(log_bytes) (16u - (log_bytes) - RP_TILE_LOG_WIDTH(log_bytes))
// clang-format on

typedef struct rp_image {
    rp_u32 first_level;  // in the table of levels
    rp_u32 levels;
    rp_u32 format;
    rp_u32 srgb;  // 1: channels other than alpha are encoded as sRGB (8 bits only); 0: they are linear
} rp_image;

typedef struct rp_image_level {
    rp_u32 page;           // of its first tile, or of its image's tail
    rp_u32 width, height;  // texels
    rp_u32 at;             // of a level of the tail: its first byte in the page, a multiple of 8; RP_NONE: it is in tiles
} rp_image_level;

// Programs --------------------------------------------------------------------------------------------------------------
// The program of a material is a run of operations on a stack of colours, up to and with the first that has RP_TEXTURE_LAST. A number is a colour of
// three equal channels. `a` and `b`: of the operation. Operations are said as what they take off the stack -> what they put there.
#define RP_TEXTURE_CONSTANT 0u   // -> a
#define RP_TEXTURE_IMAGE 1u      // -> texel * a, or with RP_TEXTURE_INVERT 1 - texel * a, at least 0; `image` is looked up at `map`
#define RP_TEXTURE_SCALE 2u      // x, y -> x * y * a
#define RP_TEXTURE_MIX 3u        // x, y, amount -> (1 - amount) x + amount y
#define RP_TEXTURE_CHECKS 4u     // x, y -> x where the sum of the whole parts of `map`'s coordinates is even, else y
#define RP_TEXTURE_DOTS 5u       // x, y -> x in a disk of a random place in some cells of `map`'s coordinates, else y
#define RP_TEXTURE_BILERP 6u     // four corners, (0, 0), (0, 1), (1, 0), (1, 1) -> bilinear between them, by `map`
#define RP_TEXTURE_DIRECTION 7u  // x, y -> x times |n . a| + y times the rest, a: a unit direction
#define RP_TEXTURE_FBM 8u        // -> a[0] octaves of noise at `map`, each a[1] as rough as the one before
#define RP_TEXTURE_WRINKLED 9u   // -> the same of the magnitude of noise
#define RP_TEXTURE_WINDY 10u     // -> windy waves
#define RP_TEXTURE_MARBLE 11u    // -> marble: a[0] octaves, a[1] roughness, a[2] scale, b[0] variation
#define RP_TEXTURE_UV 12u        // -> (u, v, 0) of `map`, less their whole parts
#define RP_TEXTURE_SET 13u       // value -> ; it is the parameter `image` (RP_PARAMETER_*) of the material
// Bumps: of both, a[2] is how many texels of images there are at most along u or v from 0 to 1. A step is as long as what a path stands for is wide,
// or where that is less, as a texel.
#define RP_TEXTURE_SHIFT 14u  // -> ; what follows is looked up a[0] steps farther along the tangent, where u grows, and a[1] across it
#define RP_TEXTURE_BUMP 15u   // h, hu, hv -> ; the surface is as if raised by h, which is hu a step along the tangent, and hv across it
#define RP_TEXTURE_OPERATIONS 16u
#define RP_TEXTURE_OPERATION_MASK 0xffu
// Flags beside the operation.
#define RP_TEXTURE_LAST 0x100u
#define RP_TEXTURE_INVERT 0x200u
#define RP_TEXTURE_CHANNEL_SHIFT \
    10  // of an image, three bits: 0 the colour, 1 the mean of red, green and blue, 2 their luminance, 3 .. 6 one channel
#define RP_TEXTURE_CHANNEL_MASK 7u
#define RP_TEXTURE_WRAP_SHIFT 13  // of an image, two bits for each axis: what lies outside of it
#define RP_WRAP_REPEAT 0u
#define RP_WRAP_BLACK 1u
#define RP_WRAP_CLAMP 2u
#define RP_WRAP_MIRROR 3u
#define RP_TEXTURE_SOLID 0x20000u  // of checks: in three dimensions
// Of an image, five bits: lookups for which they are the same take texels that lie alike.
#define RP_TEXTURE_JITTER_SHIFT 18
#define RP_TEXTURE_JITTER_MASK 31u
#define RP_TEXTURE_STACK 8u  // colours on the stack, at most
#define RP_TEXEL_WORDS 32u   // words of texels that a path keeps, at most: each has a bit that says whether it is there

// What RP_TEXTURE_SET sets.
#define RP_PARAMETER_COLOR 0u
#define RP_PARAMETER_SPECULAR 1u
#define RP_PARAMETER_TRANSMITTANCE 2u
#define RP_PARAMETER_MIRROR 3u
#define RP_PARAMETER_REFRACTED 4u
#define RP_PARAMETER_ALPHA 5u  // GGX roughness: a[0] 0, as it is; 1, of pbrt-v4's roughness; 2, of pbrt-v3's
#define RP_PARAMETER_BASE_ALPHA 6u
#define RP_PARAMETER_AMOUNT 7u  // of a mix
#define RP_PARAMETER_METAL 8u   // the reflectance of a conductor, straight on: eta is 1
#define RP_PARAMETER_NORMAL 9u  // of a tangent frame, each channel from 0 for -1 to 1 for 1
// Of anisotropic materials, the roughness across the tangent, for which the material has some value already.
#define RP_PARAMETER_ALPHA_ACROSS 10u
#define RP_PARAMETER_BASE_ALPHA_ACROSS 11u
#define RP_PARAMETERS 12u

typedef struct rp_texture_op {
    rp_u32 op;
    rp_u32 image;   // number of the image; or of the parameter
    rp_u32 lookup;  // of an image: where its texel lies among the words of a path slot that keep them
    rp_u32 map;     // number of the rp_texture_map; RP_NONE: the coordinates are u and v
    float a[4], b[4];
} rp_texture_op;

// Coordinates of textures, from those of the surface or from points in world space.
#define RP_MAP_UV 0u     // s = m[0] u + m[1] v + m[2], t = m[4] u + m[5] v + m[6]
#define RP_MAP_POINT 1u  // s, t, r = the point times the 3 x 4 matrix m, row by row
// Of that point: s = its angle from +z as a share of half a turn, t = that about z, from +x towards +y, as a share of a turn; or, if `swapped`, the
// other way round; then scale and offset.
#define RP_MAP_SPHERE 2u
// Of that point: s = its angle about z, from -x on, as a share of a turn, t = z; likewise.
#define RP_MAP_CYLINDER 3u
typedef struct rp_texture_map {
    rp_u32 kind, swapped, unused[2];
    float m[12];
    float scale[2], offset[2];  // s * scale[0] + offset[0], and likewise t
} rp_texture_map;

// On the device the tables lie in one buffer of words; where each begins. first_page: entry of the page table.
typedef struct rp_texture_tables {
    rp_u32 first_page, images, image_levels, ops, maps;
    float cone_width, cone_spread;  // of camera rays: what one stands for is so wide where it begins, and grows by so much per unit of its way
    rp_u32 unused;
} rp_texture_tables;

#endif
