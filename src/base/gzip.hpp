// Files that are packed with gzip, read as if they were not: the content goes into a scratch file, for readers want any part of it at any time.
#pragma once

#include <cstdint>
#include <memory>

#include "base/files.hpp"

namespace raypager {

struct UnpackedFile {
    std::shared_ptr<const SpillFile> content;
    uint64_t size = 0;
};

// What tells one file from another, and from itself after a change.
struct FileIdentity {
    uint64_t device = 0, inode = 0, size = 0;
    int64_t seconds = 0, nanoseconds = 0;  // of the last change
    bool operator==(const FileIdentity&) const = default;
};

// Whether a file starts like one that gzip made.
bool looks_packed(const std::byte (&start)[3]);
// The content of packed, which has that identity: unpacked now, or by an earlier call. May be called from several threads. Members that were
// put one after another are read as one, as gzip does. The content lies in the folder for temporary files (TMPDIR), without a name.
Result<std::shared_ptr<const UnpackedFile>> unpacked_content(const InputFile& packed, const FileIdentity& identity);

}  // namespace raypager
