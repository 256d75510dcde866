// A verb as one of several processes that mpirun has started, or as the only one.
#pragma once

#include <functional>
#include <memory>

#include "raypager/peers.hpp"

namespace raypager {

// run: is handed the other processes, or null where there are none. An error of one ends all.
Status run_in_ranks(const std::function<Status(std::shared_ptr<Peers>)>& run);

}  // namespace raypager
