// How few bytes could have been moved.
#pragma once

#include <cstdint>

#include "bench/replay.hpp"
#include "residency/demand_trace.hpp"

namespace raypager::bench {

// Clairvoyant replacement: the bytes that are moved if the rounds stay as they were (the same blocks are entered in the same rounds), each
// block comes when the first round needs it, and what leaves is the block whose next use lies furthest in the future (Belady 1966).
// With blocks of one size, no choice of victims does better on that order of service; blocks of different sizes can be packed better now
// and then. It is no bound for other orders of service: which block is loaded next is the policy's.
uint64_t furthest_next_use_bytes(const ServiceOrder& service, const std::vector<uint32_t>& block_bytes, uint64_t pool_bytes);

// No schedule moves fewer bytes, whatever it knows of the future and whichever ray it serves when, as long as it starts with an empty pool
// of so many bytes, keeps at most `slots` paths in flight, starts them in the order of the trace, and lets every ray enter its blocks (an
// extension ray all of them; a shadow ray all if it arrives, and none if it does not).
//
// Why: take any `window` paths that start one after the other. When the next one after them starts, all but `slots` of them have ended, and
// these have entered only blocks that were in the pool when the first of them started, or came since. So the blocks that all but `slots` of
// the window's paths need, less the pool, have come in that time; and windows that follow one another share no time. Which paths are left
// out is chosen best by linear relaxation: each path spreads one unit over the blocks that it needs; leaving out blocks that hold more than
// `slots` units leaves out more than `slots` paths. Any spread gives a valid bound; a few steps towards an even load on all bytes make it
// a good one. The best of several window lengths counts.
//
// Exact for traces of all paths; for a share of them it is the bound of a render of that share with its share of the slots.
uint64_t min_bytes(const DemandTrace& trace, uint32_t slots, uint64_t pool_bytes);

}  // namespace raypager::bench
