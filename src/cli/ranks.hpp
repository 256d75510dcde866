// A verb as one of several processes that mpirun has started, or as the only one.
#pragma once

#include <functional>
#include <memory>

#include "raypager/peers.hpp"

namespace raypager {

// run: is handed the other processes, or null where there are none; and says whether all have come to the end together. A process that does not ends
// all others.
Status run_in_ranks(const std::function<Status(std::shared_ptr<Peers>, bool& together)>& run);

}  // namespace raypager
