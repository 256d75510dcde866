// Open Image Denoise as a shared library that is opened at run time: the functions of its C interface that we use, declared here by its
// documentation, since neither its headers nor the library need be there when we are built.
#pragma once

#include <cstddef>
#include <filesystem>

#include "raypager/status.hpp"

namespace raypager {

struct OidnDevice;  // OIDNDevice points to one, OIDNFilter to the other
struct OidnFilter;

constexpr int oidn_device_cpu = 1;     // OIDN_DEVICE_TYPE_CPU
constexpr int oidn_format_float3 = 3;  // OIDN_FORMAT_FLOAT3
constexpr int oidn_error_none = 0;     // OIDN_ERROR_NONE

// Versions 1 and 2 have these in common, but for the last two, which have other names there.
struct OidnLibrary {
    std::filesystem::path path;
    OidnDevice* (*new_device)(int type) = nullptr;
    void (*commit_device)(OidnDevice* device) = nullptr;
    void (*release_device)(OidnDevice* device) = nullptr;
    int (*get_device_error)(OidnDevice* device, const char** message) = nullptr;  // and forgets it; of no device: of this thread
    OidnFilter* (*new_filter)(OidnDevice* device, const char* type) = nullptr;
    // The memory stays the caller's. Strides in bytes; 0: without gaps.
    void (*set_image)(OidnFilter* filter, const char* name, void* memory, int format, size_t width, size_t height, size_t byte_offset,
                      size_t pixel_stride, size_t row_stride) = nullptr;
    void (*commit_filter)(OidnFilter* filter) = nullptr;
    void (*execute_filter)(OidnFilter* filter) = nullptr;
    void (*release_filter)(OidnFilter* filter) = nullptr;
    void (*set_bool)(OidnFilter* filter, const char* name, bool value) = nullptr;
    int (*get_int)(OidnDevice* device, const char* name) = nullptr;
};

// Looks where find_denoiser() says. What was opened stays open: its threads would not survive the end of their code.
Result<OidnLibrary> open_oidn(const std::filesystem::path& named);

}  // namespace raypager
