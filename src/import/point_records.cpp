#include <algorithm>

#include "import/point_readers.hpp"

namespace raypager {
namespace {

constexpr size_t record_bytes_at_once = size_t{1} << 20;

}  // namespace

RecordRange part_of(const RecordRange& range, uint64_t part, uint64_t parts, size_t most) {
    // count * part would overflow for hostile counts only, and those have been compared with the file's size.
    const uint64_t begin = range.count * part / parts, end = range.count * (part + 1) / parts;
    return {range.offset + begin * range.stride, std::min<uint64_t>(end - begin, most), range.stride};
}

Status read_records(const InputFile& file, const RecordRange& range, const std::function<Status(const std::byte*, size_t)>& take) {
    const uint64_t at_once = std::max<uint64_t>(1, record_bytes_at_once / range.stride);
    std::vector<std::byte> buffer(std::min(at_once, range.count) * range.stride);
    for (uint64_t i = 0; i < range.count; i += at_once) {
        const size_t count = static_cast<size_t>(std::min(at_once, range.count - i));
        RAYPAGER_TRY(file.read(range.offset + i * range.stride, std::span(buffer).first(count * range.stride)));
        RAYPAGER_TRY(take(buffer.data(), count));
    }
    return {};
}

}  // namespace raypager
