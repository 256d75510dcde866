// What the program chooses by the class of a device, and what users may change of it.
#include "raypager/device_profile.hpp"

#include <gtest/gtest.h>

#include <set>

namespace raypager {
namespace {

TEST(DeviceProfile, FollowsTheClass) {
    const DeviceProfile cpu = device_profile(DeviceType::cpu, "Portable Computing Language", 2, 2);
    EXPECT_TRUE(cpu.streams && cpu.shares_host_memory && cpu.caches_slots);
    EXPECT_EQ(cpu.rounds_under_way, 1u);
    EXPECT_EQ(cpu.closest_hit_registers, 0u);
    const DeviceProfile gpu = device_profile(DeviceType::gpu, "NVIDIA CUDA", 132, 16);
    EXPECT_FALSE(gpu.streams || gpu.shares_host_memory || gpu.caches_slots);
    EXPECT_EQ(gpu.rounds_under_way, 2u);
    EXPECT_EQ(gpu.closest_hit_registers, 64u);
    EXPECT_EQ(device_profile(DeviceType::gpu, "rusticl", 16, 16).bounce_min_walks, 1u);
    EXPECT_FALSE(device_profile(DeviceType::cpu, "rusticl", 2, 2).streams);
}

TEST(DeviceProfile, FollowsTheNumberOfCores) {
    const auto slots = [](DeviceType type, uint32_t units) { return device_profile(type, "", units, 16).default_slots; };
    EXPECT_EQ(slots(DeviceType::cpu, 1), (1u << 16) - 683);
    EXPECT_EQ(slots(DeviceType::cpu, 16), (1u << 19) - 683);
    EXPECT_EQ(slots(DeviceType::gpu, 1), 1u << 18);
    EXPECT_EQ(slots(DeviceType::gpu, 132), 1u << 22);
    EXPECT_EQ(device_profile(DeviceType::cpu, "", 2, 2).preferred_slots, (1u << 18) - 683);
    EXPECT_EQ(device_profile(DeviceType::cpu, "", 64, 64).preferred_slots, slots(DeviceType::cpu, 64));
    EXPECT_EQ(device_profile(DeviceType::gpu, "", 132, 16).max_slots, 1u << 26);
    EXPECT_EQ(device_profile(DeviceType::cpu, "", 2, 2).loader_threads, 2u);
    EXPECT_EQ(device_profile(DeviceType::cpu, "", 2, 64).read_ahead_threads, 4u);
    EXPECT_EQ(device_profile(DeviceType::gpu, "", 2, 64).read_ahead_threads, 16u);
    EXPECT_EQ(device_profile(DeviceType::gpu, "", 2, 1).read_ahead_threads, 1u);
}

// Names are told apart, values that are chosen may be given, and each field is set where it is read.
TEST(DeviceProfile, FieldsAreSetByName) {
    std::set<std::string_view> names;
    for (const ProfileField& field : profile_fields()) {
        EXPECT_TRUE(names.insert(field.name).second) << field.name;
        EXPECT_EQ(find_profile_field(field.name), &field);
        for (const DeviceProfile& chosen : {device_profile(DeviceType::cpu, "", 1, 1), device_profile(DeviceType::gpu, "", 1, 1),
                                            device_profile(DeviceType::cpu, "", 256, 256), device_profile(DeviceType::gpu, "NVIDIA CUDA", 132, 16)})
            EXPECT_TRUE(field.value(chosen) >= field.lowest && field.value(chosen) <= field.highest) << field.name;
        DeviceProfile profile = device_profile(DeviceType::gpu, "NVIDIA CUDA", 132, 16);
        for (const double value : {field.lowest, field.highest}) {
            apply({{&field, value}}, profile);
            EXPECT_EQ(field.value(profile), value) << field.name;
        }
    }
    EXPECT_EQ(find_profile_field("no-such-field"), nullptr);
    DeviceProfile profile = profile_of_cores(2);
    const double before = profile.traffic_kept;
    apply({{find_profile_field("max-loads"), 5}, {find_profile_field("default-slots"), 5e9}}, profile);
    EXPECT_EQ(profile.max_loads, 5u);
    EXPECT_EQ(profile.default_slots, 5000000000u);
    EXPECT_EQ(profile.traffic_kept, before);
}

}  // namespace
}  // namespace raypager
