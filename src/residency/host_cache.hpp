// Stored blocks in host memory, up to a limit, in front of the block file. The least recently used goes out. Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "raypager/status.hpp"
#include "store/block_file.hpp"

namespace raypager {

class HostCache {
public:
    HostCache(const BlockFile& file, uint64_t limit_bytes) : file_(file), limit_(limit_bytes) {}
    // Copies the stored bytes of a block into target (stored_bytes long): from the cache, or from the file, checksum verified.
    Status fetch(uint32_t block, std::span<std::byte> target);
    uint64_t peak_bytes() const { return peak_; }
    uint64_t limit_bytes() const { return limit_; }

private:
    using Bytes = std::shared_ptr<const std::vector<std::byte>>;
    void keep(uint32_t block, Bytes bytes);
    struct Entry {
        Bytes bytes;
        std::list<uint32_t>::iterator age;
    };
    const BlockFile& file_;
    const uint64_t limit_;
    std::mutex mutex_;
    std::unordered_map<uint32_t, Entry> entries_;
    std::list<uint32_t> by_age_;  // least recently used first
    uint64_t bytes_ = 0, peak_ = 0;
};

}  // namespace raypager
