// Free slots take the next samples and become camera paths.
#ifndef RP_CAMERA_PATHS_CL
#define RP_CAMERA_PATHS_CL

#include "common/arithmetic.cl"
#include "common/camera.cl"
#include "common/path_state.cl"
#include "common/random.cl"
#include "common/sample_order.cl"

// A new camera path in a slot. Fusing is allowed: no other code recomputes its ray, so nothing has to match it.
static inline void rp_begin_path(__constant rp_render_params* params, uint pixel, uint sample, uint slot, const rp_paths* paths) {
#pragma OPENCL FP_CONTRACT ON
    const uint2 xy = (uint2)(pixel % params->width, pixel / params->width);
    const rp_numbers_1 random = rp_random_bits_1(pixel, sample, 0u, RP_RANDOM_CAMERA, params->seed);
#ifdef RP_PIXEL_FILTER
    const float2 place = (float2)(0.5f) + rp_filtered_place(&params->filter, random.x, random.y);
    const float u = ((float)xy.x + place.x) / (float)params->width, v = ((float)xy.y + place.y) / (float)params->height;
#else
    const float u = ((float)xy.x + rp_unit_1(random.x)) / (float)params->width, v = ((float)xy.y + rp_unit_1(random.y)) / (float)params->height;
#endif
    const rp_camera_ray ray = rp_ray_of_camera(&params->camera, u, v, random.z, random.w);
    rp_store_camera_path(paths, slot, pixel, sample, ray.origin, ray.direction);
}

// Where sampling is adaptive, kernels that begin paths take one more argument: the pixels of the stage (abi/scene.h).
#ifdef RP_ADAPTIVE
#define RP_STAGE_PARAMETER , const __global uint* restrict stage_pixels
#define RP_STAGE_ARGUMENT , stage_pixels
#else
#define RP_STAGE_PARAMETER
#define RP_STAGE_ARGUMENT
#endif

static inline rp_path_sample rp_next_sample(__constant rp_render_params* params, ulong number, rp_sample_region* region RP_STAGE_PARAMETER) {
#ifdef RP_ADAPTIVE
    if (number >= params->stage_begin) {
        const ulong in_stage = number - params->stage_begin, place = rp_divide(in_stage, params->stage_passes);
        rp_path_sample result;
        result.pixel = stage_pixels[place];
        result.sample = params->stage_first + (uint)(in_stage - place * params->stage_passes);
        return result;
    }
#endif
    return rp_numbered_sample(params->order, params->width, params->height, number, region);
}

// What there is to be given out.
typedef struct rp_supply {
    uint slots;   // free ones
    ulong begun;  // samples by number, so far
    uint queued;  // extension rays that are in the queue already
} rp_supply;

// The first free slots take the samples listed in `again` (there are `listed` of them; these paths were under way when a checkpoint was
// written), the others the next samples by number. later: rounds to come will have more samples, so slots without one stay free.
static inline void rp_begin_paths(__constant rp_render_params* params, const rp_supply* supply, const __global uint* free_list, const rp_paths* paths,
                                  __global uint* queue, rp_sample_numbers numbers, const __global rp_path_sample* again, uint listed,
                                  uint later RP_STAGE_PARAMETER) {
    rp_sample_region region = {0ul, 0ul, 0u, 0u, 0u, 1u, 1u};
    for (uint i = get_global_id(0); i < supply->slots; i += get_global_size(0)) {
        const uint slot = free_list[i];
        const ulong count = supply->begun + (i - min(i, listed));
        if (i >= listed && count >= numbers.end) {
            if (later != 0u)
                rp_free_slot(paths, slot);
            else
                rp_retire_slot(paths, slot);
            continue;
        }
        rp_path_sample taken;
        if (i < listed)
            taken = again[i];
        else
            taken = rp_next_sample(params, count + (count < numbers.first_end ? numbers.first_shift : numbers.then_shift), &region RP_STAGE_ARGUMENT);
        rp_begin_path(params, taken.pixel, taken.sample, slot, paths);
        queue[supply->queued + i] = slot;
    }
}

// Once it has been given out: accounts for the samples. By one work-item. What others read in the same kernel they read with atomics, and it is
// changed with atomics: OpenCL 1.2 cannot express the order in which that happens, and checkers of races would complain.
static inline void rp_account_for_samples(__constant rp_render_params* params, const rp_supply* supply, volatile __global uint* counters,
                                          rp_sample_numbers numbers, uint listed) {
    const uint again = min(listed, supply->slots);
    ulong next = supply->begun + (supply->slots - again);
    if (next > numbers.end) next = numbers.end;
    if (next < supply->begun) next = supply->begun;  // they were cut behind these
    const uint started = again + (uint)(next - supply->begun);
    atomic_xchg(counters + RP_COUNT_SAMPLES, (uint)next);
    atomic_xchg(counters + RP_COUNT_SAMPLES + 1u, (uint)(next >> 32));
    atomic_add(counters + RP_COUNT_EXTEND, started);
    const uint waiting = counters[RP_COUNT_WAITING] + counters[RP_COUNT_IN_LISTS];
    counters[RP_COUNT_WAITING] = waiting;
    counters[RP_COUNT_IDLE] = params->slot_count - supply->queued - counters[RP_COUNT_SHADOW] - counters[RP_COUNT_TEXTURED] - supply->slots - waiting;
    const uint before = counters[RP_COUNT_CAMERA_RAYS];
    counters[RP_COUNT_CAMERA_RAYS] = before + started;
    if (before + started < before) counters[RP_COUNT_CAMERA_RAYS + 1u]++;
}

#endif
