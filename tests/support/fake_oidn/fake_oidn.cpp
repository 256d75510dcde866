// A library that passes for Open Image Denoise: means of 3x3 pixels, within its C interface as raypager uses it. FAKE_OIDN_MAJOR: which version's
// names it has; 0: a library that lacks functions. What the environment variable FAKE_OIDN_FAILS names goes wrong: "device", "filter", "execute" or
// "values". FAKE_OIDN_LOG: a file to append a line to for each filter that is executed, with its images and flags.
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>
#include <string>
#include <vector>

namespace {

struct FakeImage {
    float* values = nullptr;
    size_t width = 0, height = 0;
};

struct FakeFilter {
    std::map<std::string, FakeImage> images;
    std::map<std::string, bool> flags;
};

std::string error;

bool fails(const char* what) {
    const char* named = std::getenv("FAKE_OIDN_FAILS");
    return named && std::string(named) == what;
}

std::vector<float> smooth(const FakeImage& image) {
    std::vector<float> result(image.width * image.height * 3);
    for (size_t y = 0; y < image.height; y++)
        for (size_t x = 0; x < image.width; x++)
            for (size_t c = 0; c < 3; c++) {
                double sum = 0, count = 0;
                for (size_t j = y > 0 ? y - 1 : 0; j < std::min(y + 2, image.height); j++)
                    for (size_t i = x > 0 ? x - 1 : 0; i < std::min(x + 2, image.width); i++, count++)
                        sum += image.values[(j * image.width + i) * 3 + c];
                result[(y * image.width + x) * 3 + c] = static_cast<float>(sum / count);
            }
    return result;
}

// A line of what a filter was given, into the file that the environment names.
void log_call(const FakeFilter& filter) {
    const char* path = std::getenv("FAKE_OIDN_LOG");
    if (!path) return;
    std::string line;
    for (const auto& [name, image] : filter.images) line += (line.empty() ? "" : " ") + name;
    for (const auto& [name, value] : filter.flags) line += " " + name;
    std::ofstream(path, std::ios::app) << line << "\n";
}

}  // namespace

extern "C" {

void* oidnNewDevice(int type) {
    if (fails("device")) error = "this processor is too old";
    if (type != 1) error = "not the CPU";
    return error.empty() ? new int(0) : nullptr;
}
void oidnCommitDevice(void*) {}
void oidnReleaseDevice(void* device) { delete static_cast<int*>(device); }
int oidnGetDeviceError(void*, const char** message) {
    static thread_local std::string told;
    told = error;
    error.clear();
    *message = told.c_str();
    return told.empty() ? 0 : 1;
}
void* oidnNewFilter(void*, const char* type) {
    if (fails("filter") || std::string(type) != "RT") {
        error = "unknown filter";
        return nullptr;
    }
    return new FakeFilter;
}
void oidnSetSharedFilterImage(void* filter, const char* name, void* memory, int format, size_t width, size_t height, size_t offset,
                              size_t pixel_stride, size_t row_stride) {
    if (format != 3 || offset != 0 || pixel_stride != 0 || row_stride != 0) error = "a layout that the fake does not know";
    static_cast<FakeFilter*>(filter)->images[name] = {static_cast<float*>(memory), width, height};
}
void oidnCommitFilter(void*) {}
void oidnReleaseFilter(void* filter) { delete static_cast<FakeFilter*>(filter); }

void oidnExecuteFilter(void* filter) {
    const FakeFilter& fake = *static_cast<FakeFilter*>(filter);
    if (fails("execute")) error = "out of memory";
    if (!error.empty()) return;
    log_call(fake);
    const FakeImage& output = fake.images.at("output");
    for (const char* name : {"color", "albedo", "normal"})
        if (fake.images.contains(name)) {
            std::ranges::copy(smooth(fake.images.at(name)), output.values);
            break;
        }
    if (fails("values")) output.values[0] = std::numeric_limits<float>::quiet_NaN();
}

#if FAKE_OIDN_MAJOR == 1
void oidnSetFilter1b(void* filter, const char* name, bool value) { static_cast<FakeFilter*>(filter)->flags[name] = value; }
int oidnGetDevice1i(void*, const char*) { return 10403; }
#elif FAKE_OIDN_MAJOR == 2
void oidnSetFilterBool(void* filter, const char* name, bool value) { static_cast<FakeFilter*>(filter)->flags[name] = value; }
int oidnGetDeviceInt(void*, const char*) { return 20501; }
#endif

}  // extern "C"
