#include "cli/ranks.hpp"

#ifdef RAYPAGER_MPI
#include <algorithm>
#include <chrono>
#include <exception>
#include <thread>

#include "base/log.hpp"
#include "cli/stop_signal.hpp"
#include "cluster/cluster.hpp"
#endif

namespace raypager {

#ifdef RAYPAGER_MPI
namespace {

// What is wrong with the options or the scene all ranks find, at about the same time. The first one says so, and gets time for it.
void let_one_say_why(Cluster& cluster) {
    constexpr double grace = 2;  // seconds
    if (!cluster.ends_first(grace)) std::this_thread::sleep_for(std::chrono::duration<double>(grace));
}

// Others would wait for this one for ever. (An error is one line.)
void end_all(Cluster& cluster, std::string message, int exit_status) {
    std::replace(message.begin(), message.end(), '\n', ' ');
    progress_line("");
    log_note(message);
    cluster.end(exit_status);
}

}  // namespace
#endif

Status run_in_ranks(const std::function<Status(std::shared_ptr<Peers>, bool& together)>& run) {
    bool together = false;
#ifdef RAYPAGER_MPI
    Cluster cluster;
    if (!cluster.peers()) return run(nullptr, together);
    StopSignal::leave_quietly();
    try {
        const Status status = run(cluster.peers(), together);
        if (!together) let_one_say_why(cluster);
        if (!together) end_all(cluster, status ? "ended before the others" : status.message(), status ? 1 : status.exit_code());
        return status;
    } catch (const std::bad_alloc&) {
        end_all(cluster, "out of memory; close other programs, or give a smaller --host-limit or --memory-limit", 1);
    } catch (const std::exception& error) {
        end_all(cluster, error.what(), 1);
    }
    return Status::failed("ended before the others");
#else
    return run(nullptr, together);
#endif
}

}  // namespace raypager
