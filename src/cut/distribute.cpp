#include "cut/distribute.hpp"

#include <algorithm>
#include <cstring>

#include "base/check.hpp"
#include "base/group_places.hpp"
#include "base/parallel.hpp"
#include "cut/partition.hpp"

namespace raypager {
namespace {

// Smaller writes cost more than they carry; larger ones gain nothing.
constexpr size_t min_bucket_buffer = size_t{64} << 10, largest_bucket_buffer = size_t{4} << 20;
constexpr size_t max_buckets = 4096;
// What is sorted at a time, of the memory there is, and within these bounds.
constexpr uint64_t share_at_once = 32, min_at_once = 256 << 10, max_at_once = 64 << 20;
// By a thread, while a bucket is loaded.
constexpr size_t read_at_once = 256 << 10;
// The sample tells the weight of a part to a few percent; the rest is allowed for.
constexpr double bucket_fill = 0.85;

// Puts records into the parts of a partition, in the order in which they come.
class Distributor {
public:
    Distributor(const Partition& partition, const std::shared_ptr<SpillFile>& file, size_t buffer_bytes) : partition_(partition) {
        for (size_t i = 0; i < partition.parts(); i++) writers_.emplace_back(file, buffer_bytes);
    }

    // Sorts them by part first, so that each part's are written as one. Clouds come in an order of places, so that most go to few parts: what is
    // large is written by all threads, one part after the other.
    Status take(RecordKind kind, std::span<const std::byte> records) {
        const size_t each = record_bytes[kind], parts = writers_.size();
        const GroupPlaces places(records.size() / each, parts, piece,
                                 [&](size_t i) { return partition_.part_of(make_ref(kind, &records[i * each])); });
        sorted_.resize(records.size());
        places.put_all([&](size_t i, uint32_t place) { std::memcpy(&sorted_[place * each], &records[i * each], each); });
        const auto of_part = [&](size_t part) {
            return std::span(sorted_).subspan(places.begin(part) * each, (places.begin(part + 1) - places.begin(part)) * each);
        };
        for (size_t part = 0; part < parts; part++)
            if (of_part(part).size() >= large) RAYPAGER_TRY(writers_[part].add(kind, of_part(part)));
        return parallel_try(parts, 1,
                            [&](size_t part, size_t) { return of_part(part).size() < large ? writers_[part].add(kind, of_part(part)) : Status(); });
    }

