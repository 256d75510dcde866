#include "clouds/point_sort.hpp"

#include <algorithm>
#include <mutex>

#include "base/group_places.hpp"
#include "base/parallel.hpp"

namespace raypager {
namespace {

// What sorting a point takes: its record, its key with its place, and a share of what is read and written at a time.
constexpr uint64_t sorting_bytes = 2 * sizeof(PointRecord) + sizeof(PointKey) + 8;
constexpr size_t written_at_once = size_t{64} << 10;
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
    auto file = SpillFile::create(spill_beside, SpillFile::for_all_threads);
    if (!file) return file.status();
    sorter.buffer_bytes_ = std::clamp<size_t>(memory.buffers / (sorter.boundaries_.size() + 1), min_range_buffer, largest_range_buffer);
    for (size_t r = 0; r <= sorter.boundaries_.size(); r++) sorter.writers_.emplace_back(*file, sorter.buffer_bytes_);
    return sorter;
}

Status PointSorter::add(std::span<const CloudPoint> points, uint32_t first) {
    constexpr size_t piece = 4096;
    const auto index_of = [first](size_t i) { return first + static_cast<uint32_t>(i); };
    const GroupPlaces places(points.size(), writers_.size(), piece, [&](size_t i) {
        const PointKey key = {morton_key(grid_, points[i].position), index_of(i)};
        return static_cast<size_t>(std::upper_bound(boundaries_.begin(), boundaries_.end(), key) - boundaries_.begin());
    });
    records_.resize(points.size());
    places.put_all([&](size_t i, uint32_t place) { records_[place] = {points[i], index_of(i)}; });
    const size_t ranges_at_once = writers_.size() / (4 * worker_count()) + 1;
    return parallel_try(writers_.size(), ranges_at_once, [&](size_t begin, size_t end) -> Status {
        for (size_t range = begin; range < end; range++) {
            const auto records = std::span(records_).subspan(places.begin(range), places.begin(range + 1) - places.begin(range));
            RAYPAGER_TRY(writers_[range].add(point_records, std::as_bytes(records)));
        }
        return {};
    });
}

Status PointSorter::sort_range(const Bucket& range, SpillFile& file, uint64_t offset) const {
    UnwrittenVector<PointRecord> unsorted;
    unsorted.reserve(range.lists[point_records].count);
    RAYPAGER_TRY(range.for_each_piece(min_range_buffer, true, [&](RecordKind, std::span<const std::byte> bytes) {
        const size_t begin = unsorted.size();
        unsorted.resize(begin + bytes.size() / sizeof(PointRecord));
        std::memcpy(&unsorted[begin], bytes.data(), bytes.size());
        return Status();
    }));
    struct Place {
        PointKey key;
        uint32_t place;
    };
    UnwrittenVector<Place> places(unsorted.size());
    for (size_t i = 0; i < unsorted.size(); i++)
        places[i] = {{morton_key(grid_, unsorted[i].point.position), unsorted[i].index}, static_cast<uint32_t>(i)};
    std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.key < b.key; });
    std::vector<PointRecord> sorted;
    constexpr size_t at_once = written_at_once / sizeof(PointRecord);
    for (size_t first = 0; first < places.size(); first += at_once) {
        sorted.clear();
        for (const Place& place : std::span(places).subspan(first, std::min(at_once, places.size() - first))) sorted.push_back(unsorted[place.place]);
        RAYPAGER_TRY(file.write(offset + first * sizeof(PointRecord), std::as_bytes(std::span(sorted))));
    }
    return {};
}

Result<SortedPoints> PointSorter::sort(const std::atomic<bool>* stop, const std::function<void(double fraction)>& progress) {
    UnwrittenVector<PointRecord>().swap(records_);
    std::vector<Bucket> ranges;
    std::vector<uint64_t> begins;
    uint64_t count = 0;
    for (BucketWriter& writer : writers_) {
        auto range = writer.finish();
        if (!range) return range.status();
        begins.push_back(count);
        count += range->lists[point_records].count;
        ranges.push_back(std::move(*range));
    }
    writers_.clear();
    auto file = SpillFile::create(spill_beside_, SpillFile::for_all_threads);
    if (!file) return file.status();
    const uint64_t offset = (*file)->reserve(count * sizeof(PointRecord));
    std::mutex mutex;
    size_t done = 0;
    const auto sort_one = [&](size_t r, size_t) -> Status {
        if (stop && *stop) return Status::interrupted("stopped by a signal; nothing was written");
        RAYPAGER_TRY(sort_range(ranges[r], **file, offset + begins[r] * sizeof(PointRecord)));
        const std::lock_guard lock(mutex);
        progress(static_cast<double>(++done) / static_cast<double>(ranges.size()));
        return {};
    };
    RAYPAGER_TRY(parallel_try(ranges.size(), 1, sort_one, at_once_));
    SortedPoints points{grid_, {*file, {}}};
    points.bucket.lists[point_records] = {{{offset, count}}, count};
    return points;
}

}  // namespace raypager
