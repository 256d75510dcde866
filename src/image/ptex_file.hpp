// Ptex files: a texture of its own for each face of a mesh, without coordinates. The format is that of Disney's library (Burley and Lacewell 2008,
// "Ptex: Per-Face Texture Mapping for Production Texture Mapping"), version 1, for meshes of quads. Levels that a file has beside the faces as they
// are, and metadata, are not read.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "base/files.hpp"
#include "image/texel_conversion.hpp"

namespace raypager {

class PtexFile {
public:
    // Reads what faces there are. Memory is in proportion to the file, or to what its faces unpack to, which deflate makes a thousand times as much
    // at most.
    static Result<std::shared_ptr<const PtexFile>> open(const std::filesystem::path& path);

    struct Face {
        uint8_t log_width = 0, log_height = 0;  // texels along u and along v; 0, 0: it is the same everywhere
    };
    std::span<const Face> faces() const { return faces_; }
    StoredKind kind() const { return kind_; }
    uint32_t channels() const { return channels_; }  // that are read: 1, 3 or 4
    const std::filesystem::path& path() const { return file_.path(); }
    // All texels of a face, channels side by side, rows along u, the one at v = 0 first. Any number of threads may read at a time.
    Status read_face(uint32_t face, std::vector<std::byte>& texels) const;

private:
    struct Block {
        uint64_t at = 0;
        uint32_t bytes = 0, encoding = 0;
    };
    explicit PtexFile(InputFile file) : file_(std::move(file)) {}
    Status read_header();
    Status read_faces(uint64_t at, uint32_t packed_bytes);
    Status read_blocks(uint64_t at, uint64_t end, uint32_t header_bytes, uint64_t count, std::vector<Block>& blocks) const;
    Status unpack(uint64_t at, uint64_t packed_bytes, std::span<std::byte> content) const;
    Status read_block(const Block& block, const Face& size, bool may_be_tiled, std::vector<std::byte>& texels) const;
    Status read_tiles(const Block& block, const Face& size, std::vector<std::byte>& texels) const;
    // Of a run of texels as the file has them: those channels that are read.
    void keep_channels(const std::byte* planes, size_t count, bool planar, std::byte* out) const;
    Status bad(const std::string& what) const;

    InputFile file_;
    StoredKind kind_ = StoredKind::unsigned_8;
    uint32_t stored_channels_ = 0, channels_ = 0;
    std::vector<Face> faces_;
    std::vector<Block> blocks_;         // of each face
    std::vector<std::byte> constants_;  // of each face, all channels
};

}  // namespace raypager
