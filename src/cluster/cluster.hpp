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
    std::shared_ptr<Peers> peers() const;
    // Of ranks that end before the others, whether this is the first one; or rank 0, who knows it, does not answer in so many seconds.
    bool ends_first(double seconds);
    // Ends the program, with this exit status: where there are other ranks and it is not 0, theirs, too.
    int end(int exit_status);

private:
    struct State;
    std::shared_ptr<State> state_;  // null: MPI has not begun
};

}  // namespace raypager
