#include "store/block_file.hpp"

#include <fmt/format.h>

#include "store/scene_sections.hpp"

namespace raypager {
namespace {

SectionReader sections_of(const InputFile& file) {
    return {file.path().string(), file.size(), [&file](uint64_t offset, std::span<std::byte> bytes) { return file.read(offset, bytes); }};
}

}  // namespace

Result<std::shared_ptr<const BlockFile>> BlockFile::open(const std::filesystem::path& path, const Change& change) {
    auto file = InputFile::open(path);
    if (!file) return file.status();
    auto opened = std::make_shared<BlockFile>();
    RAYPAGER_TRY(read_scene(sections_of(*file), opened->scene_, opened->checksum_));
    if (change) change(opened->scene_);
    opened->path_ = path;
    opened->file_ = std::move(*file);
    return std::shared_ptr<const BlockFile>(std::move(opened));
}

std::shared_ptr<const BlockFile> BlockFile::of_origin(BakedScene scene, const Origin& origin) {
    auto opened = std::make_shared<BlockFile>();
    opened->scene_ = std::move(scene);
    opened->path_ = origin.file;
    opened->checksum_ = origin.checksum;
    auto file = InputFile::open(origin.file);
    if (!file) return opened;
    const auto checksum = read_scene_checksum(sections_of(*file));
    if (checksum && *checksum == origin.checksum) opened->file_ = std::move(*file);
    return opened;
}

BlockSource::Origin BlockFile::origin() const {
    std::error_code error;
    const std::filesystem::path absolute = std::filesystem::absolute(path_, error);
    return {error ? path_ : absolute, checksum_};
}

uint64_t BlockFile::offset_of(uint32_t pageable) const {
    return scene_.is_page(pageable) ? scene_.pages[pageable - scene_.blocks.size()].offset : scene_.blocks[pageable].offset;
}

Status BlockFile::fetch(uint32_t pageable, std::span<std::byte> stored) const {
    if (!has_bytes())
        return Status::failed(
            fmt::format("{}: {} cannot be read: the file is not there, or is another one", path().string(), scene_.pageable_name(pageable)));
    const Status status = file_.read(offset_of(pageable), stored);
    return status.ok() ? status : status.at(scene_.pageable_name(pageable));
}

Status BlockFile::damaged(uint32_t pageable, const std::string& what) const {
    return Status::failed(fmt::format("{}: {} at byte {}: {}; the file is damaged, bake the scene again", path().string(),
                                      scene_.pageable_name(pageable), offset_of(pageable), what));
}

}  // namespace raypager
