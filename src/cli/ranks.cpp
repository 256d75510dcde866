#include "cli/ranks.hpp"

#ifdef RAYPAGER_MPI
#include "base/log.hpp"
#include "cluster/cluster.hpp"
#endif

namespace raypager {

Status run_in_ranks(const std::function<Status(std::shared_ptr<Peers>)>& run) {
#ifdef RAYPAGER_MPI
    Cluster cluster;
    const Status status = run(cluster.peers());
    // Others would wait for this one for ever.
    if (cluster.peers() && !status && status.kind() != ErrorKind::interrupted) {
        log_note(status.message());
        cluster.end(status.exit_code());
    }
    return status;
#else
    return run(nullptr);
#endif
}

}  // namespace raypager
