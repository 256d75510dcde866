#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "device/select.hpp"
#include "raypager/devices.hpp"

namespace raypager {
namespace {

template <class T>
T device_value(const cl::Device& device, cl_device_info key) {
    T value{};
    device.getInfo(key, &value);
    return value;
}

std::string device_text(const cl::Device& device, cl_device_info key) {
    std::string text;
    device.getInfo(key, &text);
    while (!text.empty() && (text.back() == '\0' || text.back() == ' ')) text.pop_back();
    return text;
}

// selector: an index, or part of a name.
bool matches(const DeviceInfo& info, const std::string& selector) {
    if (selector.find_first_not_of("0123456789") == std::string::npos) return std::to_string(info.index) == selector;
    return info.name.find(selector) != std::string::npos || info.platform.find(selector) != std::string::npos;
}

// What the environment says where no option does; empty: nothing.
std::string selector_of_environment() {
    const char* value = std::getenv(default_device_variable);
    return value ? value : "";
}

// The device that the environment names, or else the first GPU, or else the first of all. found.size(): there is none of that name.
size_t default_device(const std::vector<FoundDevice>& found) {
    const std::string wanted = selector_of_environment();
    const auto first = [&](const auto& good) { return static_cast<size_t>(std::find_if(found.begin(), found.end(), good) - found.begin()); };
    if (!wanted.empty()) return first([&](const FoundDevice& entry) { return matches(entry.info, wanted); });
    const size_t gpu = first([](const FoundDevice& entry) { return entry.info.type == DeviceType::gpu; });
    return gpu < found.size() ? gpu : 0;
}

}  // namespace

Result<std::vector<FoundDevice>> find_devices(DeviceHooks& hooks) {
    std::vector<cl::Platform> platforms;
    // Without any platform the loader answers with an error of its own (CL_PLATFORM_NOT_FOUND_KHR).
    if (cl::Platform::get(&platforms) != CL_SUCCESS || platforms.empty() || !hooks.has_platforms())
        return Status::failed("no OpenCL platform found; install one, for instance pocl-opencl-icd (CPU) or the driver of your GPU");
    std::vector<FoundDevice> found;
    for (const cl::Platform& platform : platforms) {
        std::vector<cl::Device> devices;
        if (platform.getDevices(CL_DEVICE_TYPE_ALL, &devices) != CL_SUCCESS) continue;
        std::string platform_name;
        platform.getInfo(CL_PLATFORM_NAME, &platform_name);
        while (!platform_name.empty() && platform_name.back() == '\0') platform_name.pop_back();
        for (const cl::Device& device : devices) {
            if (!device_value<cl_bool>(device, CL_DEVICE_AVAILABLE) || !device_value<cl_bool>(device, CL_DEVICE_COMPILER_AVAILABLE)) continue;
            FoundDevice entry;
            entry.device = device;
            entry.info.index = static_cast<uint32_t>(found.size());
            entry.info.name = device_text(device, CL_DEVICE_NAME);
            entry.info.platform = platform_name;
            entry.info.driver = device_text(device, CL_DRIVER_VERSION);
            const auto type = device_value<cl_device_type>(device, CL_DEVICE_TYPE);
            // oclgrind is of all types; as a CPU it gets to see both ways of tracing.
            entry.info.type = type & CL_DEVICE_TYPE_CPU ? DeviceType::cpu : type & CL_DEVICE_TYPE_GPU ? DeviceType::gpu : DeviceType::accelerator;
            entry.info.memory_bytes = device_value<cl_ulong>(device, CL_DEVICE_GLOBAL_MEM_SIZE);
            entry.info.max_allocation_bytes = device_value<cl_ulong>(device, CL_DEVICE_MAX_MEM_ALLOC_SIZE);
            // NVIDIA's driver (580) allows more, but has an access violation when it clears a buffer from 8 GiB on.
            if (platform_name.find("NVIDIA") != std::string::npos)
                entry.info.max_allocation_bytes = std::min(entry.info.max_allocation_bytes, uint64_t{8} << 30);
            entry.info.compute_units = device_value<cl_uint>(device, CL_DEVICE_MAX_COMPUTE_UNITS);
            entry.info.profile = device_profile(entry.info.type, entry.info.platform, entry.info.compute_units);
            found.push_back(entry);
        }
    }
    if (found.empty() || !hooks.has_devices())
        return Status::failed("OpenCL has platforms but no usable device; check the driver of your GPU, or install pocl-opencl-icd");
    if (const size_t chosen = default_device(found); chosen < found.size()) found[chosen].info.is_default = true;
    return found;
}

Result<FoundDevice> select_device(const std::string& selector, DeviceHooks& hooks) {
    auto found = find_devices(hooks);
    if (!found) return found.status();
    for (const FoundDevice& entry : *found)
        if (selector.empty() ? entry.info.is_default : matches(entry.info, selector)) return entry;
    const std::string asked = selector.empty() ? fmt::format("{}={}", default_device_variable, selector_of_environment()) : "--device " + selector;
    return Status::usage(asked + ": no such device; `raypager devices` lists those there are");
}

namespace {

bool same_kind(const DeviceInfo& a, const DeviceInfo& b) { return a.name == b.name && a.platform == b.platform && a.driver == b.driver; }

std::string describe(const DeviceInfo& info) { return fmt::format("{} ({})", info.index, info.name); }

std::vector<std::string> parts_of(const std::string& list) {
    std::vector<std::string> parts(1);
    for (const char c : list) c == ',' ? parts.emplace_back() : parts.back() += std::string(1, c);
    return parts;
}

DeviceChoice all_devices(const std::vector<FoundDevice>& found, bool different) {
    const auto first = std::find_if(found.begin(), found.end(), [](const FoundDevice& entry) { return entry.info.is_default; });
    DeviceChoice choice;
    std::string left_out;
    for (const FoundDevice& entry : found) {
        if (different || same_kind(entry.info, first->info))
            choice.selectors.push_back(std::to_string(entry.info.index));
        else
            left_out += (left_out.empty() ? "" : ", ") + describe(entry.info);
    }
    if (!left_out.empty())
        choice.note = fmt::format("--device all: without {}, unlike {}; --allow-different takes all", left_out, describe(first->info));
    return choice;
}

}  // namespace

Result<DeviceChoice> choose_devices(const std::string& selector, bool different, DeviceHooks& hooks) {
    const std::string wanted = selector.empty() ? selector_of_environment() : selector;
    if (wanted != "all" && wanted.find(',') == std::string::npos) return DeviceChoice{{selector}, {}};
    auto found = find_devices(hooks);
    if (!found) return found.status();
    if (wanted == "all" && std::none_of(found->begin(), found->end(), [](const FoundDevice& entry) { return entry.info.is_default; }))
        found->front().info.is_default = true;  // the environment says "all"
    const auto with_note = [&](DeviceChoice choice) {
        const auto of = [&](const std::string& index) -> const DeviceInfo& { return (*found)[std::stoul(index)].info; };
        const bool mixed = std::any_of(choice.selectors.begin(), choice.selectors.end(),
                                       [&](const std::string& index) { return !same_kind(of(index), of(choice.selectors.front())); });
        if (mixed) choice.note = "devices of different kinds: the last bits of the picture depend on which of them takes which sample";
        return choice;
    };
    if (wanted == "all") return with_note(all_devices(*found, different));
    DeviceChoice choice;
    std::optional<DeviceInfo> first;
    for (const std::string& part : parts_of(wanted)) {
        const auto entry = std::find_if(found->begin(), found->end(), [&](const FoundDevice& e) { return !part.empty() && matches(e.info, part); });
        if (entry == found->end())
            return Status::usage(fmt::format("--device {}: no device \"{}\"; `raypager devices` lists those there are", wanted, part));
        const std::string index = std::to_string(entry->info.index);
        if (std::find(choice.selectors.begin(), choice.selectors.end(), index) != choice.selectors.end())
            return Status::usage(fmt::format("--device {}: device {} is named twice", wanted, describe(entry->info)));
        if (!first) first = entry->info;
        if (!different && !same_kind(*first, entry->info))
            return Status::usage(
                fmt::format("--device {}: {} and {} differ, so the last bits of the picture would depend on which of them takes a sample; name "
                            "equal ones, or give --allow-different",
                            wanted, describe(*first), describe(entry->info)));
        choice.selectors.push_back(index);
    }
    return with_note(std::move(choice));
}

Result<std::vector<DeviceInfo>> list_devices() {
    DeviceHooks none;
    auto found = find_devices(none);
    if (!found) return found.status();
    std::vector<DeviceInfo> infos;
    for (const FoundDevice& entry : *found) infos.push_back(entry.info);
    return infos;
}

}  // namespace raypager
