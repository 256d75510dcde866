#include <algorithm>
#include <cstring>
#include <vector>

#include "base/check.hpp"
#include "base/hash.hpp"
#include "store/block_file.hpp"
#include "store/format.hpp"

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

Status pad_to_page(OutputFile& file) {
    const std::vector<std::byte> zeros((page - file.position() % page) % page);
    return file.write(zeros);
}

template <class T>
Status write_section(OutputFile& file, Header& header, Section kind, std::span<const T> items) {
    RAYPAGER_TRY(pad_to_page(file));
    const auto bytes = std::as_bytes(items);
    header.sections[kind] = {file.position(), items.size(), hash64(bytes), kind, item_bytes[kind]};
    static_assert(std::is_trivially_copyable_v<T>);
    RAYPAGER_CHECK(sizeof(T) == item_bytes[kind]);
    return file.write(bytes);
}

}  // namespace

Result<BlockFileWriter> BlockFileWriter::create(const std::filesystem::path& path) {
    // Bakes that were killed may have left files of many gigabytes.
    remove_abandoned_temporaries(path);
    auto file = OutputFile::create(path);
    if (!file) return file.status();
    BlockFileWriter writer;
    writer.file_ = std::move(*file);
    // Room for the header, which is written last.
    if (auto status = writer.file_.write(std::vector<std::byte>(page)); !status.ok()) return status;
    return writer;
}

Status BlockFileWriter::append(std::span<const std::byte> stored, BlockRecord& record) {
    RAYPAGER_CHECK(!stored.empty() && stored.size() <= UINT32_MAX);
    RAYPAGER_TRY(pad_to_page(file_));
    record.offset = file_.position();
    record.checksum = hash64(stored);
    record.stored_bytes = static_cast<uint32_t>(stored.size());
    return file_.write(stored);
}

Status BlockFileWriter::reserve_pages(uint32_t count) {
    RAYPAGER_TRY(pad_to_page(file_));
    pages_at_ = file_.position();
    return file_.skip(uint64_t{count} * RP_TEXTURE_PAGE_BYTES);
}

Status BlockFileWriter::put_page(uint32_t number, std::span<const std::byte> bytes, PageRecord& record) {
    RAYPAGER_CHECK(bytes.size() == RP_TEXTURE_PAGE_BYTES);
    record.offset = pages_at_ + uint64_t{number} * RP_TEXTURE_PAGE_BYTES;
    record.checksum = hash64(bytes);
    return file_.write_at(record.offset, bytes);
}

Status BlockFileWriter::finish(const BakedScene& scene) {
    Header header = {};
    std::memcpy(header.magic, magic, sizeof magic);
    header.version = version;
    header.endian_mark = endian_mark;
    header.header_bytes = sizeof header;
    header.section_count = section_count;
    const Scalars s = make_scalars(scene);
    RAYPAGER_TRY(write_section(file_, header, scalars, std::span(&s, 1)));
    RAYPAGER_TRY(write_section<rp_material>(file_, header, materials, scene.materials));
    RAYPAGER_TRY(write_section<rp_light>(file_, header, lights, scene.lights));
    RAYPAGER_TRY(write_section<rp_primitive_range>(file_, header, ranges, scene.ranges));
    RAYPAGER_TRY(write_section<rp_node>(file_, header, top_nodes, scene.top_nodes));
    RAYPAGER_TRY(write_section<rp_block_entry>(file_, header, block_entries, scene.block_entries));
    RAYPAGER_TRY(write_section<uint64_t>(file_, header, block_entry_paths, scene.block_entry_paths));
    RAYPAGER_TRY(write_section<rp_u32>(file_, header, wide_roots, scene.wide_roots));
    RAYPAGER_TRY(write_section<BlockRecord>(file_, header, blocks, scene.blocks));
    std::vector<rp_light_image> sizes;
    std::vector<rp_texel> all_texels;
    for (const auto& image : scene.light_images) {
        sizes.push_back({image->width, image->height});
        all_texels.insert(all_texels.end(), image->texels.begin(), image->texels.end());
    }
    RAYPAGER_TRY(write_section<rp_light_image>(file_, header, light_images, sizes));
    RAYPAGER_TRY(write_section<rp_texel>(file_, header, texels, all_texels));
    RAYPAGER_TRY(write_section<rp_image>(file_, header, images, scene.images));
    RAYPAGER_TRY(write_section<rp_image_level>(file_, header, image_levels, scene.image_levels));
    RAYPAGER_TRY(write_section<PageRecord>(file_, header, pages, scene.pages));
    RAYPAGER_TRY(write_section<rp_texture_op>(file_, header, texture_ops, scene.texture_ops));
    RAYPAGER_TRY(write_section<rp_texture_map>(file_, header, texture_maps, scene.texture_maps));
    RAYPAGER_TRY(write_section<rp_u32>(file_, header, sky_words, scene.sky_words));
    RAYPAGER_TRY(write_section<rp_object>(file_, header, objects, scene.objects));
    RAYPAGER_TRY(write_section<rp_instance_traits>(file_, header, instance_traits, scene.instance_traits));
    header.file_bytes = file_.position();
    header.checksum = hash64(std::as_bytes(std::span(&header, 1)).first(offsetof(Header, checksum)));
    RAYPAGER_TRY(file_.write_at(0, std::as_bytes(std::span(&header, 1))));
    return file_.commit();
}

}  // namespace raypager
