// What depends on the class of a device: what it can do, and the numbers that suit it. src/device/profile.cpp has them in one table, with the
// measurement that each comes from. None of them changes a picture.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

namespace raypager {

enum class DeviceType { cpu, gpu, accelerator };
std::string_view device_type_name(DeviceType type);  // "CPU", "GPU", "accelerator"

// Numbers of threads, path slots and loads are those for one device: what grows with its units is worked out.
struct DeviceProfile {
    // What it is.
    bool shares_host_memory = false;  // its memory is the host's, which other programs take from, too
    bool streams = false;             // it traces rays in streams, over blocks in wide form
    bool caches_slots = false;        // slots are read through caches that hold few of them: more than preferred_slots only as far as loads cost more

    // Kernels.
    uint32_t cache_kernels = 1;  // whether they are kept on disk when they are built; 0: the driver does so itself
    // Processes that build some for that cache at the same time, this one included (raypager/kernel_builder.hpp).
    uint32_t build_processes = 1;

    // Memory.
    uint32_t limit_quarters = 3;      // of the device's memory, or the host's where it shares that, by default
    uint64_t pinned_ahead_bytes = 0;  // of host memory for blocks, pinned while kernels are built

    // Path slots.
    uint64_t default_slots = 0;     // that keep it busy while everything is resident
    uint64_t preferred_slots = 0;   // that suit it better where all geometry fits beside them
    uint64_t max_slots = 0;         // where blocks must be swapped
    uint32_t scenes_for_slots = 0;  // how many times the bytes of the scene they may take there
    double loads_for_slots = 0;     // with caches_slots: bytes of slots = this * bytes of the scene / resident fraction
    uint32_t rounds_under_way = 1;  // at most
    uint32_t region_tile = 16;      // pixels a side of tiles where a render goes region by region, and not all is resident: regions become compact

    // What it is expected to do in a second, roughly: to tell a render that crawls before it begins (render/expected_waits.hpp).
    double expected_rays = 1e6;   // one of its units
    double expected_loads = 1e4;  // blocks, one after the other

    // Paging.
    uint32_t blocks_per_load = 1;         // of the pool, for each load in flight, ...
    uint32_t core_loads = 0;              // ... but so many loads at least, ...
    uint32_t blocks_per_core_load = 1;    // ... for each of which the pool must hold so many blocks, ...
    uint32_t max_loads = 2;               // ... and so many at most
    uint32_t blocks_per_idle_load = 0;    // the same while loads are all that is waited for; 0: as ever
    uint32_t max_idle_loads = 2;          // at most
    uint32_t blocks_per_evict_ahead = 0;  // of the pool, for each block that is evicted before its place is needed; 0: none is
    uint32_t max_evict_ahead = 0;         // at most
    double traffic_kept = 0;              // PolicySettings::traffic_kept
    uint32_t loader_threads = 2;
    uint32_t read_ahead_threads = 1;

    // Work-items of a launch, for each of the device's units. They loop over their queues.
    uint32_t items = 1;              // of stages that do not trace
    uint32_t ray_items = 1;          // that trace rays one by one
    uint32_t persistent_items = 1;   // the same, where they fetch rays themselves
    uint32_t stream_items = 1;       // that trace streams, each alone in its group
    uint32_t wake_items = 1;         // with streams
    uint32_t shade_items = 1;        // with streams
    uint32_t generate_groups = 1;    // with streams
    uint32_t wake_sleep_groups = 1;  // with single rays: sleeping slots' words that one work-item looks at

    // Registers that a compiler may give to kernels, where it can be told; 0: as many as it likes.
    uint32_t closest_hit_registers = 0;
    uint32_t any_hit_registers = 0;
    uint32_t shading_registers = 0;

    // Persistent threads (kernels/single_ray/persistent.cl). By default for sub-groups of one work-item.
    uint32_t camera_min_walks = 1;  // work-items of a sub-group with rays left, below which it fetches new ones
    uint32_t bounce_min_walks = 1;
    uint32_t bounce_min_inner = 1;     // work-items at inner nodes, below which those at leaves go first
    uint32_t bounce_shared_stack = 3;  // entries of a stack in local memory
    uint32_t camera_part_run = 16;     // rays in a row of the queue that are of one multiprocessor's part
    uint32_t bounce_part_run = 16;
};

// units: of computing, as OpenCL counts them; those of a CPU are its cores. host_threads: that the host runs at a time; 0: ask the host.
DeviceProfile device_profile(DeviceType type, std::string_view platform, uint32_t units, uint32_t host_threads = 0);
// Of what recorded renders call a number of cores: 0 is a GPU.
DeviceProfile profile_of_cores(uint32_t cpu_cores);

// A field that users may set.
struct ProfileField {
    enum class Unit { count, bytes, number };
    using Member = std::variant<uint32_t DeviceProfile::*, uint64_t DeviceProfile::*, double DeviceProfile::*>;
    std::string_view name;  // "default-slots"
    Member member;
    double lowest, highest;
    Unit unit;
    std::string_view about;

    double value(const DeviceProfile& profile) const;
    void set(DeviceProfile& profile, double value) const;
};
std::span<const ProfileField> profile_fields();
const ProfileField* find_profile_field(std::string_view name);  // nullptr: there is none

// What a user sets. REQUIRES: values within the bounds of their fields.
struct ProfileChange {
    const ProfileField* field;
    double value;
};
using ProfileChanges = std::vector<ProfileChange>;
void apply(const ProfileChanges& changes, DeviceProfile& profile);

}  // namespace raypager
