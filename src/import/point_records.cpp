#include <algorithm>

#include "import/point_readers.hpp"

namespace raypager {
namespace {

constexpr size_t record_bytes_at_once = size_t{1} << 20;

// Calls take(first byte, number of records) for all records, some thousand at a time.
template <class Take>
Status read_records(const InputFile& file, const RecordRange& range, const Take& take) {
    const uint64_t at_once = std::max<uint64_t>(1, record_bytes_at_once / range.stride);
    std::vector<std::byte> buffer(std::min(at_once, range.count) * range.stride);
    for (uint64_t i = 0; i < range.count; i += at_once) {
        const size_t count = static_cast<size_t>(std::min(at_once, range.count - i));
        RAYPAGER_TRY(file.read(range.offset + i * range.stride, std::span(buffer).first(count * range.stride)));
        RAYPAGER_TRY(take(buffer.data(), count));
    }
    return {};
}

}  // namespace

Status RecordReader::read(const InputFile& file, const Take& take) const {
    std::vector<FilePoint> points;
    return read_records(file, records_, [&](const std::byte* record, size_t count) {
        points.clear();
        decode(record, count, points);
        return take(points);
    });
}

void RecordReader::sample(const InputFile& file, uint64_t part, uint64_t parts, size_t most, std::vector<FilePoint>& points) const {
    // count * part would overflow for hostile counts only, and those have been compared with the file's size.
    const uint64_t begin = records_.count * part / parts, end = records_.count * (part + 1) / parts;
    const Status unread = read_records(file, records_.part(begin, std::min<uint64_t>(end - begin, most)), [&](const std::byte* record, size_t count) {
        decode(record, count, points);
        return Status();
    });
    (void)unread;  // read() will meet it again
}

}  // namespace raypager
