// Rays that wait with streams: lists of their slots, for each block (abi/path.h).
#ifndef RP_WAITING_LISTS_CL
#define RP_WAITING_LISTS_CL

#include "common/path_state.cl"

// The lists of a block's extension rays that wait, and behind them those of its shadow rays. demand: abi/path.h.
static inline volatile __global uint* rp_lists_of(volatile __global uint* demand, uint block_count, uint block) {
    return demand + (size_t)RP_DEMAND_LISTS * block_count + (size_t)block * (2u * RP_LISTS);
}

// Rays of a stream that wait from now on, linked already, for some blocks. They join a list of the block together, for with many cores each word that
// all change costs more than what is put there.
#define RP_CHAINS 4u
typedef struct rp_chains {
    uint list;  // of a block's
    uint next;  // the chain that gives way to another block's
    uint block[RP_CHAINS], count[RP_CHAINS];
    uint head[RP_CHAINS];  // link to the slot that came last (RP_DEMAND_LISTS)
    uint tail[RP_CHAINS];  // the slot that came first
} rp_chains;

// stream: number of the rays'.
static inline void rp_begin_chains(rp_chains* chains, uint stream, bool shadow) {
    chains->list = (shadow ? RP_LISTS : 0u) + stream % RP_LISTS;
    chains->next = 0u;
    for (uint k = 0u; k < RP_CHAINS; k++) chains->block[k] = RP_NONE, chains->count[k] = 0u;
}

static inline void rp_end_chain(rp_chains* chains, uint k, const rp_paths* paths, volatile __global uint* demand, uint block_count) {
    if (chains->count[k] == 0u) return;
    const uint block = chains->block[k];
    rp_set_wait_word(paths, chains->tail[k], atomic_xchg(rp_lists_of(demand, block_count, block) + chains->list, chains->head[k]));
    atomic_add(demand + RP_DEMAND_REQUESTS * block_count + block, chains->count[k]);
}

// Before this, rays that were put into chains are in no list, and nobody requests their blocks.
static inline void rp_end_chains(rp_chains* chains, const rp_paths* paths, volatile __global uint* demand, uint block_count) {
    for (uint k = 0u; k < RP_CHAINS; k++) rp_end_chain(chains, k, paths, demand, block_count);
}

// The ray of a slot waits for a block. REQUIRES: block is not RP_NONE. waiting_status: as for rp_wait_for_block.
static inline void rp_wait_for_block_in_chain(rp_chains* chains, const rp_paths* paths, uint slot, uint block, uint waiting_status,
                                              volatile __global uint* demand, uint block_count) {
    rp_set_status(paths, slot, waiting_status);
    uint k = 0u;
    while (k < RP_CHAINS && chains->block[k] != block) k++;
    if (k == RP_CHAINS) {
        k = chains->next;
        chains->next = (k + 1u) % RP_CHAINS;
        rp_end_chain(chains, k, paths, demand, block_count);
        chains->block[k] = block;
        chains->tail[k] = slot;
        chains->count[k] = 0u;
    } else {
        rp_set_wait_word(paths, slot, chains->head[k]);
    }
    chains->head[k] = slot + 1u;
    chains->count[k]++;
}

#endif
