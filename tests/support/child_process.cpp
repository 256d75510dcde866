#include "support/child_process.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <stdexcept>
#include <thread>

namespace raypager::support {
namespace {

std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> result;
    for (std::string& text : texts) result.push_back(text.data());
    result.push_back(nullptr);
    return result;
}

// Of a process that runs; 0 if there is none any more. (getrusage would count what the parent occupied before it started the child.)
uint64_t peak_resident_set(pid_t id) {
    std::ifstream file("/proc/" + std::to_string(id) + "/status");
    std::string word;
    uint64_t kilobytes = 0;
    while (file >> word)
        if (word == "VmHWM:" && file >> kilobytes) return kilobytes * 1024;
    return 0;
}

}  // namespace

ChildProcess::ChildProcess(const std::filesystem::path& program, const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                           const std::vector<std::string>& environment) {
    std::vector<std::string> words = {program.string()}, variables = environment;
    words.insert(words.end(), arguments.begin(), arguments.end());
    for (char** variable = environ; *variable; variable++) variables.emplace_back(*variable);
    const std::string out = (folder / "stdout").string(), err = (folder / "stderr").string();
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, 1, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_addopen(&actions, 2, err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
    const int failed = ::posix_spawn(&id_, program.c_str(), &actions, nullptr, pointers(words).data(), pointers(variables).data());
    posix_spawn_file_actions_destroy(&actions);
    if (failed) throw std::runtime_error("cannot run " + program.string());
}

ChildProcess::~ChildProcess() {
    if (id_ < 0) return;
    ::kill(id_, SIGKILL);
    ::waitpid(id_, nullptr, 0);
}

void ChildProcess::signal(int number) const {
    if (id_ >= 0) ::kill(id_, number);
}

bool ChildProcess::wait(double seconds, ChildResult& result) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    int status = 0;
    while (::waitpid(id_, &status, WNOHANG) == 0) {
        result.peak_bytes = std::max(result.peak_bytes, peak_resident_set(id_));
        if (std::chrono::steady_clock::now() > until) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    id_ = -1;
    result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    result.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    return true;
}

}  // namespace raypager::support
