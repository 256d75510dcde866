#include "world/records.hpp"

#include <algorithm>
#include <mutex>

#include "base/check.hpp"
#include "base/parallel.hpp"

namespace raypager {
namespace {

constexpr size_t moved_at_once = size_t{1} << 20;

template <class Record>
Record load(const std::byte* bytes) {
    Record record;
    std::memcpy(&record, bytes, sizeof record);
    return record;
}

template <class Record>
PrimitiveRef triangle_ref(const std::byte* bytes) {
    const auto record = load<Record>(bytes);
    PrimitiveRef ref = {{}, record.id, 0};
    for (const Float3& v : record.vertices) ref.box.grow(v);
    return ref;
}

// Large reads and writes are done by all threads: the system's part of them is mostly copying.
Status write_together(SpillFile& file, uint64_t offset, std::span<const std::byte> bytes) {
    return parallel_try(bytes.size(), moved_at_once,
                        [&](size_t begin, size_t end) { return file.write(offset + begin, bytes.subspan(begin, end - begin)); });
}

Status read_together(const SpillFile& file, uint64_t offset, std::span<std::byte> bytes) {
    return parallel_try(bytes.size(), moved_at_once,
                        [&](size_t begin, size_t end) { return file.read(offset + begin, bytes.subspan(begin, end - begin)); });
}

}  // namespace

PrimitiveRef make_ref(RecordKind kind, const std::byte* record) {
    PrimitiveRef ref;
    if (kind == sphere_records) {
        const auto sphere = load<SphereRecord>(record);
        ref = {sphere_bounds(sphere.sphere), sphere.id, 0};
    } else if (kind == instance_records) {
        const auto instance = load<InstanceRecord>(record);
        ref = {instance.box, instance.number, 0};
    } else {
        // What all kinds of triangles begin with is all that is needed.
        ref = triangle_ref<TriangleRecord>(record);
    }
    ref.weight = static_cast<uint32_t>(record_memory[kind]);
    return ref;
}

Box bounds_of(std::span<const SphereRecord> spheres) {
    constexpr size_t piece = size_t{1} << 15;
    Box all;
    std::mutex mutex;
    parallel_for(spheres.size(), piece, [&](size_t begin, size_t end) {
        Box bounds;
        for (const SphereRecord& record : spheres.subspan(begin, end - begin)) bounds.grow(sphere_bounds(record.sphere));
        const std::lock_guard lock(mutex);
        all.grow(bounds);
    });
    return all;
}

uint64_t Bucket::primitives() const {
    uint64_t sum = 0;
    for (const RecordList& list : lists) sum += list.count;
    return sum;
}

uint64_t Bucket::memory_bytes() const {
    uint64_t sum = 0;
    for (uint32_t kind = 0; kind < record_kinds; kind++) sum += lists[kind].count * record_memory[kind];
    return sum;
}

Status Bucket::read(RecordKind kind, uint64_t first, std::span<std::byte> records) const {
    const RecordList& list = lists[kind];
    const size_t bytes = record_bytes[kind];
    RAYPAGER_CHECK(records.size() % bytes == 0 && first + records.size() / bytes <= list.count);
    while (!records.empty()) {
        const uint64_t each = list.extents.front().records, within = first % each;
        const auto part = records.first(std::min<uint64_t>(records.size(), (each - within) * bytes));
        RAYPAGER_TRY(file->read(list.extents[first / each].offset + within * bytes, part));
        first += part.size() / bytes;
        records = records.subspan(part.size());
    }
    return {};
}

void Bucket::discard(RecordKind kind, uint64_t first, uint64_t count) const {
    const RecordList& list = lists[kind];
    RAYPAGER_CHECK(first + count <= list.count);
    while (count > 0) {
        const uint64_t each = list.extents.front().records, within = first % each, part = std::min(count, each - within);
        file->discard(list.extents[first / each].offset + within * record_bytes[kind], part * record_bytes[kind]);
        first += part;
        count -= part;
    }
}

Status Bucket::for_each_piece(size_t piece, bool discard, const std::function<Status(RecordKind, std::span<const std::byte>)>& take) const {
    std::vector<std::byte> buffer;
    for (uint32_t k = 0; k < record_kinds; k++) {
        const auto kind = static_cast<RecordKind>(k);
        const uint64_t most = std::max<uint64_t>(1, piece / record_bytes[kind]);
        for (const RecordList::Extent& extent : lists[kind].extents) {
            for (uint64_t first = 0; first < extent.records; first += most) {
                buffer.resize(std::min(most, extent.records - first) * record_bytes[kind]);
                RAYPAGER_TRY(read_together(*file, extent.offset + first * record_bytes[kind], buffer));
                RAYPAGER_TRY(take(kind, buffer));
            }
            if (discard) file->discard(extent.offset, extent.records * record_bytes[kind]);
        }
    }
    return {};
}

Status Bucket::for_each_in_parallel(RecordKind kind, size_t piece, const std::function<void(uint64_t, std::span<const std::byte>)>& take) const {
    const auto& extents = lists[kind].extents;
    const size_t bytes = record_bytes[kind];
    const uint64_t most = std::max<uint64_t>(1, piece / bytes);
    return parallel_try(extents.size(), 1, [&](size_t e, size_t) -> Status {
        const RecordList::Extent& extent = extents[e];
        std::vector<std::byte> buffer;
        for (uint64_t first = 0; first < extent.records; first += most) {
            buffer.resize(std::min(most, extent.records - first) * bytes);
            RAYPAGER_TRY(file->read(extent.offset + first * bytes, buffer));
            take(e * extents.front().records + first, buffer);
        }
        file->discard(extent.offset, extent.records * bytes);
        return {};
    });
}

BucketWriter::BucketWriter(std::shared_ptr<SpillFile> file, size_t buffer_bytes) : buffer_bytes_(buffer_bytes) { bucket_.file = std::move(file); }

Status BucketWriter::add(RecordKind kind, std::span<const std::byte> records) {
    RAYPAGER_CHECK(records.size() % record_bytes[kind] == 0);
    auto& buffer = buffers_[kind];
    while (!records.empty()) {
        if (buffer.size() == room_[kind]) RAYPAGER_TRY(make_room(kind));
        if (const size_t whole = records.size() / room_[kind] * room_[kind]; buffer.empty() && whole > 0) {
            RAYPAGER_TRY(write(kind, records.first(whole)));
            records = records.subspan(whole);
            continue;
        }
        const auto part = records.first(std::min(room_[kind] - buffer.size(), records.size()));
        buffer.insert(buffer.end(), part.begin(), part.end());
        records = records.subspan(part.size());
    }
    return {};
}

Status BucketWriter::make_room(RecordKind kind) {
    if (!buffers_[kind].empty()) return flush(kind);
    room_[kind] = std::max<size_t>(1, buffer_bytes_ / record_bytes[kind]) * record_bytes[kind];
    buffers_[kind].reserve(room_[kind]);
    return {};
}

Status BucketWriter::flush(RecordKind kind) {
    RAYPAGER_TRY(write(kind, buffers_[kind]));
    buffers_[kind].clear();
    return {};
}

Status BucketWriter::write(RecordKind kind, std::span<const std::byte> records) {
    uint64_t offset = bucket_.file->reserve(records.size());
    RAYPAGER_TRY(write_together(*bucket_.file, offset, records));
    bucket_.lists[kind].count += records.size() / record_bytes[kind];
    while (!records.empty()) {
        const auto extent = records.first(std::min(records.size(), room_[kind]));
        bucket_.lists[kind].extents.push_back({offset, extent.size() / record_bytes[kind]});
        offset += extent.size();
        records = records.subspan(extent.size());
    }
    return {};
}

Result<Bucket> BucketWriter::finish() {
    for (uint32_t kind = 0; kind < record_kinds; kind++) {
        if (auto status = flush(static_cast<RecordKind>(kind)); !status.ok()) return status;
        std::vector<std::byte>().swap(buffers_[kind]);
    }
    return std::move(bucket_);
}

}  // namespace raypager
