// Second stage on CPUs: does what generate.cl does, in one kernel, since each that is launched costs a CPU as much time as some hundred rays.
#include "lib/camera_paths.cl"

__kernel void rp_generate_stream(__constant rp_render_params* restrict params, volatile __global uint* restrict counters,
                                 const __global uint* restrict free_list, __global uint* restrict status, __global uint4* restrict paths,
                                 __global uint* restrict queue, const __global rp_path_sample* restrict again, uint listed, uint later) {
    rp_begin_paths(params, counters, free_list, status, paths, queue, again, listed, later);
    // What has been given out is accounted for by the last work-group: the others have read by then how much there is.
    barrier(CLK_GLOBAL_MEM_FENCE);
    mem_fence(CLK_GLOBAL_MEM_FENCE);
    if (get_local_id(0) == 0u && atomic_inc(counters + RP_COUNT_GENERATED) + 1u == (uint)get_num_groups(0))
        rp_account_for_samples(params, counters, listed);
}
