#include "store/block_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "base/hash.hpp"
#include "scene/light_images.hpp"
#include "store/check_scene.hpp"
#include "store/format.hpp"

namespace raypager {
namespace {

using namespace format;

Status read_header(const InputFile& file, Header& header) {
    const std::string path = file.path().string();
    if (file.size() < page)
        return Status::failed(fmt::format("{}: is not a block file: it has only {} bytes; bake the scene again", path, file.size()));
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
    if (header.file_bytes != file.size())
        return Status::failed(fmt::format("{}: has {} bytes but should have {}; it is truncated or damaged, bake the scene again", path, file.size(),
                                          header.file_bytes));
    return {};
}

// Checks that a section lies in the file before memory is taken for it.
template <class T>
Status read_section(const InputFile& file, const Header& header, Section kind, std::vector<T>& items) {
    const SectionEntry& entry = header.sections[kind];
    const std::string place = fmt::format("{}: section \"{}\" at byte {}", file.path().string(), section_names[kind], entry.offset);
    if (entry.kind != kind || entry.item_bytes != sizeof(T) || entry.offset < page || entry.offset > file.size() ||
        entry.count > (file.size() - entry.offset) / sizeof(T))
        return Status::failed(place + ": does not lie within the file; the file is damaged, bake the scene again");
    items.resize(entry.count);
    RAYPAGER_TRY(file.read(entry.offset, std::as_writable_bytes(std::span(items))));
    if (hash64(std::as_bytes(std::span(items))) != entry.checksum)
        return Status::failed(place + ": the checksum is wrong; the file is damaged, bake the scene again");
    return {};
}

Float3 load(const float (&v)[3]) { return {v[0], v[1], v[2]}; }

Status read_scalars(const InputFile& file, const Header& header, BakedScene& scene) {
    std::vector<Scalars> items;
    RAYPAGER_TRY(read_section(file, header, scalars, items));
    if (items.size() != 1)
        return Status::failed(file.path().string() + ": section \"scene\": must have one entry; the file is damaged, bake the scene again");
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

Status read_light_images(const InputFile& file, const Header& header, BakedScene& scene) {
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
            return Status::failed(file.path().string() +
                                  ": section \"texels\": has too few for the images; the file is damaged, bake the scene again");
        const auto begin = all.begin() + static_cast<ptrdiff_t>(first);
        scene.light_images.push_back(std::make_shared<const LightImage>(LightImage{width, height, {begin, begin + static_cast<ptrdiff_t>(count)}}));
        first += count;
    }
    if (first != all.size())
        return Status::failed(file.path().string() + ": section \"texels\": has more than the images; the file is damaged, bake the scene again");
    return {};
}

}  // namespace

Result<std::shared_ptr<const BlockFile>> BlockFile::open(const std::filesystem::path& path, const Change& change) {
    auto file = InputFile::open(path);
    if (!file) return file.status();
    auto opened = std::make_shared<BlockFile>();
    BakedScene& scene = opened->scene_;
    Header header;
    RAYPAGER_TRY(read_header(*file, header));
    RAYPAGER_TRY(read_scalars(*file, header, scene));
    RAYPAGER_TRY(read_section(*file, header, materials, scene.materials));
    RAYPAGER_TRY(read_section(*file, header, lights, scene.lights));
    RAYPAGER_TRY(read_section(*file, header, ranges, scene.ranges));
    RAYPAGER_TRY(read_section(*file, header, top_nodes, scene.top_nodes));
    RAYPAGER_TRY(read_section(*file, header, block_entries, scene.block_entries));
    RAYPAGER_TRY(read_section(*file, header, block_entry_paths, scene.block_entry_paths));
    RAYPAGER_TRY(read_section(*file, header, wide_roots, scene.wide_roots));
    RAYPAGER_TRY(read_section(*file, header, blocks, scene.blocks));
    RAYPAGER_TRY(read_light_images(*file, header, scene));
    RAYPAGER_TRY(read_section(*file, header, images, scene.images));
    RAYPAGER_TRY(read_section(*file, header, image_levels, scene.image_levels));
    RAYPAGER_TRY(read_section(*file, header, pages, scene.pages));
    RAYPAGER_TRY(read_section(*file, header, texture_ops, scene.texture_ops));
    RAYPAGER_TRY(read_section(*file, header, texture_maps, scene.texture_maps));
    RAYPAGER_TRY(read_section(*file, header, objects, scene.objects));
    RAYPAGER_TRY(read_section(*file, header, instance_traits, scene.instance_traits));
    if (auto status = check_scene(scene, file->size()); !status.ok()) return status.at(path.string());
    if (change) change(scene);
    opened->file_ = std::move(*file);
    return std::shared_ptr<const BlockFile>(std::move(opened));
}

uint64_t BlockFile::offset_of(uint32_t pageable) const {
    return scene_.is_page(pageable) ? scene_.pages[pageable - scene_.blocks.size()].offset : scene_.blocks[pageable].offset;
}

Status BlockFile::fetch(uint32_t pageable, std::span<std::byte> stored) const {
    const Status status = file_.read(offset_of(pageable), stored);
    return status.ok() ? status : status.at(scene_.pageable_name(pageable));
}

Status BlockFile::damaged(uint32_t pageable, const std::string& what) const {
    return Status::failed(fmt::format("{}: {} at byte {}: {}; the file is damaged, bake the scene again", path().string(),
                                      scene_.pageable_name(pageable), offset_of(pageable), what));
}

}  // namespace raypager
