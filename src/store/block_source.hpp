// Where the blocks of a scene, and the pages of its images, come from while it is rendered: a file, memory, or other processes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "block/baked_scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// All functions are thread-safe. What a source hands over is checked here, so that each is as safe as a file.
class BlockSource {
public:
    virtual ~BlockSource() = default;
    virtual const BakedScene& scene() const = 0;
    // Whether it can get any; if not, it is known from another process what the scene is, and that alone.
    virtual bool has_bytes() const { return true; }
    // Of host memory, that blocks take here.
    virtual uint64_t held_bytes() const { return 0; }
    // The file that they come from, and a checksum that says which one it is; an empty path: there is none.
    struct Origin {
        std::filesystem::path file;
        uint64_t checksum = 0;
    };
    virtual Origin origin() const { return {}; }
    // Of what is stored.
    uint64_t checksum_of(uint32_t pageable) const {
        return scene().is_page(pageable) ? scene().pages[pageable - scene().blocks.size()].checksum : scene().blocks[pageable].checksum;
    }
    // The stored bytes of a block, or behind these of a page, verified.
    Status read(uint32_t pageable, std::span<std::byte> stored) const;
    // Gets the stored bytes of a block (exactly stored_bytes of them) and verifies the checksum; an error names the block and where it is kept.
    Status read_block(uint32_t block, std::span<std::byte> stored) const;
    // Checks that the bytes of a block hold together (section bounds, references, vertex indices), so that no kernel can read outside.
    Status check_block(uint32_t block, std::span<const std::byte> stored) const;

    // Gets the RP_TEXTURE_PAGE_BYTES of a page and verifies the checksum. Whatever texels there are make a picture: there is no more to check.
    Status read_page(uint32_t page, std::span<std::byte> bytes) const;

private:
    // pageable: a block, or behind these a page (BakedScene::is_page).
    virtual Status fetch(uint32_t pageable, std::span<std::byte> stored) const = 0;
    // Whether that has compared them with the checksum already, as who gets them from elsewhere if they are wrong.
    virtual bool fetches_verified() const { return false; }
    // The error that says so, with what to do about it.
    virtual Status damaged(uint32_t pageable, const std::string& what) const = 0;
};

}  // namespace raypager
