#include "residency/demand_trace.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>

#include "base/files.hpp"
#include "base/hash.hpp"
#include "raypager/abi/types.h"

namespace raypager {
namespace {

constexpr char magic[8] = {'R', 'P', 'D', 'E', 'M', 'A', 'N', 'D'};
constexpr uint32_t format_version = 3;
constexpr uint64_t largest_file = uint64_t{16} << 30;
constexpr uint32_t longest_name = 4096;

// The fixed part of the file (TRACE.md).
struct Header {
    char magic[8];
    uint32_t version, header_bytes;
    uint64_t file_bytes, checksum;  // the checksum of everything behind it
    uint64_t path_count, ray_count, visit_count;
    uint32_t block_count, name_bytes;
    // of the recorded render
    uint16_t policy, evict_ahead;
    uint32_t loads_in_flight, loads_into_free, max_age, loads_while_idle;
    float traffic_kept;
    double hold_above_ready;
    uint64_t pool_bytes, slab_bytes;
    uint32_t slots, wait_for_loads, cpu_cores, rounds_under_way;
    uint64_t paths, rays, loads, bytes_loaded, rounds;
    double seconds, trace_seconds;
    uint64_t scene_identity;
};
static_assert(sizeof(Header) == 192);
constexpr size_t checksum_from = offsetof(Header, path_count);

class Packer {
public:
    void number(uint64_t value) {
        for (; value >= 128; value >>= 7) bytes_.push_back(static_cast<char>(value | 128));
        bytes_.push_back(static_cast<char>(value));
    }
    // Small whatever the sign.
    void difference(int64_t value) { number(static_cast<uint64_t>(value) << 1 ^ static_cast<uint64_t>(value >> 63)); }
    void raw(const void* data, size_t size) { bytes_.append(static_cast<const char*>(data), size); }
    std::string take() { return std::move(bytes_); }

private:
    std::string bytes_;
};

class Unpacker {
public:
    explicit Unpacker(std::string_view bytes) : bytes_(bytes) {}
    // False at the end of the bytes, or if a number has more than 64 bits.
    bool number(uint64_t& value) {
        value = 0;
        for (unsigned shift = 0; shift < 64 && at_ < bytes_.size(); shift += 7) {
            const auto byte = static_cast<unsigned char>(bytes_[at_++]);
            value |= static_cast<uint64_t>(byte & 127) << shift;
            if (!(byte & 128)) return true;
        }
        return false;
    }
    bool difference(int64_t& value) {
        uint64_t folded = 0;
        if (!number(folded)) return false;
        value = static_cast<int64_t>(folded >> 1 ^ (~(folded & 1) + 1));
        return true;
    }
    bool raw(void* data, size_t size) {
        if (size > bytes_.size() - at_) return false;
        std::memcpy(data, bytes_.data() + at_, size);
        at_ += size;
        return true;
    }
    size_t position() const { return at_; }
    size_t left() const { return bytes_.size() - at_; }

private:
    std::string_view bytes_;
    size_t at_ = 0;
};

Header make_header(const DemandTrace& trace) {
    Header header = {};
    const RecordedRender& r = trace.recorded;
    std::memcpy(header.magic, magic, sizeof magic);
    header.version = format_version;
    header.header_bytes = sizeof(Header);
    header.path_count = trace.path_count();
    header.ray_count = trace.rays.size();
    header.visit_count = trace.visits.size();
    header.block_count = static_cast<uint32_t>(trace.block_bytes.size());
    header.name_bytes = static_cast<uint32_t>(std::min<size_t>(r.device.size(), longest_name));
    header.policy = static_cast<uint16_t>(r.policy.kind);
    header.evict_ahead = static_cast<uint16_t>(r.policy.evict_ahead);
    header.loads_in_flight = r.policy.loads_in_flight;
    header.loads_into_free = r.policy.loads_into_free;
    header.max_age = r.policy.max_age;
    header.loads_while_idle = r.policy.loads_while_idle;
    header.traffic_kept = static_cast<float>(r.policy.traffic_kept);
    header.hold_above_ready = r.policy.hold_above_ready;
    header.pool_bytes = r.pool_bytes, header.slab_bytes = r.slab_bytes;
    header.slots = r.slots, header.wait_for_loads = r.wait_for_loads;
    header.cpu_cores = r.cpu_cores, header.rounds_under_way = r.rounds_under_way;
    header.paths = r.paths, header.rays = r.rays, header.loads = r.loads, header.bytes_loaded = r.bytes_loaded, header.rounds = r.rounds;
    header.seconds = r.seconds, header.trace_seconds = r.trace_seconds;
    header.scene_identity = r.scene_identity;
    return header;
}

RecordedRender recorded_from(const Header& header, std::string device) {
    RecordedRender r;
    r.device = std::move(device);
    r.policy.kind = static_cast<PolicyKind>(header.policy);
    r.policy.evict_ahead = header.evict_ahead;
    r.policy.loads_in_flight = header.loads_in_flight;
    r.policy.loads_into_free = header.loads_into_free;
    r.policy.max_age = header.max_age;
    r.policy.loads_while_idle = header.loads_while_idle;
    r.policy.traffic_kept = header.traffic_kept;
    r.policy.hold_above_ready = header.hold_above_ready;
    r.pool_bytes = header.pool_bytes, r.slab_bytes = header.slab_bytes;
    r.slots = header.slots, r.wait_for_loads = header.wait_for_loads != 0;
    r.cpu_cores = header.cpu_cores, r.rounds_under_way = header.rounds_under_way;
    r.paths = header.paths, r.rays = header.rays, r.loads = header.loads, r.bytes_loaded = header.bytes_loaded, r.rounds = header.rounds;
    r.seconds = header.seconds, r.trace_seconds = header.trace_seconds;
    r.scene_identity = header.scene_identity;
    return r;
}

void pack_paths(const DemandTrace& trace, Packer& packer) {
    int64_t last_block = 0;
    for (size_t path = 0; path < trace.path_count(); path++) {
        packer.number(trace.path_rays[path + 1] - trace.path_rays[path]);
        for (uint64_t i = trace.path_rays[path]; i < trace.path_rays[path + 1]; i++) {
            const TracedRay& ray = trace.rays[i];
            packer.number(uint64_t{ray.visits} << 1 | (ray.shadow ? 1 : 0));
            if (!ray.shadow) packer.number(ray.hit_block == RP_NONE ? 0 : uint64_t{ray.hit_block} + 1);
            for (const Visit& visit : trace.visits_of(ray)) {
                packer.difference((int64_t{visit.block()} - last_block) * 2 + (visit.stops() ? 1 : 0));
                last_block = visit.block();
            }
        }
    }
}

// Reads the variable part. Every count was checked against the bytes that are there, so that nothing is allocated out of proportion.
class PathReader {
public:
    PathReader(Unpacker& from, DemandTrace& trace) : from_(from), trace_(trace) {}

