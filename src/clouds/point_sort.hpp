// The points of a cloud in Morton order where they do not fit into memory: sorted on disk, in ranges that do.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include "clouds/point_order.hpp"
#include "world/bake_memory.hpp"
#include "world/records.hpp"

namespace raypager {

struct SortedPoints {
    PointGrid grid;
    Bucket bucket;  // of point_records, in order

    uint64_t size() const { return bucket.lists[point_records].count; }
    Status read(uint64_t first, std::span<PointRecord> records) const { return bucket.read(point_records, first, std::as_writable_bytes(records)); }
    void discard(uint64_t begin, uint64_t end) const { bucket.discard(point_records, begin, end - begin); }
    Result<uint64_t> key(uint64_t place) const;
};

class PointSorter {
public:
    // count: of the points that will come; sample: keys of some of them, spread evenly.
    static Result<PointSorter> create(const PointGrid& grid, uint64_t count, std::vector<PointKey> sample, const BakeMemory& memory,
                                      const std::filesystem::path& spill_beside);
    // Some points, by all threads. first: the index of the first of them.
    Status add(std::span<const CloudPoint> points, uint32_t first);
    // After all have come. The space of what was added is given back.
    Result<SortedPoints> sort(const std::atomic<bool>* stop, const std::function<void(double fraction)>& progress);

private:
    PointSorter() = default;
    // Reads a range, and writes it sorted.
    Status sort_range(const Bucket& range, SpillFile& file, uint64_t offset) const;

    PointGrid grid_;
    std::filesystem::path spill_beside_;
    size_t at_once_ = 1, buffer_bytes_ = 0;
    std::vector<PointKey> boundaries_;  // the first of each range but the first
    std::vector<BucketWriter> writers_;
    UnwrittenVector<PointRecord> records_;  // of the points at hand, by range
};

}  // namespace raypager
