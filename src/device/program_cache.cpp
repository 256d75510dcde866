#include "device/program_cache.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <set>
#include <string_view>

#include "base/files.hpp"
#include "base/hash.hpp"
#include "base/log.hpp"
#include "device/device.hpp"

namespace raypager {
namespace {

// Replaces includes by what they name. Drivers read the text even where they find the program in a cache of their own, so it is kept short: without
// lines of comments, and a file with an include guard comes once.
class Expansion {
public:
    explicit Expansion(std::span<const KernelSource> more) : more_(more) {}
    // always: the place is within no #if, so that the file is there for all that follows.
    Status add(std::string_view name, bool always = true, int depth = 0) {
        if (depth > max_include_depth) return Status::failed(fmt::format("kernel source {}: includes nest too deeply", name));
        if (seen_.contains(name)) return {};
        for (const std::span<const KernelSource> sources : {std::span(kernel_sources()), more_})
            for (const KernelSource& source : sources)
                if (source.name == name) return add_text(source, always, depth);
        return Status::failed(fmt::format("kernel source {} is not part of this program", name));
    }
    std::string take() { return std::move(text_); }

private:
    Status add_text(const KernelSource& source, bool always, int depth) {
        int conditions = 0;  // that the line is within, but for the guard
        bool first = true;   // of its directives
        std::string_view text = source.text;
        while (!text.empty()) {
            const size_t end = std::min(text.find('\n'), text.size() - 1) + 1;
            const std::string_view line = text.substr(0, end), code = line.substr(std::min(line.find_first_not_of(" \n"), line.size()));
            text.remove_prefix(end);
            if (code.empty() || code.starts_with("//")) continue;
            if (line.starts_with(include)) {
                const std::string_view rest = line.substr(include.size());
                RAYPAGER_TRY(add(rest.substr(0, rest.find('"')), always && conditions == 0, depth + 1));
                continue;
            }
            text_ += line;
            if (code[0] != '#') continue;
            const bool is_guard = first && is_guard_line(code);
            first = false;
            if (is_guard && always) seen_.insert(source.name);
            if (is_guard) conditions--;
            conditions += code.starts_with("#if");
            conditions -= code.starts_with("#endif");
        }
        return {};
    }

    // By their names: there are other macros that have a default.
    static bool is_guard_line(std::string_view code) { return code.starts_with("#ifndef ") && (code.ends_with("_CL\n") || code.ends_with("_H\n")); }

    static constexpr int max_include_depth = 16;
    static constexpr std::string_view include = "#include \"";
    std::span<const KernelSource> more_;
    std::string text_;
    std::set<std::string_view> seen_;  // files that need not come again
};

std::filesystem::path cache_folder() {
    if (const char* set = std::getenv("XDG_CACHE_HOME"); set && *set) return std::filesystem::path(set) / "raypager" / "kernels";
    if (const char* home = std::getenv("HOME"); home && *home) return std::filesystem::path(home) / ".cache" / "raypager" / "kernels";
    return {};
}

// Empty if there is no cache.
std::filesystem::path cached_path(const DeviceInfo& info, const std::string& options, const std::string& text) {
    const std::filesystem::path folder = info.profile.cache_kernels ? cache_folder() : std::filesystem::path();
    if (folder.empty()) return {};
    const std::string identity = fmt::format("{}|{}|{}|{}|{}", info.platform, info.name, info.driver, options, text);
    return folder / (hex64(hash64(identity)) + ".bin");
}

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

Result<std::string> expand_kernel_source(const std::string& name, std::span<const KernelSource> more) {
    Expansion expansion(more);
    RAYPAGER_TRY(expansion.add(name));
    return expansion.take();
}

Result<cl::Program> build_program(const cl::Context& context, const cl::Device& device, const DeviceInfo& info, const std::string& source,
                                  const std::string& options, std::span<const KernelSource> more, DeviceHooks& hooks) {
    auto text = expand_kernel_source(source, more);
    if (!text) return text.status();
    const std::filesystem::path path = cached_path(info, options, *text);
    cl::Program program;
    const bool builds = hooks.may_build();
    if (builds && load_binary(path, context, device, options, program)) return program;
    cl_int code = CL_SUCCESS;
    program = cl::Program(context, *text, false, &code);
    if (code != CL_SUCCESS) return cl_failed("creating program " + source, code);
    code = builds ? program.build({device}, options.c_str()) : CL_BUILD_PROGRAM_FAILURE;
    if (code != CL_SUCCESS) {
        std::string log = build_log(program, device);
        for (char& c : log)
            if (c == '\n') c = ' ';
        return Status::failed(fmt::format("{}: {} does not build: {}: {}", info.name, source, cl_error_name(code), log.substr(0, 2000)));
    }
    save_binary(path, program);
    return program;
}

std::optional<size_t> missing_text(const DeviceInfo& info, const std::string& source, const std::string& options) {
    const auto text = expand_kernel_source(source);
    if (!text) return std::nullopt;
    const std::filesystem::path path = cached_path(info, options, *text);
    std::error_code ignored;
    if (path.empty() || std::filesystem::exists(path, ignored)) return std::nullopt;
    return text->size();
}

}  // namespace raypager
