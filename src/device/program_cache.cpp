#include "device/program_cache.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>

#include "base/files.hpp"
#include "base/hash.hpp"
#include "base/log.hpp"
#include "device/device.hpp"
#include "device/faults.hpp"
#include "device/kernel_sources.hpp"

namespace raypager {
namespace {

constexpr int max_include_depth = 16;

Status expand(std::string_view name, int depth, std::string& output) {
    if (depth > max_include_depth) return Status::failed(fmt::format("kernel source {}: includes nest too deeply", name));
    for (const KernelSource& source : kernel_sources()) {
        if (source.name != name) continue;
        std::string_view text = source.text;
        while (!text.empty()) {
            const size_t end = std::min(text.find('\n'), text.size() - 1) + 1;
            const std::string_view line = text.substr(0, end);
            text.remove_prefix(end);
            const std::string_view directive = "#include \"";
            if (line.substr(0, directive.size()) != directive) {
                output += line;
                continue;
            }
            const std::string_view rest = line.substr(directive.size());
            RAYPAGER_TRY(expand(rest.substr(0, rest.find('"')), depth + 1, output));
        }
        return {};
    }
    return Status::failed(fmt::format("kernel source {} is not part of this program", name));
}

std::filesystem::path cache_folder() {
    if (const char* set = std::getenv("XDG_CACHE_HOME"); set && *set) return std::filesystem::path(set) / "raypager" / "kernels";
    if (const char* home = std::getenv("HOME"); home && *home) return std::filesystem::path(home) / ".cache" / "raypager" / "kernels";
    return {};
}

// PoCL keeps what it compiles itself, and being asked for a binary makes it compile every kernel once more, for work-groups of any size.
bool caches_programs(const DeviceInfo& info) { return info.platform == "Portable Computing Language" && !device_faults().cache_kernels; }

std::string build_log(const cl::Program& program, const cl::Device& device) {
    std::string log;
    program.getBuildInfo(device, CL_PROGRAM_BUILD_LOG, &log);
    while (!log.empty() && log.back() == '\0') log.pop_back();
    return log;
}

// A program from a cached binary, or nothing.
bool load_binary(const std::filesystem::path& path, const cl::Context& context, const cl::Device& device, const std::string& options,
                 cl::Program& program) {
    std::error_code ignored;
    if (path.empty() || !std::filesystem::exists(path, ignored)) return false;
    auto text = read_text(path);
    if (!text || text->size() <= 16 || hash64(std::string_view(*text).substr(16)) != std::strtoull(text->substr(0, 16).c_str(), nullptr, 16))
        return false;
    const cl::Program::Binaries binaries = {std::vector<unsigned char>(text->begin() + 16, text->end())};
    cl_int code = CL_SUCCESS;
    program = cl::Program(context, {device}, binaries, nullptr, &code);
    return code == CL_SUCCESS && program.build({device}, options.c_str()) == CL_SUCCESS;
}

void save_binary(const std::filesystem::path& path, const cl::Program& program) {
    if (path.empty()) return;
    std::vector<std::vector<unsigned char>> binaries;
    if (program.getInfo(CL_PROGRAM_BINARIES, &binaries) != CL_SUCCESS || binaries.size() != 1 || binaries[0].empty()) return;
    std::error_code failed;
    std::filesystem::create_directories(path.parent_path(), failed);
    if (failed) return;
    const std::string_view binary(reinterpret_cast<const char*>(binaries[0].data()), binaries[0].size());
    // Best effort: without a cache the next start is slower, nothing else.
    (void)write_text(path, hex64(hash64(binary)) + std::string(binary));
}

}  // namespace

uint64_t kernel_sources_identity() {
    uint64_t hash = 0;
    for (const KernelSource& source : kernel_sources()) hash = hash64(source.text, hash64(source.name, hash));
    return hash;
}

Result<std::string> expand_kernel_source(const std::string& name) {
    std::string text;
    if (Status status = expand(name, 0, text); !status.ok()) return status;
    return text;
}

Result<cl::Program> build_program(const cl::Context& context, const cl::Device& device, const DeviceInfo& info, const std::string& source,
                                  const std::string& options) {
    auto text = expand_kernel_source(source);
    if (!text) return text.status();
    const std::string identity = fmt::format("{}|{}|{}|{}|{}", info.platform, info.name, info.driver, options, *text);
    const std::filesystem::path folder = caches_programs(info) ? std::filesystem::path() : cache_folder();
    const std::filesystem::path path = folder.empty() ? folder : folder / (hex64(hash64(identity)) + ".bin");
    cl::Program program;
    const bool fail = device_faults().fail_builds;
    if (!fail && load_binary(path, context, device, options, program)) return program;
    cl_int code = CL_SUCCESS;
    program = cl::Program(context, *text, false, &code);
    if (code != CL_SUCCESS) return cl_failed("creating program " + source, code);
    code = fail ? CL_BUILD_PROGRAM_FAILURE : program.build({device}, options.c_str());
    if (code != CL_SUCCESS) {
        std::string log = build_log(program, device);
        for (char& c : log)
            if (c == '\n') c = ' ';
        return Status::failed(fmt::format("{}: {} does not build: {}: {}", info.name, source, cl_error_name(code), log.substr(0, 2000)));
    }
    save_binary(path, program);
    return program;
}

}  // namespace raypager
