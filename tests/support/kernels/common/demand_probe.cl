// For tests: what rays do to the demand of blocks, without rays.
#include "common/demand.cl"

// One work-item an item: a block, how many more rays wait for it, 0, how many have entered it.
__kernel void rp_probe_demand(const __global uint4* restrict items, uint block_count, volatile __global uint* restrict demand) {
    const uint4 item = items[get_global_id(0)];
    if (item.y != 0u) rp_request(demand, block_count, item.x, item.y);
    if (item.w == 0u) return;
    atomic_add(demand + RP_DEMAND_USED * (size_t)block_count + item.x, item.w);
    rp_mark(rp_marks_of(demand, block_count), item.x);
}
