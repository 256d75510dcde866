// Last stage of a round: what the host reads back after it (abi/path.h, RP_REPORT_COUNT). The work grows with the blocks of which something has
// changed; of the others, one byte for some of them is looked at.
#ifndef RP_REPORT_CL
#define RP_REPORT_CL

#include "common/demand.cl"

// Tells of those blocks from `first` on that share a mark.
static inline void rp_report_marked(__global uint* demand, uint block_count, uint first, __global uint* report) {
    const __global uint* const requests = demand + RP_DEMAND_REQUESTS * (size_t)block_count + first;
    const __global uint* const used = demand + RP_DEMAND_USED * (size_t)block_count + first;
    __global uint* const told = demand + RP_DEMAND_TOLD_AT((size_t)block_count) + 2u * (size_t)first;
#ifdef RP_TRACK_BOUNCES
    __global uint* const bounces = demand + RP_DEMAND_BOUNCES * (size_t)block_count + first;
#endif
    const uint last = min(block_count - first, RP_MARK_BLOCKS) - 1u;
    uint now[RP_MARK_BLOCKS][3], changed = 0u, count = 0u;
    // All loads before the first store, so that they are under way together.
#pragma unroll
    for (uint k = 0u; k < RP_MARK_BLOCKS; k++) {
        const uint i = min(k, last);
        now[k][0] = requests[i];
        now[k][1] = 0u;
        now[k][2] = used[i];
#ifdef RP_TRACK_BOUNCES
        now[k][1] = bounces[i];
#endif
        const bool differs = now[k][0] != told[2u * i] || now[k][1] != 0u || now[k][2] != told[2u * i + 1u];
        changed |= differs && k <= last ? 1u << k : 0u;
        count += differs && k <= last ? 1u : 0u;
    }
    if (changed == 0u) return;
    uint at = atomic_add((volatile __global uint*)report + RP_REPORT_COUNT, count);
#pragma unroll
    for (uint k = 0u; k < RP_MARK_BLOCKS; k++) {
        if (!(changed >> k & 1u)) continue;
        __global uint* const entry = report + RP_REPORT_HEAD + 4u * (size_t)at++;
        entry[0] = first + k;
        entry[1] = told[2u * k] = now[k][0];
        entry[2] = now[k][1];
        entry[3] = told[2u * k + 1u] = now[k][2];
#ifdef RP_TRACK_BOUNCES
        bounces[k] = 0u;
#endif
    }
}

// reports: two of them, of which the one of this number is written, and the count of the other one cleared. together: so many words of marks a
// work-item takes in a row.
__kernel void rp_report(const __global uint* restrict counters, __global uint* restrict demand, uint block_count, __global uint* restrict reports,
                        uint number, uint together) {
    const uint items = (uint)get_global_size(0), item = (uint)get_global_id(0), words = RP_MARK_WORDS(block_count);
    __global uint* const report = reports + number * RP_REPORT_WORDS((size_t)block_count);
    __global uint* const marks = demand + RP_DEMAND_MARKS_AT((size_t)block_count);
    for (uint i = item; i < RP_COUNTER_WORDS; i += items) report[i] = counters[i];
    if (item == 0u) reports[(1u - number) * RP_REPORT_WORDS((size_t)block_count) + RP_REPORT_COUNT] = 0u;
    for (uint first = item * together; first < words; first += items * together) {
        for (uint w = first; w < min(first + together, words); w++) {
            const uint marked = marks[w];
            if (marked == 0u) continue;
            marks[w] = 0u;
            for (uint k = 0u; k < 4u; k++)
                if ((marked >> 8u * k & 255u) != 0u) rp_report_marked(demand, block_count, (4u * w + k) * RP_MARK_BLOCKS, report);
        }
    }
}

#endif