    Result<std::vector<Bucket>> finish() {
        std::vector<Bucket> buckets;
        for (BucketWriter& writer : writers_) {
            auto bucket = writer.finish();
            if (!bucket) return bucket.status();
            if (bucket->primitives() > 0) buckets.push_back(std::move(*bucket));
        }
        return buckets;
    }

private:
    static constexpr size_t piece = size_t{1} << 14, large = size_t{2} << 20;
    const Partition& partition_;
    std::vector<BucketWriter> writers_;
    UnwrittenVector<std::byte> sorted_;
};

template <class Record>
void place_triangle(World& world, const std::byte* bytes, size_t primitive) {
    Record record;
    std::memcpy(&record, bytes, sizeof record);
    const auto base = static_cast<uint32_t>(3 * primitive);
    std::copy_n(record.vertices, 3, &world.positions[base]);
    if constexpr (requires { record.normals; }) std::copy_n(record.normals, 3, &world.normals[base]);
    if constexpr (requires { record.colors; }) std::copy_n(record.colors, 3, &world.colors[base]);
    if constexpr (requires { record.uvs; }) std::copy_n(record.uvs, 3, &world.uvs[base]);
    world.primitives[primitive] = {base, base + 1, base + 2};
    world.ids[primitive] = record.id;
}

void place_sphere(World& world, const std::byte* bytes, size_t primitive, size_t sphere) {
    SphereRecord record;
    std::memcpy(&record, bytes, sizeof record);
    world.primitives[primitive] = World::sphere_entry(sphere);
    world.spheres[sphere] = record.sphere;
    world.ids[primitive] = record.id;
}

void place_instance_record(World& world, const std::byte* bytes, size_t instance) {
    std::memcpy(&world.instances[instance], bytes, sizeof(InstanceRecord));
    world.primitives[instance] = World::instance_entry(instance);
}

}  // namespace

Result<std::vector<Bucket>> distribute(const Bucket& bucket, const DistributeSettings& settings) {
    const uint64_t all = bucket.primitives();
    RAYPAGER_CHECK(all >= 2);
    auto sample = sample_bucket(bucket, settings.memory.sample);
    if (!sample) return sample.status();
    const double limit = bucket_fill * static_cast<double>(settings.memory.bucket) * static_cast<double>(sample->size()) / static_cast<double>(all);
    size_t kinds = 0;
    for (const RecordList& list : bucket.lists) kinds += list.count > 0;
    const size_t most = std::min<uint64_t>(max_buckets, settings.memory.buffers / (kinds * min_bucket_buffer));
    const Partition partition(std::move(*sample), limit, most);

    auto file = SpillFile::create(settings.spill_beside, SpillFile::for_all_threads);
    if (!file) return file.status();
    const size_t buffer = std::clamp<size_t>(settings.memory.buffers / (kinds * partition.parts()), min_bucket_buffer, largest_bucket_buffer);
    Distributor distributor(partition, *file, buffer);
    const size_t at_once = std::clamp(settings.memory.limit / share_at_once, min_at_once, max_at_once);
    uint64_t done = 0;
    if (auto status = bucket.for_each_piece(at_once, true,
                                            [&](RecordKind kind, std::span<const std::byte> records) -> Status {
                                                if (settings.stop && *settings.stop)
                                                    return Status::interrupted("stopped by a signal; nothing was written");
                                                RAYPAGER_TRY(distributor.take(kind, records));
                                                done += records.size() / record_bytes[kind];
                                                settings.progress(static_cast<double>(done) / static_cast<double>(all));
                                                return {};
                                            });
        !status.ok())
        return status;
    return distributor.finish();
}

Result<World> load_bucket(const Bucket& bucket) {
    World world;
    const uint64_t textured = bucket.lists[textured_records].count, colored = bucket.lists[colored_records].count + textured;
    const uint64_t shaded = bucket.lists[shaded_records].count + colored;
    const uint64_t triangles = bucket.lists[triangle_records].count + shaded;
    RAYPAGER_CHECK(3 * triangles < RP_NONE);
    world.positions.resize(3 * triangles);
    if (shaded) world.normals.resize(3 * triangles, RP_NONE);
    if (colored) world.colors.resize(3 * triangles, RP_NONE);
    world.uvs.resize(3 * textured);
    world.spheres.resize(bucket.lists[sphere_records].count);
    const uint64_t instances = bucket.lists[instance_records].count;
    RAYPAGER_CHECK(instances == 0 || instances == bucket.primitives());
    resize_huge(world.primitives, bucket.primitives());
    resize_huge(world.ids, bucket.primitives() - instances);  // instances have their numbers
    resize_huge(world.instances, instances);
    static_assert(textured_records == 0);
    uint64_t before = 0;  // primitives of other kinds
    for (uint32_t k = 0; k < record_kinds; k++) {
        const auto kind = static_cast<RecordKind>(k);
        RAYPAGER_TRY(bucket.for_each_in_parallel(kind, read_at_once, [&](uint64_t first, std::span<const std::byte> records) {
            for (uint64_t i = 0; i * record_bytes[kind] < records.size(); i++) {
                const std::byte* const record = &records[i * record_bytes[kind]];
                if (kind == triangle_records) place_triangle<TriangleRecord>(world, record, before + first + i);
                if (kind == shaded_records) place_triangle<ShadedTriangleRecord>(world, record, before + first + i);
                if (kind == colored_records) place_triangle<ColoredTriangleRecord>(world, record, before + first + i);
                if (kind == textured_records) place_triangle<TexturedTriangleRecord>(world, record, before + first + i);
                if (kind == sphere_records) place_sphere(world, record, before + first + i, first + i);
                if (kind == instance_records) place_instance_record(world, record, first + i);
            }
        }));
        before += bucket.lists[kind].count;
    }
    return world;
}

}  // namespace raypager
