#include "support/block_file_bytes.hpp"

#include <algorithm>
#include <cstring>

#include "base/hash.hpp"
#include "store/format.hpp"

namespace raypager::support {
namespace {

using format::Header;
using format::page;

// A part of the file; empty if it does not lie within.
std::span<std::byte> part(std::string& bytes, uint64_t offset, uint64_t count, uint64_t item_bytes) {
    if (offset > bytes.size() || item_bytes == 0 || count > (bytes.size() - offset) / item_bytes) return {};
    return std::as_writable_bytes(std::span(bytes)).subspan(offset, count * item_bytes);
}

void seal_blocks(std::string& bytes, std::span<std::byte> table) {
    for (; table.size() >= sizeof(BlockRecord); table = table.subspan(sizeof(BlockRecord))) {
        BlockRecord record;
        std::memcpy(&record, table.data(), sizeof record);
        const auto block = part(bytes, record.offset, record.stored_bytes, 1);
        if (!block.empty()) record.checksum = hash64(block);
        std::memcpy(table.data(), &record, sizeof record);
    }
}

void seal_image_pages(std::string& bytes, std::span<std::byte> table) {
    for (; table.size() >= sizeof(PageRecord); table = table.subspan(sizeof(PageRecord))) {
        PageRecord record;
        std::memcpy(&record, table.data(), sizeof record);
        const auto image_page = part(bytes, record.offset, RP_TEXTURE_PAGE_BYTES, 1);
        if (!image_page.empty()) record.checksum = hash64(image_page);
        std::memcpy(table.data(), &record, sizeof record);
    }
}

uint32_t length_at(std::string_view text) {
    uint32_t length;
    std::memcpy(&length, text.data(), sizeof length);
    return length;
}

}  // namespace

void seal_block_file(std::string& bytes) {
    Header header;
    std::memcpy(&header, bytes.data(), sizeof header);
    const auto& blocks = header.sections[format::blocks];
    seal_blocks(bytes, part(bytes, blocks.offset, blocks.count, sizeof(BlockRecord)));
    const auto& pages = header.sections[format::pages];
    seal_image_pages(bytes, part(bytes, pages.offset, pages.count, sizeof(PageRecord)));
    for (auto& section : header.sections) {
        const auto items = part(bytes, section.offset, section.count, section.item_bytes);
        if (!items.empty()) section.checksum = hash64(items);
    }
    header.checksum = hash64(std::as_bytes(std::span(&header, 1)).first(offsetof(Header, checksum)));
    std::memcpy(bytes.data(), &header, sizeof header);
}

std::string squeeze_pages(std::string_view bytes) {
    Header header;
    std::memcpy(&header, bytes.data(), sizeof header);
    std::vector<std::pair<uint64_t, uint64_t>> parts = {{0, sizeof header}};
    const auto& blocks = header.sections[format::blocks];
    for (uint64_t i = 0; i < blocks.count; i++) {
        BlockRecord record;
        std::memcpy(&record, bytes.data() + blocks.offset + i * sizeof record, sizeof record);
        parts.emplace_back(record.offset, record.stored_bytes);
    }
    const auto& pages = header.sections[format::pages];
    for (uint64_t i = 0; i < pages.count; i++) {
        PageRecord record;
        std::memcpy(&record, bytes.data() + pages.offset + i * sizeof record, sizeof record);
        parts.emplace_back(record.offset, RP_TEXTURE_PAGE_BYTES);
    }
    for (const auto& section : header.sections) parts.emplace_back(section.offset, section.count * section.item_bytes);
    std::sort(parts.begin(), parts.end());
    return squeeze_parts(bytes, parts);
}

std::string squeeze_parts(std::string_view bytes, const std::vector<std::pair<uint64_t, uint64_t>>& offsets_and_sizes) {
    std::string result;
    for (const auto& [offset, size] : offsets_and_sizes) {
        const auto length = static_cast<uint32_t>(size);
        result.append(reinterpret_cast<const char*>(&length), sizeof length).append(bytes.substr(offset, size));
    }
    return result;
}

std::string spread_pages(std::string_view squeezed) {
    std::string bytes;
    while (squeezed.size() >= sizeof(uint32_t)) {
        const uint32_t length = length_at(squeezed);
        squeezed.remove_prefix(sizeof length);
        const std::string_view piece = squeezed.substr(0, length);
        squeezed.remove_prefix(piece.size());
        bytes.resize((bytes.size() + page - 1) / page * page);
        bytes += piece;
    }
    return bytes;
}

}  // namespace raypager::support
