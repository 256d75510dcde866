#include "denoise/oidn_library.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <cstdlib>
#include <string>
#include <vector>

namespace raypager {
namespace {

constexpr const char* library_variable = "RAYPAGER_OIDN";

std::filesystem::path environment_path(const char* name) {
    const char* value = std::getenv(name);
    return value ? value : "";
}

std::string last_error() {
    const char* error = ::dlerror();
    return error ? error : "unknown error";
}

template <class Function>
bool find_function(void* handle, const char* name, Function*& function) {
    function = reinterpret_cast<Function*>(::dlsym(handle, name));
    return function != nullptr;
}

// The name of a function that is not there; null: all are.
const char* find_functions(void* handle, OidnLibrary& oidn) {
    if (!find_function(handle, "oidnNewDevice", oidn.new_device)) return "oidnNewDevice";
    if (!find_function(handle, "oidnCommitDevice", oidn.commit_device)) return "oidnCommitDevice";
    if (!find_function(handle, "oidnReleaseDevice", oidn.release_device)) return "oidnReleaseDevice";
    if (!find_function(handle, "oidnGetDeviceError", oidn.get_device_error)) return "oidnGetDeviceError";
    if (!find_function(handle, "oidnNewFilter", oidn.new_filter)) return "oidnNewFilter";
    if (!find_function(handle, "oidnSetSharedFilterImage", oidn.set_image)) return "oidnSetSharedFilterImage";
    if (!find_function(handle, "oidnCommitFilter", oidn.commit_filter)) return "oidnCommitFilter";
    if (!find_function(handle, "oidnExecuteFilter", oidn.execute_filter)) return "oidnExecuteFilter";
    if (!find_function(handle, "oidnReleaseFilter", oidn.release_filter)) return "oidnReleaseFilter";
    // Version 2 has the first name, version 1 the second.
    if (!find_function(handle, "oidnSetFilterBool", oidn.set_bool) && !find_function(handle, "oidnSetFilter1b", oidn.set_bool))
        return "oidnSetFilterBool";
    if (!find_function(handle, "oidnGetDeviceInt", oidn.get_int) && !find_function(handle, "oidnGetDevice1i", oidn.get_int))
        return "oidnGetDeviceInt";
    return nullptr;
}

// What the dynamic linker found by name lies where its functions do.
std::filesystem::path path_of(const OidnLibrary& oidn, const std::filesystem::path& asked) {
    Dl_info info = {};
    return ::dladdr(reinterpret_cast<void*>(oidn.new_device), &info) != 0 && info.dli_fname ? info.dli_fname : asked;
}

Result<OidnLibrary> with_functions(void* handle, const std::filesystem::path& asked) {
    OidnLibrary oidn;
    const char* missing = find_functions(handle, oidn);
    if (!missing) {
        oidn.path = path_of(oidn, asked);
        return oidn;
    }
    ::dlclose(handle);
    return Status::failed(fmt::format("{}: is not Open Image Denoise 1 or 2: it has no function {}; set {} to the path of another", asked.string(),
                                      missing, library_variable));
}

Result<OidnLibrary> open_file(const std::filesystem::path& path) {
    std::error_code error;
    // A bare name would be looked for elsewhere.
    const auto absolute = std::filesystem::absolute(path, error);
    if (void* handle = ::dlopen(absolute.c_str(), RTLD_NOW | RTLD_LOCAL)) return with_functions(handle, absolute);
    return Status::failed(fmt::format("{}: the denoiser cannot be loaded: {}; set {} to the path of libOpenImageDenoise.so", path.string(),
                                      last_error(), library_variable));
}

// Where Python's package pyoidn keeps the library, below the folder that has lib/python3.11 and the like in it.
std::vector<std::filesystem::path> in_python_packages(const std::filesystem::path& prefix) {
    std::vector<std::filesystem::path> found;
    if (prefix.empty()) return found;
    std::error_code error;
    for (auto entry = std::filesystem::directory_iterator(prefix / "lib", error); !error && entry != std::filesystem::directory_iterator();
         entry.increment(error)) {
        if (!entry->path().filename().string().starts_with("python3")) continue;
        for (const char* packages : {"site-packages", "dist-packages"})
            for (const char* name : {"libOpenImageDenoise.so.2", "libOpenImageDenoise.so"}) {
                std::error_code ignored;
                auto path = entry->path() / packages / "pyoidn" / "oidn" / "lib" / name;
                if (std::filesystem::exists(path, ignored)) found.push_back(std::move(path));
            }
    }
    return found;
}

}  // namespace

Result<OidnLibrary> open_oidn(const std::filesystem::path& named) {
    if (!named.empty()) return open_file(named);
    if (const auto path = environment_path(library_variable); !path.empty()) {
        auto opened = open_file(path);
        return opened ? std::move(opened) : opened.status().at(library_variable);
    }
    for (const char* name : {"libOpenImageDenoise.so.2", "libOpenImageDenoise.so.1", "libOpenImageDenoise.so"})
        if (void* handle = ::dlopen(name, RTLD_NOW | RTLD_LOCAL)) return with_functions(handle, name);
    const auto home = environment_path("HOME");
    for (const auto& prefix :
         {environment_path("VIRTUAL_ENV"), home.empty() ? home : home / ".local", std::filesystem::path("/usr/local"), std::filesystem::path("/usr")})
        for (const auto& path : in_python_packages(prefix)) return open_file(path);
    return Status::failed(fmt::format(
        "no denoiser was found; install Intel's Open Image Denoise ('pip install pyoidn' brings it, openimagedenoise.org has it), or set {} "
        "to the path of its libOpenImageDenoise.so",
        library_variable));
}

}  // namespace raypager
