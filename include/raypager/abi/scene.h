// What shading needs to know of a scene: materials, lights, primitive ranges, camera. Always resident.
#ifndef RAYPAGER_ABI_SCENE_H
#define RAYPAGER_ABI_SCENE_H

#include "raypager/abi/texture.h"
#include "raypager/abi/types.h"

#define RP_MATERIAL_DIFFUSE 0u     // color = reflectance; both sides
#define RP_MATERIAL_CONDUCTOR 1u   // eta + i k by channel, GGX if alpha > 0, a mirror otherwise; both sides
#define RP_MATERIAL_DIELECTRIC 2u  // ior = index inside over index outside; the normal points outside; smooth, and clear
#define RP_MATERIAL_ABSORBING 3u   // absorbs everything (surfaces that only emit)
#define RP_MATERIAL_LAYERED 4u     // an interface over a base, see below
#define RP_MATERIAL_MIX 5u         // material `second` with probability `amount`, else `first`; either may be a mix; `first` may be RP_NONE: nothing
#define RP_MAX_MIXES 4u            // of mixes, within each other

#define RP_MATERIAL_PLAIN 1u  // a flag: where primitives have colours of their own, color counts all the same
// Flags of layered materials.
#define RP_MATERIAL_SOLID 2u       // ior is that of a solid: seen from inside, the interface is met from its other side. Else it is alike from both.
#define RP_MATERIAL_THIN 4u        // the interface is a sheet of two parallel surfaces: what passes goes straight on. Smooth.
#define RP_MATERIAL_METAL_BASE 8u  // the base is a conductor of eta + i k (over the index of the coat) with roughness base_alpha
// How the base of a layered material is lit: one of these, or as if there were no interface.
#define RP_MATERIAL_COAT 16u                // through the interface and back, with all reflections between the two
#define RP_MATERIAL_BLEND 32u               // Ashikhmin and Shirley 2000, as in the substrate of pbrt-v3
#define RP_MATERIAL_SCHLICK 64u             // by what Schlick's approximation of the interface leaves; as glTF 2.0 has it
#define RP_MATERIAL_SMOOTH_REFRACTION 128u  // what is refracted meets a smooth interface, whatever alpha says
#define RP_MATERIAL_FLAGS 255u
#define RP_MATERIAL_PROGRAM_SHIFT 8  // flags from here on: the first operation of the material's texture program (abi/texture.h), from 1; 0: none

// A layered material reflects `mirror` and refracts `refracted` times what the Fresnel equations for ior say. `specular` is the same for
// the interface of GGX roughness alpha (0: smooth); with BLEND and SCHLICK, whose alpha is more than 0, it is what is reflected at normal incidence.
// Below the interface are a diffuse reflection `color`, rough by Oren and Nayar's terms a (less 1) and b, and a diffuse transmission.
//
// Roughness may have a direction: with RP_ALPHA_ACROSS, 0 or more than 0, of a conductor or an interface that is rough, alpha is the roughness along
// the tangent, in which u grows, and that the one across it; 0: both are the same. RP_BASE_ALPHA_ACROSS is likewise of a metallic base. Spheres have
// no u: RP_SPHERE_AXIS is ~ the octahedral code of the axis about which it grows on those of this material, or 0, if these have none.
typedef struct rp_material {
    rp_u32 kind;
    rp_u32 flags;
    float alpha;  // GGX roughness
    float ior;
    float color[3];
    float oren_a;
    float eta[3];
    float oren_b;
    float k[3];
    float internal;  // with COAT: what the interface reflects of diffuse light from below
    float specular[3];
    float amount;
    float refracted[3];
    float base_alpha;
    float transmittance[3];
    rp_u32 first;
    float mirror[3];
    rp_u32 second;
} rp_material;
// Fields that only mixes, or coats over a diffuse base, need for what their names say.
#define RP_ALPHA_ACROSS(m) ((m).amount)
#define RP_BASE_ALPHA_ACROSS(m) ((m).internal)
#define RP_SPHERE_AXIS(m) ((m).first)

