// Rays that wait with streams: lists of their slots, for each block (abi/path.h).
#ifndef RP_WAITING_LISTS_CL
#define RP_WAITING_LISTS_CL

#include "common/path_state.cl"

// The lists of a block's extension rays that wait, and behind them those of its shadow rays. demand: abi/path.h.
static inline volatile __global uint* rp_lists_of(volatile __global uint* demand, uint block_count, uint block) {
    return demand + RP_DEMAND_LISTS_AT((size_t)block_count) + (size_t)block * (2u * RP_LISTS);
}

// Rays of a stream that wait from now on, linked already, for some blocks. They join a list of the block together, for with many cores each word that
// all change costs more than what is put there.
#define RP_PENDING_LISTS 4u
typedef struct rp_pending_lists {
    uint list;  // of a block's
    uint next;  // the list that gives way to another block's
    uint block[RP_PENDING_LISTS], count[RP_PENDING_LISTS];
    uint head[RP_PENDING_LISTS];  // link to the slot that came last (RP_DEMAND_LISTS_AT)
    uint tail[RP_PENDING_LISTS];  // the slot that came first
} rp_pending_lists;

// stream: number of the rays'.
static inline void rp_begin_pending_lists(rp_pending_lists* lists, uint stream, bool shadow) {
    lists->list = (shadow ? RP_LISTS : 0u) + stream % RP_LISTS;
    lists->next = 0u;
    for (uint k = 0u; k < RP_PENDING_LISTS; k++) lists->block[k] = RP_NONE, lists->count[k] = 0u;
}

static inline void rp_end_pending_list(rp_pending_lists* lists, uint k, const rp_paths* paths, volatile __global uint* demand, uint block_count) {
    if (lists->count[k] == 0u) return;
    const uint block = lists->block[k];
    rp_set_wait_word(paths, lists->tail[k], atomic_xchg(rp_lists_of(demand, block_count, block) + lists->list, lists->head[k]));
    rp_request(demand, block_count, block, lists->count[k]);
}

// Before this, rays that were put into lists are in no list, and nobody requests their blocks.
static inline void rp_end_pending_lists(rp_pending_lists* lists, const rp_paths* paths, volatile __global uint* demand, uint block_count) {
    for (uint k = 0u; k < RP_PENDING_LISTS; k++) rp_end_pending_list(lists, k, paths, demand, block_count);
}

// The ray of a slot waits for a block. REQUIRES: block is not RP_NONE. waiting_status: as for rp_wait_for_block.
static inline void rp_wait_for_block_in_list(rp_pending_lists* lists, const rp_paths* paths, uint slot, uint block, uint waiting_status,
                                             volatile __global uint* demand, uint block_count) {
    rp_set_status(paths, slot, waiting_status);
    uint k = 0u;
    while (k < RP_PENDING_LISTS && lists->block[k] != block) k++;
    if (k == RP_PENDING_LISTS) {
        k = lists->next;
        lists->next = (k + 1u) % RP_PENDING_LISTS;
        rp_end_pending_list(lists, k, paths, demand, block_count);
        lists->block[k] = block;
        lists->tail[k] = slot;
        lists->count[k] = 0u;
    } else {
        rp_set_wait_word(paths, slot, lists->head[k]);
    }
    lists->head[k] = slot + 1u;
    lists->count[k]++;
}

#endif
