// Reads and writes block files (.rpb): src/store/FORMAT.md says byte for byte what they are.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "base/files.hpp"
#include "block/baked_scene.hpp"
#include "raypager/status.hpp"
#include "store/block_sink.hpp"
#include "store/block_source.hpp"

namespace raypager {

class BlockFileWriter final : public BlockSink {
public:
    static Result<BlockFileWriter> create(const std::filesystem::path& path);
    Status append(std::span<const std::byte> stored, BlockRecord& record) override;
    Status reserve_pages(uint32_t count) override;
    Status put_page(uint32_t page, std::span<const std::byte> bytes, PageRecord& record) override;
    // The file appears under its name only now.
    Status finish(const BakedScene& scene) override;

private:
    OutputFile file_;
    uint64_t pages_at_ = 0;
};

// An open block file.
class BlockFile : public BlockSource {
public:
    // Reads and checks everything but the blocks and pages: magic, version, sizes, checksums, and that indices and bounds make sense.
    // change: applied to what was read, once it has been checked.
    using Change = std::function<void(BakedScene&)>;
    static Result<std::shared_ptr<const BlockFile>> open(const std::filesystem::path& path, const Change& change = {});
    // The file that another process has opened, of which this one has the scene. It has no bytes where it is not there, or is another one.
    static std::shared_ptr<const BlockFile> of_origin(BakedScene scene, const Origin& origin);
    const BakedScene& scene() const override { return scene_; }
    const std::filesystem::path& path() const { return path_; }
    uint64_t file_bytes() const { return file_.size(); }
    bool has_bytes() const override { return file_.is_open(); }
    Origin origin() const override;

private:
    Status fetch(uint32_t pageable, std::span<std::byte> stored) const override;
    Status damaged(uint32_t pageable, const std::string& what) const override;
    uint64_t offset_of(uint32_t pageable) const;

    InputFile file_;
    std::filesystem::path path_;
    uint64_t checksum_ = 0;  // of the header
    BakedScene scene_;
};

}  // namespace raypager