#define RP_LIGHT_TRIANGLE 0u  // p = vertex 0, e1, e2 = edges to vertices 1 and 2; emits on the side of cross(e1, e2)
#define RP_LIGHT_SPHERE 1u    // p = centre, e1[0] = radius; emits outwards
#define RP_LIGHT_INFINITE 2u  // radiance from everywhere, the same in all directions unless it has an image
#define RP_LIGHT_DISTANT 3u   // p = unit direction towards the light, radiance = irradiance on a facing surface
#define RP_LIGHT_POINT 4u     // p = position, radiance = intensity
#define RP_LIGHT_SPOT \
    5u  // the same; e1 = unit axis, e2 = cosines of the angles to it where light ends and from which on inwards it is full
        // (between them a smooth step; if e2[2] is not 0, a fourth power)
// With an image of all directions, p, e1 and e2 of an infinite light are its unit axes, and radiance is its mean.
// A point light with an image of all directions: e1 and e2 are its x and y axis, z follows (left-handed if RP_LIGHT_MIRRORED).
#define RP_LIGHT_PROJECTION \
    6u  // p = position, radiance = intensity along the axis where the image is white; e1 and e2: steps to the right and upwards
        // from the middle of the image to its edges, at distance 1 in the direction of their cross product (negative if
        // RP_LIGHT_MIRRORED)
#define RP_LIGHT_TWO_SIDED 1u
#define RP_LIGHT_UNSEEN 2u  // no ray meets its surface: it is found by sampling lights alone
#define RP_LIGHT_MIRRORED 4u
#define RP_LIGHT_IMAGE_SHIFT 8  // flags from here on: the number of the light's image (abi/light_image.h), from 1; 0: it has none

typedef struct rp_light {
    float p[3];
    rp_u32 kind;
    float e1[3];
    rp_u32 flags;
    float e2[3];
    float
        area;  // of an emitter with surface; on the device, of a light with an image: its place among the words by which lights are chosen (as_uint)
    float radiance[3];
    float probability;  // of being chosen for next-event estimation; the sum over all lights is 1
} rp_light;

// Primitives first_primitive .. (next range's first_primitive - 1) share a material. If first_light is not RP_NONE, primitive i is
// the emitter first_light + (i - first_primitive): of all lights, or, in an object, of each instance's own (abi/instance.h). With
// RP_RANGE_POINT_COLOR all of them are points (abi/block.h), and where the material is diffuse and not RP_MATERIAL_PLAIN, each has its own
// reflectance. With RP_RANGE_VERTEX_COLOR all of them are triangles whose vertices have colours, which are interpolated linearly; where the material
// is diffuse and not RP_MATERIAL_PLAIN, they are its reflectance. With RP_RANGE_UV all of them are triangles whose vertices have coordinates of
// textures. The flags of a range that shines hold the index of the area light in the scene that was baked, or RP_RANGE_AREA_LIGHTS where that is
// larger.
typedef struct rp_primitive_range {
    rp_u32 first_primitive, material, first_light, flags;
} rp_primitive_range;
#define RP_RANGE_POINT_COLOR 1u
#define RP_RANGE_VERTEX_COLOR 2u
#define RP_RANGE_UV 4u
#define RP_RANGE_CUTOUT 8u  // its material may be nothing: a mix with RP_NONE; or that which an instance puts in its place
#define RP_RANGE_AREA_LIGHT_SHIFT 8
#define RP_RANGE_AREA_LIGHTS 0xffffffu

#define RP_PROJECTION_PERSPECTIVE 0u
#define RP_PROJECTION_ORTHOGRAPHIC 1u
#define RP_PROJECTION_EQUIRECTANGULAR 2u
#define RP_PROJECTION_EQUAL_AREA 3u

