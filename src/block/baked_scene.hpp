// A baked scene as the engine knows it, wherever its blocks are kept.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "raypager/abi/block.h"
#include "raypager/abi/instance.h"
#include "raypager/abi/scene.h"
#include "raypager/abi/texture.h"
#include "raypager/blocks.hpp"
#include "raypager/scene.hpp"

namespace raypager {

struct BlockRecord {
    uint64_t offset = 0;    // in the file
    uint64_t checksum = 0;  // hash64 of the stored bytes
    uint32_t stored_bytes = 0;
    uint32_t wide_bytes = 0;  // in the form BlockForm::wide; like stored_bytes a multiple of RP_BLOCK_ALIGNMENT
    uint32_t triangles = 0;
    uint32_t spheres = 0;
    uint32_t instances = 0;  // of a block that holds instances alone
    uint32_t levels = 0;     // of such a block: of instances in what it is part of
    float lower[3] = {}, upper[3] = {};
    uint32_t bytes(BlockForm form) const { return form == BlockForm::wide ? wide_bytes : stored_bytes; }
};

// Where rays enter a block, in either form of it.
struct BlockEntryRoots {
    std::vector<rp_u32> roots, wide_roots;
};

// A page of images (abi/texture.h), which takes RP_TEXTURE_PAGE_BYTES in the file and in memory, in either form.
struct PageRecord {
    uint64_t offset = 0;    // in the file
    uint64_t checksum = 0;  // hash64 of its bytes
};

// What is paged are blocks, and behind them the pages of images; they are numbered through, as in the page table. So many there can be.
inline constexpr uint32_t max_pageables = RP_NONE >> 1;

// All of a baked scene but the blocks and pages themselves.
struct BakedScene {
    Camera camera;
    uint32_t width = 0, height = 0, spp = 0, max_depth = 0;
    FilmResponse film;
    PixelFilter filter;
    std::vector<rp_material> materials;
    std::vector<rp_light> lights;            // all, emissive primitives included; probabilities filled in
    LightImages light_images;                // as in Scene, but that of a sky whose texels are in pages has none
    std::vector<rp_u32> sky_words;           // of such a sky: what kernels have of it (abi/light_image.h); empty: there is none
    std::vector<rp_primitive_range> ranges;  // sorted by first_primitive, starting at 0
    float lower[3] = {}, upper[3] = {};      // bounds of all geometry but backdrops; zeros for an empty scene
    rp_top_grid top_grid = {};
    std::vector<rp_node> top_nodes;
    std::vector<rp_block_entry> block_entries;
    std::vector<uint64_t> block_entry_paths;  // see abi/block.h
    std::vector<rp_u32> wide_roots;           // of the block entries, in the wide form of their blocks (abi/wide.h)
    std::vector<BlockRecord> blocks;  // first those of objects, object by object, then those of what is in the world itself, then those of instances
    // In top_nodes their trees come behind that of the world, object by object, and so do, in the order of their blocks, their block entries.
    std::vector<rp_object> objects;
    std::vector<rp_instance_traits> instance_traits;  // traits t of a record are at t - 1
    std::vector<rp_image> images;                     // of textures, then of the sky
    std::vector<rp_image_level> image_levels;
    std::vector<PageRecord> pages;  // of the images; in the page table they follow the blocks
    std::vector<rp_texture_op> texture_ops;
    std::vector<rp_texture_map> texture_maps;
    uint64_t triangles = 0, spheres = 0;            // primitives in the blocks, those of objects once
    uint64_t instances = 0;                         // in the blocks
    float position_cell = 0;                        // of which all coordinates of triangles are multiples; 0: they are as they were given
    uint64_t fingerprint = 0;                       // of the geometry and the bake options; tells whether a cached file is still good
    uint64_t geometry_bytes(BlockForm form) const;  // of all blocks in memory
    uint64_t stored_bytes() const { return geometry_bytes(BlockForm::stored); }
    uint32_t largest_block(BlockForm form) const;  // in memory; 0 without blocks
    uint32_t pageable_count() const { return static_cast<uint32_t>(blocks.size() + pages.size()); }
    bool is_page(uint32_t pageable) const { return pageable >= blocks.size(); }
    uint32_t pageable_bytes(uint32_t pageable, BlockForm form) const {
        return is_page(pageable) ? RP_TEXTURE_PAGE_BYTES : blocks[pageable].bytes(form);
    }
    std::string pageable_name(uint32_t pageable) const;                                             // for messages: "block 7", "page 3 of images"
    uint64_t memory_bytes(BlockForm form) const { return geometry_bytes(form) + texture_bytes(); }  // of all pageables
    uint64_t texture_bytes() const { return uint64_t{pages.size()} * RP_TEXTURE_PAGE_BYTES; }
    uint32_t largest_pageable(BlockForm form) const;
    uint32_t texel_words() const;  // of a path slot, that the texels of any one program take; 0 without images
    uint32_t first_block_entry_of(uint32_t block) const;
    BlockEntryRoots block_entries_of(uint32_t block) const;
    uint32_t instance_levels() const;  // how many instances something can be in at most; 0: there are none
    // Lights of instances of which rays can meet nothing need no traits.
    bool has_traits() const { return instances > 0 && !instance_traits.empty(); }
    bool has_vertex_colors() const;  // any mesh: kernels and path slots then have something more
    bool has_uvs() const;            // likewise
    bool has_bumps() const;          // textures that change normals
    bool is_anisotropic() const;     // any material
    bool has_tangents() const { return (has_bumps() || is_anisotropic()) && has_uvs(); }
    bool has_cutouts() const;  // surfaces of which parts are not there
    bool has_paged_sky() const { return !sky_words.empty(); }
    // What kernels have to do for any of these is the same: paths may wait where they have arrived.
    bool has_textures() const { return has_cutouts() || has_paged_sky() || !texture_ops.empty(); }
    // The ranges of the scene's own primitives come first, then those of objects, object by object.
    std::span<const rp_primitive_range> ranges_of_object(size_t object) const;
    size_t own_range_count() const { return objects.empty() ? ranges.size() : objects.front().first_range; }
    // How many lights the primitives of an object make that shine, in each of its instances.
    uint64_t lights_of_object(size_t object) const;
    uint64_t end_of_range(size_t range) const { return range + 1 < ranges.size() ? ranges[range + 1].first_primitive : triangles + spheres; }
    uint64_t identity() const;  // hash of everything that decides the picture, blocks included
};

}  // namespace raypager
