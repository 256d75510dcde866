// Where the blocks of a scene, and the pages of its images, come from while it is rendered: a file, today.
#pragma once

#include <cstddef>
#include <cstdint>
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
    // Gets the stored bytes of a block (exactly stored_bytes of them) and verifies the checksum; an error names the block and where it is kept.
    Status read_block(uint32_t block, std::span<std::byte> stored) const;
    // Checks that the bytes of a block hold together (section bounds, references, vertex indices), so that no kernel can read outside.
    Status check_block(uint32_t block, std::span<const std::byte> stored) const;

    // Gets the RP_TEXTURE_PAGE_BYTES of a page and verifies the checksum. Whatever texels there are make a picture: there is no more to check.
    Status read_page(uint32_t page, std::span<std::byte> bytes) const;

private:
    // pageable: a block, or behind these a page (BakedScene::is_page).
    virtual Status fetch(uint32_t pageable, std::span<std::byte> stored) const = 0;
    // The error that says so, with what to do about it.
    virtual Status damaged(uint32_t pageable, const std::string& what) const = 0;
};

}  // namespace raypager
