#include "blocks/distribute.hpp"

#include <algorithm>

#include "base/check.hpp"
#include "base/parallel.hpp"
#include "blocks/partition.hpp"

namespace raypager {
namespace {

// Smaller writes cost more than they carry; larger ones gain nothing.
constexpr size_t least_buffer = size_t{64} << 10, largest_buffer = size_t{4} << 20;
constexpr size_t most_buckets = 4096;
// The sample tells the weight of a part to a few percent; the rest is allowed for.
constexpr double fill = 0.85;

class Distributor {
public:
    Distributor(const Partition& partition, const std::shared_ptr<SpillFile>& file, size_t buffer_bytes) : partition_(partition) {
        for (size_t i = 0; i < partition.parts(); i++) writers_.emplace_back(file, buffer_bytes);
    }

    Status take(RecordKind kind, std::span<const std::byte> records) {
        const size_t each = record_bytes[kind], count = records.size() / each;
        parts_.resize(count);
        parallel_for(count, 4096, [&](size_t begin, size_t end) {
            for (size_t i = begin; i < end; i++) parts_[i] = partition_.part_of(make_ref(kind, &records[i * each]));
        });
        for (size_t i = 0; i < count; i++) RAYPAGER_TRY(writers_[parts_[i]].add_one(kind, &records[i * each]));
        return {};
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
    const Partition& partition_;
    std::vector<BucketWriter> writers_;
    std::vector<uint32_t> parts_;
};

template <class Record>
void add_triangle(World& world, const std::byte* bytes) {
    Record record;
    std::memcpy(&record, bytes, sizeof record);
    const auto base = static_cast<uint32_t>(world.positions.size());
    world.positions.insert(world.positions.end(), std::begin(record.vertices), std::end(record.vertices));
    if constexpr (std::is_same_v<Record, ShadedTriangleRecord>)
        world.normals.insert(world.normals.end(), std::begin(record.normals), std::end(record.normals));
    world.primitives.push_back({base, base + 1, base + 2});
    world.ids.push_back(record.id);
}

void add_sphere(World& world, const std::byte* bytes) {
    SphereRecord record;
    std::memcpy(&record, bytes, sizeof record);
    world.primitives.push_back({static_cast<uint32_t>(world.spheres.size()), RP_NONE, RP_NONE});
    world.spheres.push_back(record.sphere);
    world.ids.push_back(record.id);
}

}  // namespace

Result<std::vector<Bucket>> distribute(const Bucket& bucket, const DistributeSettings& settings) {
    const uint64_t all = bucket.primitives();
    RAYPAGER_CHECK(all >= 2);
    auto sample = sample_bucket(bucket, settings.memory.sample);
    if (!sample) return sample.status();
    const double limit = fill * static_cast<double>(settings.memory.bucket) * static_cast<double>(sample->size()) / static_cast<double>(all);
    size_t kinds = 0;
    for (const RecordList& list : bucket.lists) kinds += list.count > 0;
    const size_t most = std::min<uint64_t>(most_buckets, settings.memory.buffers / (kinds * least_buffer));
    const Partition partition(std::move(*sample), limit, most);

    auto file = SpillFile::create(settings.spill_beside);
    if (!file) return file.status();
    const size_t buffer = std::clamp<size_t>(settings.memory.buffers / (kinds * partition.parts()), least_buffer, largest_buffer);
    Distributor distributor(partition, *file, buffer);
    uint64_t done = 0;
    if (auto status = bucket.for_each_piece(largest_buffer, true,
                                            [&](RecordKind kind, std::span<const std::byte> records) -> Status {
                                                if (settings.stop && *settings.stop) return Status::failed("stopped by a signal");
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
    const uint64_t shaded = bucket.lists[shaded_records].count, triangles = bucket.lists[triangle_records].count + shaded;
    world.positions.reserve(3 * triangles);
    if (shaded) world.normals.reserve(3 * triangles);
    world.spheres.reserve(bucket.lists[sphere_records].count);
    world.primitives.reserve(bucket.primitives());
    world.ids.reserve(bucket.primitives());
    const auto status = bucket.for_each_piece(largest_buffer, true, [&](RecordKind kind, std::span<const std::byte> records) -> Status {
        if (kind != triangle_records && shaded) world.normals.resize(world.positions.size(), RP_NONE);
        for (size_t i = 0; i < records.size(); i += record_bytes[kind]) {
            if (kind == triangle_records) add_triangle<TriangleRecord>(world, &records[i]);
            if (kind == shaded_records) add_triangle<ShadedTriangleRecord>(world, &records[i]);
            if (kind == sphere_records) add_sphere(world, &records[i]);
        }
        return {};
    });
    if (!status.ok()) return status;
    return world;
}

}  // namespace raypager
