// Buffers that one thread after another uses: new memory would cost more than what is done with it.
#pragma once

#include <mutex>
#include <utility>
#include <vector>

namespace raypager {

template <class Buffer>
class ReusedMemory {
public:
    // With whatever was in it, or a new one.
    Buffer take() {
        const std::lock_guard lock(mutex_);
        if (free_.empty()) return {};
        Buffer buffer = std::move(free_.back());
        free_.pop_back();
        return buffer;
    }
    void give(Buffer&& buffer) {
        const std::lock_guard lock(mutex_);
        free_.push_back(std::move(buffer));
    }

private:
    std::mutex mutex_;
    std::vector<Buffer> free_;
};

}  // namespace raypager
