#include "raypager/devices.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "cli/values.hpp"
#include "cli/verbs.hpp"

namespace raypager {
namespace {

std::string table(const std::vector<DeviceInfo>& devices) {
    size_t name_width = 4, platform_width = 8;
    for (const DeviceInfo& device : devices) {
        name_width = std::max(name_width, device.name.size());
        platform_width = std::max(platform_width, device.platform.size());
    }
    std::string text = fmt::format("   #  {:<{}}  {:<{}}  {:<11}  {:>10}  {:>14}\n", "name", name_width, "platform", platform_width, "type", "memory",
                                   "max allocation");
    for (const DeviceInfo& device : devices)
        text += fmt::format(" {} {}  {:<{}}  {:<{}}  {:<11}  {:>10}  {:>14}\n", device.is_default ? '*' : ' ', device.index, device.name, name_width,
                            device.platform, platform_width, device_type_name(device.type), format_bytes(device.memory_bytes),
                            format_bytes(device.max_allocation_bytes));
    return text +
           "* is the default; 'raypager render --device N' takes another, by number or by part of its name,\n"
           "and so does the environment variable RAYPAGER_DEVICE.\n";
}

// What `--tune` can set, and what it is without.
std::string profile_table(const DeviceInfo& device) {
    std::string text = fmt::format("{} {}: what suits it, NAME=VALUE for --tune\n", device.index, device.name);
    for (const ProfileField& field : profile_fields())
        text += fmt::format("  {:<34}  {}\n", fmt::format("{}={}", field.name, field.value(device.profile)), field.about);
    return text;
}

}  // namespace

Status run_devices(const Arguments& arguments) {
    bool profile = false;
    OptionParser parser("devices", "[options]", "Lists every OpenCL device: number, name, platform, type, memory, largest single allocation.");
    parser.flag("profile", "list instead what the program has chosen for each of them, which --tune of 'render' and 'bench' changes", profile);
    const auto outcome = parser.parse(arguments);
    if (!outcome) return outcome.status();
    if (*outcome == OptionParser::Outcome::help_shown) return {};
    const auto devices = list_devices();
    if (!devices) return devices.status();
    if (profile) {
        for (const DeviceInfo& device : *devices) std::fputs(profile_table(device).c_str(), stdout);
        return {};
    }
    std::fputs(table(*devices).c_str(), stdout);
    return {};
}

}  // namespace raypager
