// libFuzzer's entry points.
#include <fcntl.h>
#include <unistd.h>

#include <fstream>

#include "base/check.hpp"
#include "fuzz/fuzz.hpp"
#include "support/temporary_folder.hpp"

namespace raypager::fuzz {
namespace {

const support::TemporaryFolder& scratch_folder() {
    static const support::TemporaryFolder folder(std::filesystem::is_directory("/dev/shm") ? "/dev/shm" : std::filesystem::temp_directory_path());
    return folder;
}

void write_seeds(const std::filesystem::path& folder) {
    size_t number = 0;
    for (const std::string& seed : seeds()) std::ofstream(folder / ("seed-" + std::to_string(number++)), std::ios::binary) << seed;
}

}  // namespace

std::filesystem::path scratch_path(const std::string& name) { return scratch_folder() / name; }

std::filesystem::path write_input(const std::string& name, std::string_view content) {
    const std::filesystem::path path = scratch_path(name);
    const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    RAYPAGER_CHECK(descriptor >= 0);
    RAYPAGER_CHECK(::write(descriptor, content.data(), content.size()) == static_cast<ssize_t>(content.size()));
    ::close(descriptor);
    return path;
}

void check_proportion(uint64_t bytes, std::string_view input, uint64_t factor) {
    RAYPAGER_CHECK(bytes <= factor * input.size() + (uint64_t{1} << 20));
}

}  // namespace raypager::fuzz

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
    for (int i = 1; i < *count; i++) {
        const std::filesystem::path folder = (*arguments)[i];
        if (std::filesystem::is_directory(folder) && std::filesystem::is_empty(folder)) raypager::fuzz::write_seeds(folder);
    }
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    raypager::fuzz::run({reinterpret_cast<const char*>(data), size});
    return 0;
}
