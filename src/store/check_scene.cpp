#include "store/check_scene.hpp"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "block/block_coding.hpp"
#include "block/coordinates.hpp"
#include "raypager/abi/path.h"
#include "scene/check_material.hpp"
#include "scene/light_images.hpp"
#include "scene/pixel_filter.hpp"
#include "scene/projection.hpp"
#include "store/check_images.hpp"
#include "store/check_trees.hpp"
#include "store/format.hpp"
#include "store/section_status.hpp"

namespace raypager {
namespace {

using namespace format;

Status bad(Section section, const std::string& what) { return bad_section(section, what); }

bool finite(std::span<const float> values) {
    for (const float value : values)
        if (!std::isfinite(value)) return false;
    return true;
}

bool good_bounds(const float (&lower)[3], const float (&upper)[3]) {
    bool good = true;
    for (int a = 0; a < 3; a++) good = good && is_stored_coordinate(lower[a]) && is_stored_coordinate(upper[a]) && lower[a] <= upper[a];
    return good;
}

Status check_scalars(const BakedScene& scene) {
    for (const Float3& v : {scene.camera.eye, scene.camera.right, scene.camera.up, scene.camera.forward})
        if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) return bad(scalars, "the camera is not finite");
    if (const Status camera = check_projection(scene.camera); !camera.ok()) return bad(scalars, camera.message());
    if (const Status filter = check_filter(scene.filter); !filter.ok()) return bad(scalars, filter.message());
    if (scene.width == 0 || scene.height == 0 || scene.spp == 0) return bad(scalars, "the size of the picture is zero");
    if (!(scene.film.exposure >= 0) || !std::isfinite(scene.film.exposure) || !finite(scene.film.color_matrix) || !(scene.film.max_luminance >= 0) ||
        !(scene.film.max_xyz >= 0))
        return bad(scalars, "the response of the film makes no sense");
    if (!good_position_cell(scene.position_cell)) return bad(scalars, "the grid of positions makes no sense");
    if (!good_bounds(scene.lower, scene.upper)) return bad(scalars, "the bounds make no sense");
    if (!is_stored_grid(scene.top_grid.origin, scene.top_grid.cell)) return bad(scalars, "the grid of the top tree makes no sense");
    if (scene.triangles >= RP_NONE || scene.spheres >= RP_NONE || scene.triangles + scene.spheres >= RP_NONE)
        return bad(scalars, "too many primitives");
    if (scene.instances >= RP_NONE) return bad(scalars, "too many instances");
    return {};
}

Status check_materials(const BakedScene& scene) {
    for (size_t i = 0; i < scene.materials.size(); i++)
        if (const Status status = check_material(scene.materials, i); !status.ok()) return bad(materials, status.message());
    return {};
}

Status check_lights(const BakedScene& scene) {
    double sum = 0;
    size_t infinite = 0;
    for (size_t i = 0; i < scene.lights.size(); i++) {
        const rp_light& light = scene.lights[i];
        if (light.kind > RP_LIGHT_PROJECTION) return bad(lights, fmt::format("light {} is of an unknown kind", i));
        if (!finite(light.p) || !finite(light.e1) || !finite(light.e2) || !finite(light.radiance) || !std::isfinite(light.area))
            return bad(lights, fmt::format("light {} is not finite", i));
        const bool lamp = light.kind == RP_LIGHT_POINT || light.kind == RP_LIGHT_PROJECTION;
        const rp_u32 known = RP_LIGHT_TWO_SIDED | RP_LIGHT_UNSEEN | (lamp ? RP_LIGHT_MIRRORED : 0);
        if ((light.flags & ((1u << RP_LIGHT_IMAGE_SHIFT) - 1)) & ~known) return bad(lights, fmt::format("light {} has unknown flags", i));
        if (!(light.probability > 0 && light.probability <= 1)) return bad(lights, fmt::format("light {} has no probability", i));
        sum += light.probability;
        infinite += light.kind == RP_LIGHT_INFINITE;
    }
    if (infinite > 1) return bad(lights, "there is more than one infinite light");
    // Single-precision roundings are far smaller, on average, than this.
    if (!scene.lights.empty() && std::abs(sum - 1) > 1e-4) return bad(lights, fmt::format("the probabilities sum up to {}", sum));
    if (const Status status = check_light_images(scene.light_images, scene.lights, scene.has_paged_sky()); !status.ok())
        return bad(light_images, status.message());
    return {};
}

// What is met is weighted as what is seen.
bool are_seen_surfaces(std::span<const rp_light> lights) {
    for (const rp_light& light : lights)
        if (light.kind > RP_LIGHT_SPHERE || light.flags & RP_LIGHT_UNSEEN) return false;
    return true;
}

// Whether an instance may put a material there of which parts are not there.
bool cuts_out(const BakedScene& scene) {
    for (const rp_instance_traits& t : scene.instance_traits)
        if (t.material != RP_NONE && may_be_nothing(scene.materials, t.material)) return true;
    return false;
}

// Which ranges are those of an object.
Status check_objects(const BakedScene& scene) {
    for (size_t i = 0; i < scene.objects.size(); i++) {
        const uint64_t end = i + 1 < scene.objects.size() ? scene.objects[i + 1].first_range : scene.ranges.size();
        if (scene.objects[i].first_range > end) return bad(objects, fmt::format("the ranges of object {} are out of order", i));
    }
    for (size_t i = 0; i < scene.objects.size(); i++) {
        uint64_t next = 0;
        for (const rp_primitive_range& range : scene.ranges_of_object(i)) {
            if (range.first_light == RP_NONE) continue;
            if (range.first_light != next) return bad(ranges, fmt::format("the lights of object {} are out of order", i));
            next += scene.end_of_range(static_cast<size_t>(&range - scene.ranges.data())) - range.first_primitive;
        }
    }
    return {};
}

Status check_traits(const BakedScene& scene) {
    if (scene.instance_traits.size() > RP_MAX_INSTANCE_TRAITS) return bad(instance_traits, "there are too many");
    for (size_t i = 0; i < scene.instance_traits.size(); i++) {
        const rp_instance_traits& t = scene.instance_traits[i];
        const auto damaged = [&](const char* what) { return bad(instance_traits, fmt::format("those of number {} {}", i + 1, what)); };
        for (const float part : t.color)
            if (!(part >= 0 && part <= 1)) return damaged("have no colour");
        if (t.material != RP_NONE && t.material >= scene.materials.size()) return damaged("have no material");
        if (t.unused != 0) return damaged("have more than there is");
        if (t.first_light == RP_NONE) {
            if (t.light_count != 0 || t.object != RP_NONE) return damaged("have lights that do not exist");
            continue;
        }
        if (t.object >= scene.objects.size()) return damaged("are of an object that does not exist");
        if (t.first_light > scene.lights.size() || t.light_count > scene.lights.size() - t.first_light || t.light_count == 0)
            return damaged("have lights that do not exist");
        const uint64_t seen = scene.lights_of_object(t.object);
        if (t.light_count < seen) return damaged("have fewer lights than their object");
        if (!are_seen_surfaces(std::span(scene.lights).subspan(t.first_light, seen))) return damaged("have lights of another kind");
    }
    return {};
}

Status check_ranges(const BakedScene& scene) {
    const uint64_t primitives = scene.triangles + scene.spheres;
    if (scene.ranges.empty() != (primitives == 0)) return bad(ranges, "does not cover the primitives");
    const size_t own = scene.own_range_count();
    const bool any_cut_out = cuts_out(scene);
    for (size_t i = 0; i < scene.ranges.size(); i++) {
        const rp_primitive_range& range = scene.ranges[i];
        const uint64_t end = i + 1 < scene.ranges.size() ? scene.ranges[i + 1].first_primitive : primitives;
        if ((i == 0 && range.first_primitive != 0) || range.first_primitive >= end) return bad(ranges, fmt::format("range {} is out of order", i));
        if (range.material >= scene.materials.size()) return bad(ranges, fmt::format("range {} has no material", i));
        const uint32_t known = RP_RANGE_POINT_COLOR | RP_RANGE_VERTEX_COLOR | RP_RANGE_UV | RP_RANGE_CUTOUT |
                               (range.first_light != RP_NONE ? RP_RANGE_AREA_LIGHTS << RP_RANGE_AREA_LIGHT_SHIFT : 0);
        if (range.flags & ~known || (range.flags & RP_RANGE_POINT_COLOR && range.flags & (RP_RANGE_VERTEX_COLOR | RP_RANGE_UV)))
            return bad(ranges, fmt::format("range {} has unknown flags", i));
        const bool cut_out = (range.flags & RP_RANGE_CUTOUT) != 0, by_instance = cut_out && i >= own && any_cut_out;
        if (may_be_nothing(scene.materials, range.material) != cut_out && !by_instance)
            return bad(ranges, fmt::format("range {} has the wrong flags for its material", i));
        if (range.first_light != RP_NONE && cut_out) return bad(ranges, fmt::format("range {} shines and is cut out", i));
        // Those of objects are where their instances have them.
        if (range.first_light == RP_NONE || i >= own) continue;
        const uint64_t count = end - range.first_primitive;
        if (range.first_light + count > scene.lights.size()) return bad(ranges, fmt::format("range {} has no lights", i));
        if (!are_seen_surfaces(std::span(scene.lights).subspan(range.first_light, count)))
            return bad(ranges, fmt::format("range {} has lights of another kind", i));
    }
    return {};
}

Status check_blocks(const BakedScene& scene, uint64_t file_bytes) {
    uint64_t triangles = 0, spheres = 0, instances = 0;
    for (size_t i = 0; i < scene.blocks.size(); i++) {
        const BlockRecord& block = scene.blocks[i];
        if (block.offset % page != 0 || block.offset < page || block.offset > file_bytes || block.stored_bytes > file_bytes - block.offset)
            return bad(blocks, fmt::format("block {} does not lie within the file", i));
        if (block.stored_bytes < sizeof(rp_block_header) || block.stored_bytes > RP_MAX_BLOCK_BYTES || block.stored_bytes % RP_BLOCK_ALIGNMENT != 0 ||
            block.wide_bytes < sizeof(rp_wide_header) || block.wide_bytes > RP_MAX_WIDE_BYTES || block.wide_bytes % RP_BLOCK_ALIGNMENT != 0)
            return bad(blocks, fmt::format("block {} has an impossible size", i));
        if (!good_bounds(block.lower, block.upper)) return bad(blocks, fmt::format("the bounds of block {} make no sense", i));
        if (block.instances > 0 && (block.triangles > 0 || block.spheres > 0))
            return bad(blocks, fmt::format("block {} holds more than instances", i));
        triangles += block.triangles;
        spheres += block.spheres;
        instances += block.instances;
    }
    if (triangles != scene.triangles || spheres != scene.spheres) return bad(blocks, "the blocks do not hold as many primitives as the scene");
    if (instances != scene.instances) return bad(blocks, "the blocks do not hold as many instances as the scene");
    return {};
}

Status check_block_entries(const BakedScene& scene) {
    if (scene.block_entries.size() != scene.top_grid.block_entry_count || scene.block_entries.size() != scene.block_entry_paths.size() ||
        scene.block_entries.size() != scene.wide_roots.size())
        return bad(block_entries, "their number is inconsistent");
    uint64_t next_block = 0, of_block = 0;
    for (size_t i = 0; i < scene.block_entries.size(); i++) {
        const rp_block_entry& block_entry = scene.block_entries[i];
        of_block = block_entry.block + uint64_t{1} == next_block ? of_block + 1 : 1;
        if (of_block == 1 && block_entry.block != next_block++) return bad(block_entries, fmt::format("block entry {} is out of order", i));
        if (block_entry.block >= scene.blocks.size() || of_block > RP_MAX_BLOCK_ENTRIES)
            return bad(block_entries, fmt::format("block entry {} leads to no block", i));
        if (!is_stored_grid(block_entry.origin, block_entry.cell))
            return bad(block_entries, fmt::format("the grid of block entry {} makes no sense", i));
        if ((block_entry.root & RP_REF_BLOCK_ENTRY) == RP_REF_BLOCK_ENTRY || block_entry.root == RP_REF_EXIT ||
            (!(block_entry.root & RP_REF_LEAF) && uint64_t{block_entry.root} * sizeof(rp_node) >= scene.blocks[block_entry.block].stored_bytes))
            return bad(block_entries, fmt::format("block entry {} has no root", i));
        const bool of_instances = scene.blocks[block_entry.block].instances > 0;
        if (of_instances && of_block > 1) return bad(block_entries, fmt::format("block {} holds instances, and has two", block_entry.block));
        if (uint64_t{scene.wide_roots[i] >> 1} * RP_WIDE_UNIT >= scene.blocks[block_entry.block].wide_bytes)
            return bad(wide_roots, fmt::format("block entry {} has no root", i));
    }
    if (next_block != scene.blocks.size()) return bad(block_entries, fmt::format("block {} has none", next_block));
    return {};
}

}  // namespace

Status bad_section(format::Section section, const std::string& what) {
    return Status::failed(fmt::format("section \"{}\": {}; the file is damaged, bake the scene again", section_names[section], what));
}

Status check_scene(const BakedScene& scene, uint64_t file_bytes) {
    RAYPAGER_TRY(check_scalars(scene));
    RAYPAGER_TRY(check_materials(scene));
    RAYPAGER_TRY(check_lights(scene));
    RAYPAGER_TRY(check_objects(scene));
    RAYPAGER_TRY(check_traits(scene));
    RAYPAGER_TRY(check_ranges(scene));
    RAYPAGER_TRY(check_blocks(scene, file_bytes));
    RAYPAGER_TRY(check_images(scene, file_bytes));
    RAYPAGER_TRY(check_block_entries(scene));
    return check_trees(scene);
}

}  // namespace raypager
