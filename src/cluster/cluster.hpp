// Ranks by MPI.
#pragma once

#include <memory>

#include "raypager/peers.hpp"

namespace raypager {

// Begins and ends with the program. Where it was not started by mpirun or the like, there is one rank, and MPI is left alone.
class Cluster {
public:
    Cluster();
    ~Cluster();
    Cluster(const Cluster&) = delete;
    Cluster& operator=(const Cluster&) = delete;
    // Null where there is one rank.
    std::shared_ptr<Peers> peers() const { return peers_; }
    // Ends the program, with this exit status: where there are other ranks and it is not 0, theirs, too.
    int end(int exit_status);

private:
    bool begun_ = false;
    std::shared_ptr<Peers> peers_;
};

}  // namespace raypager
