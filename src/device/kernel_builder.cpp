#include "device/kernel_builder.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "device/device.hpp"

extern char** environ;

namespace raypager {
namespace {

std::vector<std::string> builder_command;

}  // namespace

void set_kernel_builder(std::vector<std::string> command) { builder_command = std::move(command); }

bool has_kernel_builder() { return !builder_command.empty(); }

void KernelBuilders::start(const std::string& device, const std::string& stage, const std::string& definitions) {
    std::vector<std::string> command = builder_command;
    command.insert(command.end(), {device, stage, definitions});
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
    if (arguments.size() != 3) return Status::usage("kernels are built by the program itself: DEVICE STAGE DEFINITIONS");
    // The cache is what it is for, also where it is not used by default.
    const auto device = Device::open(arguments[0], 0, {{find_profile_field("cache-kernels"), 1}}, nullptr);
    if (!device) return device.status();
    return (*device)->build({arguments[1], {}, arguments[2]});
}

}  // namespace raypager