// A ray through the image point (u, v) in [0,1]^2, (0, 0) top left, has the direction forward + (2u - 1) right + (1 - 2v) up; of other projections
// see raypager/scene.hpp and kernels/common/camera.cl.
typedef struct rp_camera {
    float eye[4], right[4], up[4], forward[4];
    float lens_right[3], focal_distance;  // half axes of the lens, zeros without one; the distance in lengths of forward
    float lens_up[3];
    rp_u32 projection;
    float window[4];  // of projections of all directions: left, top, width, height of the picture
} rp_camera;

// Along each axis, share[k] of a pixel's samples lie no farther from its middle than k / RP_FILTER_STEPS of the radius, and between these places they
// lie evenly. radius: in pixels; zeros where samples lie evenly in the pixel itself.
#define RP_FILTER_STEPS 64u
typedef struct rp_pixel_filter {
    float radius[2];
    float share[2][RP_FILTER_STEPS + 1];
} rp_pixel_filter;

// The samples of a picture are numbered in the order in which they are begun. Passes, each one sample of each pixel, go tile by tile of tile_size
// x tile_size pixels. The first pass comes by itself, so that every pixel is seen soon. Those behind it, up to grouped_passes, come in stretches: the
// last one begins behind an eighth of them (1 / RP_LAST_STRETCH, rounded up), the one before it behind half of that, and so on. Within a stretch
// `together` passes at a time (or fewer, so that groups are even) form one, in which the samples of a pixel follow each other: rays that begin
// together then meet more of the same. With regions, so many pixels of that order get the samples of the whole stretch before those that follow
// begin, so that their rays meet the same blocks for long. However long that takes, no pixel ever has more than eight times the samples of another.
// The passes behind grouped_passes come one by one. together * pixels < 2^32.
#define RP_LAST_STRETCH 8u
typedef struct rp_sample_order {
    rp_u32 tile_size, together, grouped_passes;
    rp_u32 region;  // pixels; 0: the whole picture
} rp_sample_order;

// Of the samples that a device has begun by number it keeps only a count (RP_COUNT_SAMPLES). The one that is begun after `count` others has the
// number count + first_shift up to first_end, count + then_shift up to end, modulo 2^64; from there on there is none yet.
typedef struct rp_sample_numbers {
    rp_u64 first_end, end;  // counts
    rp_u64 first_shift, then_shift;
} rp_sample_numbers;

// What a camera ray sees that meets nothing: what shines there, or `background` instead. Where it is transparent, the film counts these samples
// (abi/film.h).
#define RP_BACKGROUND_LIGHTS 0u
#define RP_BACKGROUND_COLOR 1u
#define RP_BACKGROUND_TRANSPARENT 2u

// Scalars of the scene and the render, one copy on the device.
typedef struct rp_render_params {
    rp_camera camera;
    rp_u32 width, height, spp, max_depth;
    rp_u32 seed, light_count, range_count, infinite_light;  // infinite_light: index of the infinite light or RP_NONE
    rp_sample_order order;
    rp_u32 roulette_connection, slot_count;
    float background[3];
    rp_u32 background_kind;
    float max_luminance, max_xyz;  // of a sample (common/film.cl); infinite: no limit
    rp_u32 film_layers;            // that the film keeps, as bits (raypager/film_layers.hpp)
    float adaptive_error;          // more than 0: sampling is adaptive
    rp_pixel_filter filter;
    rp_texture_tables textures;
    // Here the numbers of the picture's samples end. Where sampling is adaptive, those from here on are samples stage_first to
    // stage_first + stage_passes - 1 of each of the pixels in a list.
    rp_u64 stage_begin;
    rp_u32 stage_first, stage_passes;
    // The rows of the picture whose film is on the device: all, or, where that does not fit, those of the samples that are begun now.
    rp_u32 film_first_row, film_rows;
} rp_render_params;

#endif
