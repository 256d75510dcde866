#include "blocks/partition.hpp"

#include <algorithm>
#include <mutex>
#include <queue>

#include "base/check.hpp"
#include "base/jitter.hpp"
#include "base/parallel.hpp"

namespace raypager {
namespace {

uint64_t weight_of(std::span<const PrimitiveRef> refs) {
    uint64_t sum = 0;
    for (const PrimitiveRef& ref : refs) sum += ref.weight;
    return sum;
}

}  // namespace

Partition::Partition(std::vector<PrimitiveRef> sample, double limit, size_t most) {
    RAYPAGER_CHECK(sample.size() >= 2);
    struct Open {
        uint64_t weight;
        uint32_t node;
        std::span<PrimitiveRef> refs;
        bool operator<(const Open& other) const { return weight != other.weight ? weight < other.weight : node > other.node; }
    };
    std::priority_queue<Open> open;
    nodes_.emplace_back();
    open.push({weight_of(sample), 0, sample});
    for (size_t parts = 1; parts < std::max<size_t>(2, most) && !open.empty();) {
        const Open heaviest = open.top();
        open.pop();
        if (heaviest.refs.size() < 2) continue;
        if (parts >= 2 && static_cast<double>(heaviest.weight) <= limit) break;
        const CutPlane plane = CutPlane::choose(heaviest.refs);
        const auto middle = std::partition(heaviest.refs.begin(), heaviest.refs.end(), [&](const PrimitiveRef& ref) { return plane.is_left(ref); });
        const auto count = static_cast<size_t>(middle - heaviest.refs.begin());
        const auto left = static_cast<uint32_t>(nodes_.size());
        nodes_[heaviest.node].plane = plane;
        nodes_[heaviest.node].left = left;
        nodes_.resize(nodes_.size() + 2);
        for (const auto& [node, refs] : {std::pair(left, heaviest.refs.first(count)), std::pair(left + 1, heaviest.refs.subspan(count))})
            open.push({weight_of(refs), node, refs});
        parts++;
    }
    number(0);
}

void Partition::number(uint32_t node) {
    if (nodes_[node].left == 0) {
        nodes_[node].part = parts_++;
        return;
    }
    number(nodes_[node].left);
    number(nodes_[node].left + 1);
}

Result<std::vector<PrimitiveRef>> sample_bucket(const Bucket& bucket, uint64_t count) {
    const uint64_t all = bucket.primitives();
    count = std::min(count, all);
    std::vector<PrimitiveRef> sample(count);
    std::mutex mutex;
    Status failure;
    // The i-th of count equal stretches of the records gives one, from anywhere in it: a fixed place might follow the rows of a regular mesh.
    const auto take = [&](uint64_t i) -> Status {
        const uint64_t begin = static_cast<uint64_t>(static_cast<unsigned __int128>(all) * i / count);
        const uint64_t end = static_cast<uint64_t>(static_cast<unsigned __int128>(all) * (i + 1) / count);
        uint64_t place = begin + jitter(i, end - begin);
        uint32_t kind = 0;
        while (place >= bucket.lists[kind].count) place -= bucket.lists[kind++].count;
        std::byte record[sizeof(ShadedTriangleRecord)];
        RAYPAGER_TRY(bucket.read(static_cast<RecordKind>(kind), place, std::span(record, record_bytes[kind])));
        sample[i] = make_ref(static_cast<RecordKind>(kind), record);
        return {};
    };
    parallel_for(count, 1024, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; i++) {
            auto status = take(i);
            if (status.ok()) continue;
            const std::lock_guard lock(mutex);
            failure = std::move(status);
            return;
        }
    });
    if (!failure.ok()) return failure;
    return sample;
}

}  // namespace raypager
