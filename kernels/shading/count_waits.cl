// After a round, for the layer of the film that shows paging: counts the slots that wait, by pixel.
#include "common/film.cl"
#include "common/path_state.cl"

__kernel void rp_count_waits(uint slot_count, __constant rp_render_params* restrict params, __global uint* restrict status,
                             __global uint4* restrict planes, __global uint* restrict film) {
    const rp_paths paths = {slot_count, status, planes};
    for (uint slot = get_global_id(0); slot < slot_count; slot += get_global_size(0)) {
        const uint now = rp_status_of(&paths, slot);
        if (rp_waits(now)) atomic_inc(rp_film_pixel(params, film, rp_sample_of(&paths, slot, now).pixel) + RP_LAYER_WAITS);
    }
}
