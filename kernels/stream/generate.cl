// Second stage on CPUs: does what single_ray/generate.cl does, in one kernel, since each that is launched costs a CPU as much time as some hundred
// rays.
#include "common/camera_paths.cl"

// See rp_account_for_samples.
static inline uint rp_read_counter(volatile __global uint* counter) { return atomic_add(counter, 0u); }

__kernel void rp_generate_stream(__constant rp_render_params* restrict params, volatile __global uint* restrict counters,
                                 const __global uint* restrict free_list, __global uint* restrict status, __global uint4* restrict planes,
                                 __global uint* restrict queue, rp_sample_numbers numbers, const __global rp_path_sample* restrict again, uint listed,
                                 uint later RP_STAGE_PARAMETER) {
    __local uint found[4];
    if (get_local_id(0) == 0u) {
        found[0] = rp_read_counter(counters + RP_COUNT_FREE);
        found[1] = rp_read_counter(counters + RP_COUNT_SAMPLES);
        found[2] = rp_read_counter(counters + RP_COUNT_SAMPLES + 1u);
        found[3] = rp_read_counter(counters + RP_COUNT_EXTEND);
    }
    barrier(CLK_LOCAL_MEM_FENCE);
    const rp_supply supply = {found[0], (ulong)found[2] << 32 | found[1], found[3]};
    const rp_paths paths = {params->slot_count, status, planes};
    rp_begin_paths(params, &supply, free_list, &paths, queue, numbers, again, listed, later RP_STAGE_ARGUMENT);
    // What has been given out is accounted for by the last work-group: the others know by then how much there was. The fence keeps their reading
    // before their counting.
    mem_fence(CLK_GLOBAL_MEM_FENCE);
    if (get_local_id(0) == 0u && atomic_inc(counters + RP_COUNT_GENERATED) + 1u == (uint)get_num_groups(0))
        rp_account_for_samples(params, &supply, counters, numbers, listed);
}
