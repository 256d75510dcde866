// All of a baked scene but its blocks and pages, as it lies in a block file: a header, and behind the blocks a section for each table (FORMAT.md).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "block/baked_scene.hpp"
#include "raypager/status.hpp"
#include "store/format.hpp"

namespace raypager {

struct SectionReader {
    std::string name;  // for messages
    uint64_t size = 0;
    std::function<Status(uint64_t offset, std::span<std::byte> bytes)> read;
};

struct SectionWriter {
    std::function<uint64_t()> position;
    std::function<Status(std::span<const std::byte> bytes)> write;  // at the position
    std::function<Status(uint64_t offset, std::span<const std::byte> bytes)> write_at;
};

// Reads and checks: magic, version, sizes, checksums, and that indices and bounds make sense. checksum: of the header, and so of all that is read.
Status read_scene(const SectionReader& file, BakedScene& scene, uint64_t& checksum);
Result<uint64_t> read_scene_checksum(const SectionReader& file);
// Sections from the position on, and the header at 0.
Status write_scene(const SectionWriter& sink, const BakedScene& scene);

// The same without the blocks and pages, to be sent to another process.
Result<std::vector<std::byte>> scene_bytes(const BakedScene& scene);
Result<BakedScene> scene_from_bytes(std::span<const std::byte> bytes);

}  // namespace raypager
