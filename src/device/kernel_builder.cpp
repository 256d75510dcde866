#include "device/kernel_builder.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <functional>
#include <utility>

#include "device/device.hpp"

extern char** environ;

namespace raypager {
namespace {

std::vector<std::string> builder_command;

// Until a driver is open in a process, an H200 compiles a program with a text of about this length (kernels.md).
constexpr size_t starting_as_bytes = 150000;

}  // namespace

void set_kernel_builder(std::vector<std::string> command) { builder_command = std::move(command); }

bool has_kernel_builder() { return !builder_command.empty(); }

std::vector<std::vector<KernelProgram>> share_programs(std::vector<KernelProgram> programs, size_t processes) {
    std::ranges::stable_sort(programs, std::ranges::greater(), &KernelProgram::text_bytes);
    std::vector<std::vector<KernelProgram>> shares(processes);
    std::vector<size_t> bytes(processes, starting_as_bytes);
    bytes[0] = 0;
    for (KernelProgram& program : programs) {
        const auto least = static_cast<size_t>(std::ranges::min_element(bytes) - bytes.begin());
        bytes[least] += program.text_bytes;
        shares[least].push_back(std::move(program));
    }
    return shares;
}

void KernelBuilders::start(const std::string& device, std::span<const KernelProgram> programs) {
    std::vector<std::string> command = builder_command;
    command.push_back(device);
    for (const KernelProgram& program : programs) command.insert(command.end(), {program.stage, program.definitions});
    std::vector<char*> arguments;
    for (std::string& argument : command) arguments.push_back(argument.data());
    arguments.push_back(nullptr);
    // What goes wrong is said by who asks for the kernels.
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    pid_t process = 0;
    if (posix_spawnp(&process, arguments[0], &files, nullptr, arguments.data(), environ) == 0) processes_.push_back(process);
    posix_spawn_file_actions_destroy(&files);
}

void KernelBuilders::wait() {
    for (const pid_t process : std::exchange(processes_, {}))
        while (waitpid(process, nullptr, 0) < 0 && errno == EINTR) continue;
}

Status build_kernels(std::span<const std::string> arguments) {
    if (arguments.size() < 3 || arguments.size() % 2 == 0)
        return Status::usage("kernels are built by the program itself: DEVICE, then STAGE and DEFINITIONS of each program");
    // The cache is what it is for, also where it is not used by default.
    const auto device = Device::open(arguments[0], 0, {{find_profile_field("cache-kernels"), 1}}, nullptr);
    if (!device) return device.status();
    Status first_error;
    for (size_t i = 1; i < arguments.size(); i += 2)
        if (const Status status = (*device)->build({arguments[i], {}, arguments[i + 1]}); first_error.ok()) first_error = status;
    return first_error;
}

}  // namespace raypager
