// Second stage: free slots take the next samples and become camera paths.
#include "common/camera_paths.cl"
#include "common/demand.cl"
#include "raypager/abi/block.h"

static inline rp_supply rp_read_supply(const volatile __global uint* counters) {
    const rp_supply supply = {counters[RP_COUNT_FREE], (ulong)counters[RP_COUNT_SAMPLES + 1u] << 32 | counters[RP_COUNT_SAMPLES],
                              counters[RP_COUNT_EXTEND]};
    return supply;
}

__kernel void rp_generate(__constant rp_render_params* restrict params, const __global uint* restrict counters,
                          const __global uint* restrict free_list, __global uint* restrict status, __global uint4* restrict planes,
                          __global uint* restrict queue, rp_sample_numbers numbers, const __global rp_path_sample* restrict again, uint listed,
                          uint later RP_STAGE_PARAMETER) {
    const rp_supply supply = rp_read_supply(counters);
    const rp_paths paths = {params->slot_count, status, planes};
    rp_begin_paths(params, &supply, free_list, &paths, queue, numbers, again, listed, later RP_STAGE_ARGUMENT);
}

// After rp_generate, one work-item for each of `count` blocks and at least one: the samples that were given out are accounted for; and nobody waits
// any more for a block that is resident. count: all blocks, or 0 where rp_publish has seen to that.
__kernel void rp_advance(__constant rp_render_params* restrict params, __global uint* restrict counters, const __global rp_page* restrict pages,
                         uint count, uint block_count, __global uint* restrict demand, rp_sample_numbers numbers, uint listed) {
    const uint block = get_global_id(0);
    if (block < count && pages[block].address != RP_NONE) rp_end_requests(demand, block_count, block);
    if (block != 0u) return;
    const rp_supply supply = rp_read_supply(counters);
    rp_account_for_samples(params, &supply, counters, numbers, listed);
}
