#include <vector>

#include "base/check.hpp"
#include "base/hash.hpp"
#include "store/block_file.hpp"
#include "store/format.hpp"
#include "store/scene_sections.hpp"

namespace raypager {
namespace {

using namespace format;

Status pad_to_page(OutputFile& file) {
    const std::vector<std::byte> zeros((page - file.position() % page) % page);
    return file.write(zeros);
}

}  // namespace

Result<BlockFileWriter> BlockFileWriter::create(const std::filesystem::path& path) {
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
    const SectionWriter sink = {[this] { return file_.position(); }, [this](std::span<const std::byte> bytes) { return file_.write(bytes); },
                                [this](uint64_t offset, std::span<const std::byte> bytes) { return file_.write_at(offset, bytes); }};
    RAYPAGER_TRY(write_scene(sink, scene));
    return file_.commit();
}

}  // namespace raypager
