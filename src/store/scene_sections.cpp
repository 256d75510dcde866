#include "store/scene_sections.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "base/check.hpp"
#include "base/hash.hpp"
#include "scene/light_images.hpp"
#include "store/check_scene.hpp"

namespace raypager {
namespace {

using namespace format;

void store(float (&out)[3], const Float3& value) {
    out[0] = value.x;
    out[1] = value.y;
    out[2] = value.z;
}

Scalars make_scalars(const BakedScene& scene) {
    Scalars s = {};
    store(s.eye, scene.camera.eye);
    store(s.right, scene.camera.right);
    store(s.up, scene.camera.up);
    store(s.forward, scene.camera.forward);
    s.projection = static_cast<uint32_t>(scene.camera.projection);
    s.lens_radius = scene.camera.lens_radius;
    s.focal_distance = scene.camera.focal_distance;
    std::copy(scene.camera.window.begin(), scene.camera.window.end(), s.window);
    s.filter_kind = static_cast<uint32_t>(scene.filter.kind);
    s.filter_radius[0] = scene.filter.radius_x;
    s.filter_radius[1] = scene.filter.radius_y;
    s.filter_parameters[0] = scene.filter.first;
    s.filter_parameters[1] = scene.filter.second;
    s.width = scene.width;
    s.height = scene.height;
    s.spp = scene.spp;
    s.max_depth = scene.max_depth;
    std::memcpy(s.lower, scene.lower, sizeof s.lower);
    std::memcpy(s.upper, scene.upper, sizeof s.upper);
    s.top_grid = scene.top_grid;
    s.triangles = scene.triangles;
    s.spheres = scene.spheres;
    s.instances = scene.instances;
    s.fingerprint = scene.fingerprint;
    s.position_cell = scene.position_cell;
    s.exposure = scene.film.exposure;
    std::copy(scene.film.color_matrix.begin(), scene.film.color_matrix.end(), s.color_matrix);
    s.max_luminance = scene.film.max_luminance;
    s.max_xyz = scene.film.max_xyz;
    return s;
}

template <class T>
Status write_section(const SectionWriter& sink, Header& header, Section kind, std::span<const T> items) {
    const std::vector<std::byte> zeros((page - sink.position() % page) % page);
    RAYPAGER_TRY(sink.write(zeros));
    const auto bytes = std::as_bytes(items);
    header.sections[kind] = {sink.position(), items.size(), hash64(bytes), kind, item_bytes[kind]};
    static_assert(std::is_trivially_copyable_v<T>);
    RAYPAGER_CHECK(sizeof(T) == item_bytes[kind]);
    return sink.write(bytes);
}

Status read_header(const SectionReader& file, Header& header) {
    const std::string& path = file.name;
    if (file.size < page) return Status::failed(fmt::format("{}: is not a block file: it has only {} bytes; bake the scene again", path, file.size));
    RAYPAGER_TRY(file.read(0, std::as_writable_bytes(std::span(&header, 1))));
    if (std::memcmp(header.magic, magic, sizeof magic) != 0)
        return Status::failed(fmt::format("{}: is not a block file: it does not begin with \"RAYPAGER\"", path));
    if (header.endian_mark != endian_mark)
        return Status::failed(fmt::format("{}: header: the byte order mark is wrong; the file is damaged, bake the scene again", path));
    if (header.version != version)
        return Status::failed(
            fmt::format("{}: has format version {}, but this program reads version {}; bake the scene again", path, header.version, version));
    const auto bytes = std::as_bytes(std::span(&header, 1));
    if (header.header_bytes != sizeof header || header.section_count != section_count ||
        header.checksum != hash64(bytes.first(offsetof(Header, checksum))))
        return Status::failed(fmt::format("{}: header: the checksum is wrong; the file is damaged, bake the scene again", path));
    if (header.file_bytes != file.size)
        return Status::failed(
            fmt::format("{}: has {} bytes but should have {}; it is truncated or damaged, bake the scene again", path, file.size, header.file_bytes));
    return {};
}

// Checks that a section lies in the file before memory is taken for it.
template <class T>
Status read_section(const SectionReader& file, const Header& header, Section kind, std::vector<T>& items) {
    const SectionEntry& entry = header.sections[kind];
    const std::string place = fmt::format("{}: section \"{}\" at byte {}", file.name, section_names[kind], entry.offset);
    if (entry.kind != kind || entry.item_bytes != sizeof(T) || entry.offset < page || entry.offset > file.size ||
        entry.count > (file.size - entry.offset) / sizeof(T))
        return Status::failed(place + ": does not lie within the file; the file is damaged, bake the scene again");
    items.resize(entry.count);
    RAYPAGER_TRY(file.read(entry.offset, std::as_writable_bytes(std::span(items))));
    if (hash64(std::as_bytes(std::span(items))) != entry.checksum)
        return Status::failed(place + ": the checksum is wrong; the file is damaged, bake the scene again");
    return {};
}

Float3 load(const float (&v)[3]) { return {v[0], v[1], v[2]}; }

Status read_scalars(const SectionReader& file, const Header& header, BakedScene& scene) {
    std::vector<Scalars> items;
    RAYPAGER_TRY(read_section(file, header, scalars, items));
    if (items.size() != 1) return Status::failed(file.name + ": section \"scene\": must have one entry; the file is damaged, bake the scene again");
    const Scalars& s = items[0];
    scene.camera = {load(s.eye),
                    load(s.right),
                    load(s.up),
                    load(s.forward),
                    static_cast<Projection>(s.projection),
                    s.lens_radius,
                    s.focal_distance,
                    {s.window[0], s.window[1], s.window[2], s.window[3]}};
    scene.filter = {static_cast<PixelFilter::Kind>(s.filter_kind), s.filter_radius[0], s.filter_radius[1], s.filter_parameters[0],
                    s.filter_parameters[1]};
    scene.width = s.width;
    scene.height = s.height;
    scene.spp = s.spp;
    scene.max_depth = s.max_depth;
    std::memcpy(scene.lower, s.lower, sizeof s.lower);
    std::memcpy(scene.upper, s.upper, sizeof s.upper);
    scene.top_grid = s.top_grid;
    scene.triangles = s.triangles;
    scene.spheres = s.spheres;
    scene.instances = s.instances;
    scene.fingerprint = s.fingerprint;
    scene.position_cell = s.position_cell;
    scene.film.exposure = s.exposure;
    std::copy(std::begin(s.color_matrix), std::end(s.color_matrix), scene.film.color_matrix.begin());
    scene.film.max_luminance = s.max_luminance;
    scene.film.max_xyz = s.max_xyz;
    return {};
}

Status read_light_images(const SectionReader& file, const Header& header, BakedScene& scene) {
    std::vector<rp_light_image> sizes;
    std::vector<rp_texel> all;
    RAYPAGER_TRY(read_section(file, header, light_images, sizes));
    RAYPAGER_TRY(read_section(file, header, texels, all));
    RAYPAGER_TRY(read_section(file, header, sky_words, scene.sky_words));
    const auto in_pages = scene.has_paged_sky() ? sky_image(scene.lights) : std::nullopt;
    size_t first = 0;
    for (const auto& [width, height] : sizes) {
        const uint64_t count = scene.light_images.size() == in_pages ? 0 : uint64_t{width} * height;
        if (count > all.size() - first)
            return Status::failed(file.name + ": section \"texels\": has too few for the images; the file is damaged, bake the scene again");
        const auto begin = all.begin() + static_cast<ptrdiff_t>(first);
        scene.light_images.push_back(std::make_shared<const LightImage>(LightImage{width, height, {begin, begin + static_cast<ptrdiff_t>(count)}}));
        first += count;
    }
    if (first != all.size())
        return Status::failed(file.name + ": section \"texels\": has more than the images; the file is damaged, bake the scene again");
    return {};
}

}  // namespace

Status write_scene(const SectionWriter& sink, const BakedScene& scene) {
    Header header = {};
    std::memcpy(header.magic, magic, sizeof magic);
    header.version = version;
    header.endian_mark = endian_mark;
    header.header_bytes = sizeof header;
    header.section_count = section_count;
    const Scalars s = make_scalars(scene);
    RAYPAGER_TRY(write_section(sink, header, scalars, std::span(&s, 1)));
    RAYPAGER_TRY(write_section<rp_material>(sink, header, materials, scene.materials));
    RAYPAGER_TRY(write_section<rp_light>(sink, header, lights, scene.lights));
    RAYPAGER_TRY(write_section<rp_primitive_range>(sink, header, ranges, scene.ranges));
    RAYPAGER_TRY(write_section<rp_node>(sink, header, top_nodes, scene.top_nodes));
    RAYPAGER_TRY(write_section<rp_block_entry>(sink, header, block_entries, scene.block_entries));
    RAYPAGER_TRY(write_section<uint64_t>(sink, header, block_entry_paths, scene.block_entry_paths));
    RAYPAGER_TRY(write_section<rp_u32>(sink, header, wide_roots, scene.wide_roots));
    RAYPAGER_TRY(write_section<BlockRecord>(sink, header, blocks, scene.blocks));
    std::vector<rp_light_image> sizes;
    std::vector<rp_texel> all_texels;
    for (const auto& image : scene.light_images) {
        sizes.push_back({image->width, image->height});
        all_texels.insert(all_texels.end(), image->texels.begin(), image->texels.end());
    }
    RAYPAGER_TRY(write_section<rp_light_image>(sink, header, light_images, sizes));
    RAYPAGER_TRY(write_section<rp_texel>(sink, header, texels, all_texels));
    RAYPAGER_TRY(write_section<rp_image>(sink, header, images, scene.images));
    RAYPAGER_TRY(write_section<rp_image_level>(sink, header, image_levels, scene.image_levels));
    RAYPAGER_TRY(write_section<PageRecord>(sink, header, pages, scene.pages));
    RAYPAGER_TRY(write_section<rp_texture_op>(sink, header, texture_ops, scene.texture_ops));
    RAYPAGER_TRY(write_section<rp_texture_map>(sink, header, texture_maps, scene.texture_maps));
    RAYPAGER_TRY(write_section<rp_u32>(sink, header, sky_words, scene.sky_words));
    RAYPAGER_TRY(write_section<rp_object>(sink, header, objects, scene.objects));
    RAYPAGER_TRY(write_section<rp_instance_traits>(sink, header, instance_traits, scene.instance_traits));
    header.file_bytes = sink.position();
    header.checksum = hash64(std::as_bytes(std::span(&header, 1)).first(offsetof(Header, checksum)));
    return sink.write_at(0, std::as_bytes(std::span(&header, 1)));
}

Status read_scene(const SectionReader& file, BakedScene& scene, uint64_t& checksum) {
    Header header;
    RAYPAGER_TRY(read_header(file, header));
    checksum = header.checksum;
    RAYPAGER_TRY(read_scalars(file, header, scene));
    RAYPAGER_TRY(read_section(file, header, materials, scene.materials));
    RAYPAGER_TRY(read_section(file, header, lights, scene.lights));
    RAYPAGER_TRY(read_section(file, header, ranges, scene.ranges));
    RAYPAGER_TRY(read_section(file, header, top_nodes, scene.top_nodes));
    RAYPAGER_TRY(read_section(file, header, block_entries, scene.block_entries));
    RAYPAGER_TRY(read_section(file, header, block_entry_paths, scene.block_entry_paths));
    RAYPAGER_TRY(read_section(file, header, wide_roots, scene.wide_roots));
    RAYPAGER_TRY(read_section(file, header, blocks, scene.blocks));
    RAYPAGER_TRY(read_light_images(file, header, scene));
    RAYPAGER_TRY(read_section(file, header, images, scene.images));
    RAYPAGER_TRY(read_section(file, header, image_levels, scene.image_levels));
    RAYPAGER_TRY(read_section(file, header, pages, scene.pages));
    RAYPAGER_TRY(read_section(file, header, texture_ops, scene.texture_ops));
    RAYPAGER_TRY(read_section(file, header, texture_maps, scene.texture_maps));
    RAYPAGER_TRY(read_section(file, header, objects, scene.objects));
    RAYPAGER_TRY(read_section(file, header, instance_traits, scene.instance_traits));
    return check_scene(scene, file.size).at(file.name);
}

Result<uint64_t> read_scene_checksum(const SectionReader& file) {
    Header header;
    RAYPAGER_TRY(read_header(file, header));
    return header.checksum;
}

// The header, and then what lies behind the blocks; the first page of a file holds nothing but the header.
Result<std::vector<std::byte>> scene_bytes(const BakedScene& scene) {
    uint64_t behind = page;
    for (const BlockRecord& block : scene.blocks) behind = std::max(behind, block.offset + block.stored_bytes);
    for (const PageRecord& image_page : scene.pages) behind = std::max(behind, image_page.offset + RP_TEXTURE_PAGE_BYTES);
    std::vector<std::byte> bytes(page);
    const SectionWriter sink = {[&] { return behind + bytes.size() - page; },
                                [&](std::span<const std::byte> more) {
                                    bytes.insert(bytes.end(), more.begin(), more.end());
                                    return Status();
                                },
                                [&](uint64_t offset, std::span<const std::byte> header) {
                                    std::ranges::copy(header, bytes.begin() + static_cast<ptrdiff_t>(offset));
                                    return Status();
                                }};
    RAYPAGER_TRY(write_scene(sink, scene));
    return bytes;
}

Result<BakedScene> scene_from_bytes(std::span<const std::byte> bytes) {
    Header header = {};
    if (bytes.size() < page) return Status::failed("the scene of another process: is truncated");
    std::memcpy(&header, bytes.data(), sizeof header);
    const uint64_t behind = header.file_bytes - (bytes.size() - page);
    const auto read = [&](uint64_t offset, std::span<std::byte> target) {
        const uint64_t at = offset < page ? offset : offset - behind + page;
        if (offset >= page && offset < behind) return Status::failed("the scene of another process: has no such section");
        if (at > bytes.size() || target.size() > bytes.size() - at) return Status::failed("the scene of another process: is truncated");
        std::ranges::copy(bytes.subspan(at, target.size()), target.begin());
        return Status();
    };
    BakedScene scene;
    uint64_t checksum = 0;
    RAYPAGER_TRY(read_scene({"the scene of another process", header.file_bytes, read}, scene, checksum));
    return scene;
}

}  // namespace raypager
