#include <algorithm>
#include <thread>

#include "raypager/device_profile.hpp"

namespace raypager {
namespace {

constexpr uint64_t K = 1024, M = 1024 * K;

// So many slots fewer than a power of two: where all planes of a slot are a power of two of bytes apart, they compete for the same places of a CPU's
// caches. Shading takes 10 to 30 % less time without (cpu-paging.md).
constexpr uint64_t off_power = 683;

// Pages that are named are those of bench/journal.
DeviceProfile cpu_profile(bool streams, uint32_t cores, uint32_t host_threads) {
    DeviceProfile p;
    p.shares_host_memory = true;
    p.streams = streams;
    p.caches_slots = true;

    p.limit_quarters = 2;  // not measured: half is left to the cache of blocks, and to others

    // A quarter or half of the slots: short renders take 8 to 25 % longer (cpu-paging.md). Least number for few cores: not measured.
    p.default_slots = std::max<uint64_t>(64 * K, cores * 32 * K) - off_power;
    // The more rays there are to choose from, the more those of a stream have in common: four times as many slots take 8 to 10 % less on two cores
    // (cpu-paging.md). Eight cores and more have as many anyway.
    p.preferred_slots = std::max(p.default_slots, 256 * K - off_power);
    // A bound for memory alone: loads_for_slots is what bounds them first. Not measured.
    p.max_slots = std::max(4 * p.default_slots, 4 * M);
    p.scenes_for_slots = 2;  // not measured, as above
    // Scenes of 60 to 300 MB at 29, 12.5 and 3 % on two cores (cpu-paging.md).
    p.loads_for_slots = 1.0 / 54;
    p.expected_rays = 1.3e6;   // two busy cores, clutter of 200 K triangles: 2.6 M rays a second
    p.expected_loads = 10000;  // two cores, the sweep (expected_waits.cpp)
    // A host thread that plans needs a core: two rounds make 3 % resident up to 18 % slower, the rest little faster (cpu-paging.md,
    // cpu-traversal.md).
    p.rounds_under_way = 1;

    // Blocks on their way serve no ray yet, so they are no more than a part of the pool. 16 cores, 40 blocks: eight at a time, half as many as cores
    // (cpu-traversal.md). Most: not measured.
    p.blocks_per_load = 16;
    p.core_loads = cores / 2;
    p.blocks_per_core_load = 5;
    p.max_loads = p.max_idle_loads = 16;
    // Many blocks are entered by no ray of a round, and those go first. 0.25 to 0.99: a third to four fifths more loads (cpu-paging.md).
    p.traffic_kept = 0;
    // Each reads and verifies some GB/s. Two even on two cores that trace: 4 to 7 % less time, for what rays wait for is worth more than what others
    // do meanwhile (cpu-paging.md). Most: not measured.
    p.loader_threads = std::clamp<uint32_t>(host_threads / 4, 2, 4);
    // Cores trace, but not between rounds, nor at the end, when loads are waited for (cpu-paging.md, one thread on two cores). For
    // more cores: not measured.
    p.read_ahead_threads = std::clamp<uint32_t>(host_threads / 4, 1, 4);

    // A core runs work-items one after the other: some dozen groups, so that all end at about the same time. Not measured.
    p.items = 4 * K;
    p.ray_items = 4 * K;
    p.persistent_items = 1 * K;  // of tests alone
    // They take their work themselves: one a core would do where each core starts one at once; a second one finds what is left where not.
    p.stream_items = 2;
    p.wake_items = 2;         // 2 % less time than with one (cpu-traversal.md)
    p.shade_items = 16;       // not measured
    p.generate_groups = 4;    // not measured
    p.wake_sleep_groups = 4;  // not measured
    return p;
}

DeviceProfile gpu_profile(uint32_t units, uint32_t host_threads) {
    DeviceProfile p;
    p.limit_quarters = 3;  // not measured: a driver does not tell how much others hold
    // A driver pins 4 KiB of new memory in 2 us, and launches nothing meanwhile: all resident, 0.77 -> 0.75 s (gpu-paging.md).
    p.pinned_ahead_bytes = 128 * M;

    // 4 M on an H100. What fewer would do there: not measured.
    p.default_slots = std::clamp<uint64_t>(units * 32 * K, 256 * K, 4 * M);
    p.preferred_slots = 4 * p.default_slots;  // rounds get fuller: 7 % less time on an H100 (in no table there)
    // With 40 M, 64 M slots instead of 16 M take 13 to 20 % less at 29, 12.5 and 3 % (the same section).
    p.max_slots = 16 * p.default_slots;
    p.scenes_for_slots = 9;  // a tenth fewer cost 0.7 to 4 % (the same section); a GPU's memory is there for nothing else
    // The device does not wait for the host: 12.5 %, 1.99 -> 1.57 s; three and four are slower (gpu-paging.md).
    p.rounds_under_way = 2;

    // A GPU's rounds are short beside their fixed cost, and its bus is wide. A quarter of the pool in flight instead of a sixteenth: 12.5 %, 2.5 ->
    // 1.8 s (gpu-paging.md).
    p.blocks_per_load = 4;
    p.max_loads = 64;
    // The end of a render loads faster with 128 (gpu-paging.md).
    p.blocks_per_idle_load = 2;
    p.max_idle_loads = 128;
    // Loads into that room do not wait for rounds under way (the same section).
    p.blocks_per_evict_ahead = 16;
    p.max_evict_ahead = 16;
    p.traffic_kept = 0.75;  // nearly every block is entered by some ray of a round (the same section)
    // Four load at the speed of the bus; eight gain 3 to 7 % but for 3 % resident, where they lose 6 (gpu-paging.md).
    p.loader_threads = std::clamp<uint32_t>(host_threads / 4, 2, 4);
    // The host has little else to do than to bring what is needed for the first time (gpu-paging.md, with 16 cores). More than 16: not measured.
    p.read_ahead_threads = std::clamp<int>(static_cast<int>(host_threads) - 1, 1, 16);

    p.expected_rays = 3.2e6;   // an H200 among clutter: 105 M paths a second, at four rays (gpu-paging.md)
    p.expected_loads = 65000;  // an H200 handles 90,000 (gpu-paging.md)
    // Regions of a few rows of tiles are long strips, with more blocks around them than squares: 128 pixels instead of 16, 12.5 % of a render's
    // memory: clutter - 10 %, a terrain - 6 %; 29 %: - 2 % (gpu-paging.md).
    p.region_tile = 128;

    // A million work-items that have nothing to do take some ten microseconds; rays differ in length, so there are more of these (gpu-paging.md).
    p.items = 4 * K;
    p.ray_items = 16 * K;
    p.persistent_items = 1 * K;  // 768 to 2048: within 3 % (gpu-paging.md)
    p.wake_sleep_groups = 4;     // not measured
    // Streams are for CPUs.
    p.stream_items = p.wake_items = p.shade_items = p.generate_groups = 1;
    return p;
}

// What NVIDIA's compiler and its sub-groups of 32 work-items want beside: gpu-traversal.md.
void suit_nvidia(DeviceProfile& p) {
    p.build_processes = 4;  // its compiler takes one program at a time in a process; more do not gain (kernels.md)
    // With fewer registers more rays are under way, and more is put down in memory. 64 instead of 72: camera + 2 to + 3 %, bounces + 7 to + 9 %.
    p.closest_hit_registers = 64;
    p.any_hit_registers = 56;  // 48: 2 % slower; 64: the same (gpu-paging.md)
    p.shading_registers = 96;  // 6 to 8 % more vertices a second than with 72 (gpu-paging.md)
    p.camera_min_walks = 1;    // camera rays stay together
    p.bounce_min_walks = 20;   // + 13 to + 30 %; from 8 to 24: within 3 % (gpu-paging.md)
    p.bounce_min_inner = 8;
    p.bounce_shared_stack = 12;
    // Each multiprocessor has runs of the queue of its own: camera rays + 7 %, bounces + 1 %.
    p.camera_part_run = 1024;
    p.bounce_part_run = 2048;
}

constexpr ProfileField::Unit counts = ProfileField::Unit::count;
constexpr double max_slots_of_all = 1 << 30, max_threads = 256, max_items = 1 << 16;

using P = DeviceProfile;
// What decides whether a device works at all is not among them.
constexpr ProfileField fields[] = {
    {"cache-kernels", &P::cache_kernels, 0, 1, counts, "1: kernels are kept on disk once they are built; 0: that is left to the driver"},
    {"build-processes", &P::build_processes, 1, 64, counts, "that build kernels at the same time, for the cache on disk"},
    {"default-slots", &P::default_slots, 1024, max_slots_of_all, counts, "path slots while everything is resident"},
    {"preferred-slots", &P::preferred_slots, 1024, max_slots_of_all, counts, "path slots where all geometry fits beside them"},
    {"max-slots", &P::max_slots, 1024, max_slots_of_all, counts, "path slots where blocks are swapped, at most"},
    {"scenes-for-slots", &P::scenes_for_slots, 1, 1024, counts, "times the scene's bytes that path slots may take there"},
    {"loads-for-slots", &P::loads_for_slots, 0, 1e6, ProfileField::Unit::number,
     "on CPUs: bytes of path slots, in bytes of the scene over the share of it that is resident"},
    {"region-tile", &P::region_tile, 1, 1024, counts, "pixels a side of a tile where renders within limits go region by region"},
    {"rounds-under-way", &P::rounds_under_way, 1, 2, counts, "rounds on the device at a time"},
    {"blocks-per-load", &P::blocks_per_load, 1, 1e6, counts, "blocks of the pool for each load in flight"},
    {"core-loads", &P::core_loads, 0, 1024, counts, "loads in flight at least"},
    {"blocks-per-core-load", &P::blocks_per_core_load, 1, 1e6, counts, "blocks of the pool for each of these"},
    {"max-loads", &P::max_loads, 2, 1024, counts, "loads in flight at most"},
    {"blocks-per-idle-load", &P::blocks_per_idle_load, 0, 1e6, counts, "as blocks-per-load while loads are waited for; 0: the same"},
    {"max-idle-loads", &P::max_idle_loads, 2, 1024, counts, "loads in flight then, at most"},
    {"blocks-per-evict-ahead", &P::blocks_per_evict_ahead, 0, 1e6, counts, "blocks of the pool for each that is evicted ahead; 0: none is"},
    {"max-evict-ahead", &P::max_evict_ahead, 0, 1024, counts, "blocks evicted ahead at most"},
    {"traffic-kept", &P::traffic_kept, 0, 1, ProfileField::Unit::number, "share of a block's traffic that counts in the next round"},
    {"loader-threads", &P::loader_threads, 1, max_threads, counts, "threads that bring blocks to the device"},
    {"read-ahead-threads", &P::read_ahead_threads, 0, max_threads, counts, "threads that read blocks before they are loaded"},
    {"pinned-ahead", &P::pinned_ahead_bytes, 0, uint64_t{1} << 40, ProfileField::Unit::bytes, "host memory pinned while kernels are built"},
    {"items", &P::items, 64, max_items, counts, "work-items per compute unit of stages that do not trace, single rays"},
    {"ray-items", &P::ray_items, 64, max_items, counts, "work-items per compute unit that trace single rays"},
    {"persistent-items", &P::persistent_items, 64, max_items, counts, "the same, where they fetch rays themselves"},
    {"stream-items", &P::stream_items, 1, 1024, counts, "work-items per compute unit that trace streams"},
    {"wake-items", &P::wake_items, 1, 1024, counts, "work-items per compute unit that wake slots, streams"},
    {"shade-items", &P::shade_items, 1, 1024, counts, "work-items per compute unit that shade, streams"},
    {"generate-groups", &P::generate_groups, 1, 1024, counts, "work-groups per compute unit that begin paths, streams"},
    {"wake-sleep-groups", &P::wake_sleep_groups, 1, 16, counts, "words that a work-item reads when it wakes slots, single rays"},
    {"closest-hit-registers", &P::closest_hit_registers, 0, 255, counts, "registers for closest hits; 0: as the compiler likes"},
    {"any-hit-registers", &P::any_hit_registers, 0, 255, counts, "registers for shadow rays; 0: as the compiler likes"},
    {"shading-registers", &P::shading_registers, 0, 255, counts, "registers for shading; 0: as the compiler likes"},
    {"camera-min-walks", &P::camera_min_walks, 1, 32, counts, "work-items with camera rays left, below which a sub-group fetches new ones"},
    {"bounce-min-walks", &P::bounce_min_walks, 1, 32, counts, "the same of bounces"},
    {"bounce-min-inner", &P::bounce_min_inner, 1, 32, counts, "work-items at inner nodes, below which those at leaves go first"},
    {"bounce-shared-stack", &P::bounce_shared_stack, 1, 24, counts, "entries of a stack that lie in local memory"},
    {"camera-part-run", &P::camera_part_run, 16, max_items, counts, "camera rays in a row for one multiprocessor"},
    {"bounce-part-run", &P::bounce_part_run, 16, max_items, counts, "the same of bounces"}};

}  // namespace

std::string_view device_type_name(DeviceType type) { return type == DeviceType::cpu ? "CPU" : type == DeviceType::gpu ? "GPU" : "accelerator"; }

DeviceProfile device_profile(DeviceType type, std::string_view platform, uint32_t units, uint32_t host_threads) {
    if (host_threads == 0) host_threads = std::thread::hardware_concurrency();
    // Streams are for compilers that map vectors of sixteen numbers to the vector unit of a CPU. That of Mesa's rusticl takes them apart, and
    // takes minutes.
    DeviceProfile profile = type == DeviceType::cpu ? cpu_profile(platform != "rusticl", units, host_threads) : gpu_profile(units, host_threads);
    if (platform.find("NVIDIA") != std::string_view::npos) suit_nvidia(profile);
    // PoCL keeps what it compiles itself, and being asked for a binary makes it compile every kernel once more, for work-groups of any size.
    if (platform == "Portable Computing Language") profile.cache_kernels = 0;
    return profile;
}

DeviceProfile profile_of_cores(uint32_t cpu_cores) { return device_profile(cpu_cores > 0 ? DeviceType::cpu : DeviceType::gpu, {}, cpu_cores); }

double ProfileField::value(const DeviceProfile& profile) const {
    return std::visit([&](auto field) { return static_cast<double>(profile.*field); }, member);
}

void ProfileField::set(DeviceProfile& profile, double value) const {
    std::visit([&](auto field) { profile.*field = static_cast<std::remove_reference_t<decltype(profile.*field)>>(value); }, member);
}

std::span<const ProfileField> profile_fields() { return fields; }

const ProfileField* find_profile_field(std::string_view name) {
    const auto found = std::ranges::find(fields, name, &ProfileField::name);
    return found == std::end(fields) ? nullptr : found;
}

void apply(const ProfileChanges& changes, DeviceProfile& profile) {
    for (const ProfileChange& change : changes) change.field->set(profile, change.value);
}

}  // namespace raypager