    bool read(const Header& header) {
        trace_.path_rays.reserve(header.path_count + 1);
        trace_.rays.reserve(header.ray_count);
        trace_.visits.reserve(header.visit_count);
        for (uint64_t path = 0; path < header.path_count; path++) {
            uint64_t rays = 0;
            if (!from_.number(rays) || rays > header.ray_count - trace_.rays.size()) return false;
            for (uint64_t i = 0; i < rays; i++)
                if (!read_ray(header)) return false;
            trace_.path_rays.push_back(trace_.rays.size());
        }
        return trace_.rays.size() == header.ray_count && trace_.visits.size() == header.visit_count && from_.left() == 0;
    }

private:
    bool read_ray(const Header& header) {
        uint64_t head = 0, hit = 0;
        if (!from_.number(head) || head >> 1 > header.visit_count - trace_.visits.size()) return false;
        TracedRay ray{trace_.visits.size(), static_cast<uint32_t>(head >> 1), (head & 1) != 0, RP_NONE};
        if (!ray.shadow && (!from_.number(hit) || hit > header.block_count)) return false;
        if (hit) ray.hit_block = static_cast<uint32_t>(hit - 1);
        for (uint32_t i = 0; i < ray.visits; i++) {
            int64_t step = 0;
            if (!from_.difference(step)) return false;
            last_block_ += step >> 1;
            if (last_block_ < 0 || last_block_ >= int64_t{header.block_count}) return false;
            trace_.visits.push_back(Visit::of(static_cast<uint32_t>(last_block_), (step & 1) != 0));
        }
        trace_.rays.push_back(ray);
        return true;
    }

