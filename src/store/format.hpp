// The fixed parts of a block file, as they lie on disk (FORMAT.md). All numbers are little-endian; so is every machine this runs on.
#pragma once

#include <bit>
#include <cstdint>

#include "block/baked_scene.hpp"
#include "raypager/abi/block.h"
#include "raypager/abi/scene.h"

namespace raypager::format {

static_assert(std::endian::native == std::endian::little, "block files are read and written as they lie in memory");

inline constexpr char magic[8] = {'R', 'A', 'Y', 'P', 'A', 'G', 'E', 'R'};
inline constexpr uint32_t version = 12;
inline constexpr uint32_t endian_mark = 0x01020304u;
inline constexpr uint64_t page = 4096;  // the header takes one; blocks and pages of images start at multiples

enum Section : uint32_t {
    scalars,
    materials,
    lights,
    ranges,
    top_nodes,
    block_entries,
    block_entry_paths,
    wide_roots,
    blocks,
    light_images,
    texels,
    images,
    image_levels,
    pages,
    texture_ops,
    texture_maps,
    sky_words,
    objects,
    instance_traits,
    section_count
};
inline constexpr const char* section_names[section_count] = {
    "scene",       "materials",    "lights",         "ranges", "top tree",     "block entries", "block entry paths",  "wide roots",
    "block table", "light images", "texels",         "images", "image levels", "pages",         "texture operations", "texture maps",
    "sky words",   "objects",      "instance traits"};

struct SectionEntry {
    uint64_t offset, count, checksum;
    uint32_t kind, item_bytes;
};

struct Header {
    char magic[8];
    uint32_t version, endian_mark;
    uint32_t header_bytes, section_count;
    uint64_t file_bytes;
    SectionEntry sections[format::section_count];
    uint64_t checksum;  // of the bytes before it
};

struct Scalars {
    float eye[3], right[3], up[3], forward[3];
    uint32_t width, height, spp, max_depth;
    float lower[3], upper[3];
    rp_top_grid top_grid;
    uint64_t triangles, spheres, fingerprint;
    float position_cell;
    float exposure, color_matrix[9];
    float max_luminance, max_xyz;
    uint32_t projection;
    float lens_radius, focal_distance, window[4];
    uint32_t filter_kind;
    float filter_radius[2], filter_parameters[2];
    uint32_t unused;
    uint64_t instances;
};

inline constexpr uint32_t item_bytes[section_count] = {
    sizeof(Scalars),        sizeof(rp_material), sizeof(rp_light),       sizeof(rp_primitive_range), sizeof(rp_node),
    sizeof(rp_block_entry), sizeof(uint64_t),    sizeof(rp_u32),         sizeof(BlockRecord),        sizeof(rp_light_image),
    sizeof(rp_texel),       sizeof(rp_image),    sizeof(rp_image_level), sizeof(PageRecord),         sizeof(rp_texture_op),
    sizeof(rp_texture_map), sizeof(rp_u32),      sizeof(rp_object),      sizeof(rp_instance_traits)};

static_assert(sizeof(SectionEntry) == 32 && sizeof(Header) == 32 + 19 * 32 + 8 && sizeof(Scalars) == 256);
static_assert(sizeof(rp_material) == 128 && sizeof(rp_light) == 64 && sizeof(rp_primitive_range) == 16);
static_assert(sizeof(rp_node) == 32 && sizeof(rp_block_entry) == 32 && sizeof(rp_top_grid) == 32 && sizeof(BlockRecord) == 64 &&
              sizeof(rp_light_image) == 8 && sizeof(rp_texel) == 8);
static_assert(sizeof(rp_image) == 16 && sizeof(rp_image_level) == 16 && sizeof(PageRecord) == 16 && sizeof(rp_texture_op) == 48 &&
              sizeof(rp_texture_map) == 80 && sizeof(rp_object) == 64 && sizeof(rp_instance_traits) == 32);

}  // namespace raypager::format
