#include "clouds/point_sort.hpp"

#include <algorithm>

#include "base/parallel.hpp"

namespace raypager {
namespace {

// What sorting a point takes: its record twice, its key with its place.
constexpr uint64_t sorting_bytes = 2 * sizeof(PointRecord) + sizeof(PointKey) + 8;
constexpr double range_fill = 0.8;  // of its memory: the sample tells its size to some percent
constexpr size_t min_range_buffer = size_t{64} << 10, largest_range_buffer = size_t{1} << 20;
constexpr uint64_t max_ranges = 4096;

}  // namespace

Result<uint64_t> SortedPoints::key(uint64_t place) const {
    PointRecord record;
    if (auto status = read(place, std::span(&record, 1)); !status.ok()) return status;
    return morton_key(grid, record.point.position);
}

Result<PointSorter> PointSorter::create(const PointGrid& grid, uint64_t count, std::vector<PointKey> sample, const BakeMemory& memory,
                                        const std::filesystem::path& spill_beside) {
    PointSorter sorter;
    sorter.grid_ = grid;
    sorter.spill_beside_ = spill_beside;
    sorter.at_once_ = worker_count();
    const double points_a_range = 0.5 * range_fill * static_cast<double>(memory.limit) / static_cast<double>(sorting_bytes * sorter.at_once_);
    const uint64_t most = std::clamp<uint64_t>(memory.buffers / min_range_buffer, 1, max_ranges);
    const uint64_t ranges = std::clamp<uint64_t>(static_cast<uint64_t>(static_cast<double>(count) / points_a_range) + 1, 1, most);
    std::sort(sample.begin(), sample.end());
    for (uint64_t r = 1; r < ranges && !sample.empty(); r++) sorter.boundaries_.push_back(sample[sample.size() * r / ranges]);
    auto file = SpillFile::create(spill_beside);
    if (!file) return file.status();
    sorter.buffer_bytes_ = std::clamp<size_t>(memory.buffers / (sorter.boundaries_.size() + 1), min_range_buffer, largest_range_buffer);
    for (size_t r = 0; r <= sorter.boundaries_.size(); r++) sorter.writers_.emplace_back(*file, sorter.buffer_bytes_);
    return sorter;
}

Status PointSorter::add(std::span<const PointRecord> records) {
    ranges_.resize(records.size());
    parallel_for(records.size(), 4096, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            const PointKey key = {morton_key(grid_, records[i].point.position), records[i].index};
            ranges_[i] = static_cast<uint32_t>(std::upper_bound(boundaries_.begin(), boundaries_.end(), key) - boundaries_.begin());
        }
    });
    for (size_t i = 0; i < records.size(); i++)
        RAYPAGER_TRY(writers_[ranges_[i]].add_one(point_records, reinterpret_cast<const std::byte*>(&records[i])));
    return {};
}

Status PointSorter::sort_range(const Bucket& range, std::vector<PointRecord>& records) const {
    std::vector<PointRecord> unsorted;
    unsorted.reserve(range.lists[point_records].count);
    RAYPAGER_TRY(range.for_each_piece(largest_range_buffer, true, [&](RecordKind, std::span<const std::byte> bytes) {
        const size_t begin = unsorted.size();
        unsorted.resize(begin + bytes.size() / sizeof(PointRecord));
        std::memcpy(&unsorted[begin], bytes.data(), bytes.size());
        return Status();
    }));
    struct Place {
        PointKey key;
        uint32_t place;
    };
    std::vector<Place> places(unsorted.size());
    for (size_t i = 0; i < unsorted.size(); i++)
        places[i] = {{morton_key(grid_, unsorted[i].point.position), unsorted[i].index}, static_cast<uint32_t>(i)};
    std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.key < b.key; });
    records.clear();
    records.reserve(unsorted.size());
    for (const Place& place : places) records.push_back(unsorted[place.place]);
    return {};
}

Result<SortedPoints> PointSorter::sort(const std::atomic<bool>* stop, const std::function<void(double fraction)>& progress) {
    std::vector<Bucket> ranges;
    for (BucketWriter& writer : writers_) {
        auto range = writer.finish();
        if (!range) return range.status();
        ranges.push_back(std::move(*range));
    }
    writers_.clear();
    auto file = SpillFile::create(spill_beside_);
    if (!file) return file.status();
    BucketWriter sorted(std::move(*file), largest_range_buffer);
    std::vector<std::vector<PointRecord>> records(at_once_);
    for (size_t first = 0; first < ranges.size(); first += at_once_) {
        if (stop && *stop) return Status::interrupted("stopped by a signal; nothing was written");
        const size_t count = std::min(at_once_, ranges.size() - first);
        if (auto status = parallel_try(count, 1, [&](size_t i, size_t) { return sort_range(ranges[first + i], records[i]); }); !status.ok())
            return status;
        for (size_t i = 0; i < count; i++)
            if (auto status = sorted.add(point_records, std::as_bytes(std::span(records[i]))); !status.ok()) return status;
        progress(static_cast<double>(first + count) / static_cast<double>(ranges.size()));
    }
    auto bucket = sorted.finish();
    if (!bucket) return bucket.status();
    return SortedPoints{grid_, std::move(*bucket)};
}

}  // namespace raypager