    Unpacker& from_;
    DemandTrace& trace_;
    int64_t last_block_ = 0;
};

Status check_header(const Header& header, const std::string& bytes) {
    if (std::memcmp(header.magic, magic, sizeof magic) != 0) return Status::failed("is not a demand trace of raypager");
    if (header.version != format_version || header.header_bytes != sizeof(Header))
        return Status::failed(fmt::format("has version {}, this program reads version {}; record it again", header.version, format_version));
    if (header.file_bytes != bytes.size())
        return Status::failed(fmt::format("has {} bytes, but its header says {}; it is truncated or damaged", bytes.size(), header.file_bytes));
    if (header.checksum != hash64(std::string_view(bytes).substr(checksum_from)))
        return Status::failed(fmt::format("is damaged: the checksum of the bytes from {} on is wrong", checksum_from));
    // Whoever writes a checksum can write nonsense as well. A path, a ray and a visit each take at least a byte.
    const uint64_t most = bytes.size();
    const bool counts = header.path_count <= most && header.ray_count <= most && header.visit_count <= most && header.block_count <= most / 4 &&
                        header.name_bytes <= longest_name;
    const bool figures = header.policy < policy_names.size() && header.slots > 0 && header.rounds_under_way > 0 && header.hold_above_ready >= 0 &&
                         std::isfinite(header.hold_above_ready) && header.traffic_kept >= 0 && header.traffic_kept < 1 &&
                         std::isfinite(header.seconds) && header.seconds >= 0 && std::isfinite(header.trace_seconds) && header.trace_seconds >= 0;
    if (!counts || !figures) return Status::failed("holds impossible figures in its header; record it again");
    return {};
}

Result<DemandTrace> unpack(const std::string& bytes) {
    Header header;
    if (bytes.size() < sizeof header) return Status::failed(fmt::format("has only {} bytes and is not a demand trace", bytes.size()));
    std::memcpy(&header, bytes.data(), sizeof header);
    RAYPAGER_TRY(check_header(header, bytes));
    Unpacker from(std::string_view(bytes).substr(sizeof header));
    DemandTrace trace;
    std::string device(header.name_bytes, '\0');
    trace.block_bytes.resize(header.block_count);
    const bool read = from.raw(device.data(), device.size()) && from.raw(trace.block_bytes.data(), trace.block_bytes.size() * sizeof(uint32_t)) &&
                      PathReader(from, trace).read(header);
    if (!read || std::find(trace.block_bytes.begin(), trace.block_bytes.end(), 0u) != trace.block_bytes.end())
        return Status::failed(fmt::format("makes no sense at byte {}; record it again", sizeof header + from.position()));
    trace.recorded = recorded_from(header, std::move(device));
    return trace;
}

}  // namespace

uint64_t DemandTrace::geometry_bytes() const {
    uint64_t sum = 0;
    for (const uint32_t bytes : block_bytes) sum += bytes;
    return sum;
}

uint32_t DemandTrace::largest_block() const { return block_bytes.empty() ? 0 : *std::max_element(block_bytes.begin(), block_bytes.end()); }

Status write_demand_trace(const std::filesystem::path& path, const DemandTrace& trace) {
    Header header = make_header(trace);
    Packer packer;
    packer.raw(&header, sizeof header);
    packer.raw(trace.recorded.device.data(), header.name_bytes);
    packer.raw(trace.block_bytes.data(), trace.block_bytes.size() * sizeof(uint32_t));
    pack_paths(trace, packer);
    std::string bytes = packer.take();
    header.file_bytes = bytes.size();
    header.checksum = hash64(std::string_view(bytes).substr(checksum_from));
    std::memcpy(bytes.data(), &header, sizeof header);
    return write_text(path, bytes);
}

Result<DemandTrace> read_demand_trace(const std::filesystem::path& path) {
    try {
        const auto bytes = read_text(path, largest_file);
        if (!bytes) return bytes.status();
        auto trace = unpack(*bytes);
        return trace ? std::move(trace) : Result<DemandTrace>(trace.status().at(path.string()));
    } catch (const std::bad_alloc&) {
        return Status::failed(fmt::format("{}: not enough memory to read it", path.string()));
    }
}

}  // namespace raypager
