// Primitives on their way over the disk, when a scene is baked that does not fit into memory: records of fixed size, in world space.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "base/files.hpp"
#include "world/world.hpp"

namespace raypager {

struct TriangleRecord {
    Float3 vertices[3];  // counter-clockwise seen from the side of the normal
    uint32_t id;         // in the scene
};
struct ShadedTriangleRecord {
    Float3 vertices[3];
    uint32_t id;
    uint32_t normals[3];  // octahedral; RP_NONE: none
};
struct ColoredTriangleRecord {
    Float3 vertices[3];
    uint32_t id;
    uint32_t normals[3];
    uint32_t colors[3];  // as in VertexBits
};
struct TexturedTriangleRecord {
    Float3 vertices[3];
    uint32_t id;
    uint32_t normals[3], colors[3];
    Float2 uvs[3];
};
struct SphereRecord {
    WorldSphere sphere;
    uint32_t id;
};

// A point of a cloud that has no radius yet (cloud_stream.hpp).
struct PointRecord {
    CloudPoint point;
    uint32_t index;  // in the order of the source, among those that were placed
};

// Of instances there are buckets of their own.
using InstanceRecord = WorldInstance;

// In the order in which load_bucket puts them into a world: so those that have no coordinates of textures need no room for any.
enum RecordKind : uint32_t {
    textured_records,
    triangle_records,
    shaded_records,
    colored_records,
    sphere_records,
    point_records,
    instance_records,
    record_kinds
};
inline constexpr size_t record_bytes[record_kinds] = {sizeof(TexturedTriangleRecord), sizeof(TriangleRecord), sizeof(ShadedTriangleRecord),
                                                      sizeof(ColoredTriangleRecord),  sizeof(SphereRecord),   sizeof(PointRecord),
                                                      sizeof(InstanceRecord)};
static_assert(sizeof(TriangleRecord) == 40 && sizeof(ShadedTriangleRecord) == 52 && sizeof(ColoredTriangleRecord) == 64 &&
              sizeof(TexturedTriangleRecord) == 88 && sizeof(SphereRecord) == 24 && sizeof(PointRecord) == 24 && sizeof(InstanceRecord) == 92);
using AnyRecord = std::array<std::byte, *std::max_element(record_bytes, record_bytes + record_kinds)>;  // room for one of any kind

// What a primitive takes in memory while its bucket is built: its place in World, and what the cut needs.
inline constexpr uint64_t record_memory[record_kinds] = {3 * 28 + 12 + 4 + cut_memory,
                                                         3 * 12 + 12 + 4 + cut_memory,
                                                         3 * 16 + 12 + 4 + cut_memory,
                                                         3 * 20 + 12 + 4 + cut_memory,
                                                         sizeof(WorldSphere) + 12 + 4 + cut_memory,
                                                         0,
                                                         instance_memory};

// The reference of a primitive's record for the cut; its weight is what it takes in memory.
PrimitiveRef make_ref(RecordKind kind, const std::byte* record);

// Of all of them; by all threads.
Box bounds_of(std::span<const SphereRecord> spheres);

// Records of one kind, in extents of a spill file that all have the same size but the last one.
struct RecordList {
    struct Extent {
        uint64_t offset;
        uint64_t records;
    };
    std::vector<Extent> extents;
    uint64_t count = 0;
};

// A set of primitives on disk.
struct Bucket {
    std::shared_ptr<SpillFile> file;
    std::array<RecordList, record_kinds> lists;

    uint64_t primitives() const;
    uint64_t memory_bytes() const;
    // Any records, by the number of the first within its list.
    Status read(RecordKind kind, uint64_t first, std::span<std::byte> records) const;
    // Gives back the space on disk of records that nobody will read again.
    void discard(RecordKind kind, uint64_t first, uint64_t count) const;
    // Calls take(kind, records) for pieces of at most `piece` bytes, each a whole number of records, in order of kind and number. With
    // discard, the space on disk is given back as it is read.
    Status for_each_piece(size_t piece, bool discard, const std::function<Status(RecordKind, std::span<const std::byte>)>& take) const;
    // Calls take(number of the first, records) for pieces of at most `piece` bytes of one kind, by all threads at once, in
    // any order; gives back their space.
    Status for_each_in_parallel(RecordKind kind, size_t piece, const std::function<void(uint64_t, std::span<const std::byte>)>& take) const;
};

// Fills a bucket.
class BucketWriter {
public:
    // buffer_bytes: held in memory a kind of records that comes, at most.
    BucketWriter(std::shared_ptr<SpillFile> file, size_t buffer_bytes);
    // records: a whole number of them.
    Status add(RecordKind kind, std::span<const std::byte> records);
    Status add_one(RecordKind kind, const std::byte* record) {
        if (buffers_[kind].size() == room_[kind]) RAYPAGER_TRY(make_room(kind));
        buffers_[kind].insert(buffers_[kind].end(), record, record + record_bytes[kind]);
        return {};
    }
    Result<Bucket> finish();

private:
    Status make_room(RecordKind kind);
    // A whole number of full buffers, or what is the last of all.
    Status write(RecordKind kind, std::span<const std::byte> records);
    Status flush(RecordKind kind);
    Bucket bucket_;
    std::array<std::vector<std::byte>, record_kinds> buffers_;
    std::array<size_t, record_kinds> room_ = {};  // bytes at which a buffer is full; 0 before the first record
    const size_t buffer_bytes_;
};

}  // namespace raypager
