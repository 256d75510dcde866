// The rays of a stream against the children of a wide node.
#ifndef RP_WIDE_NODE_CL
#define RP_WIDE_NODE_CL

#include "stream/stream.cl"

// With fewer rays than this in a packet, each is tested alone against all children.
#ifndef RP_DENSE_BOXES
#ifdef RP_AVX512
#define RP_DENSE_BOXES 4
#else
#define RP_DENSE_BOXES 7
#endif
#endif

// With so many rays, children that none of them can meet are looked for first.
#ifndef RP_DENSE_STREAM
#define RP_DENSE_STREAM 16
#endif

// For bounds over many rays: twice RP_BOX_WIDEN, for they are rounded more often.
#define RP_STREAM_WIDEN 1.000004f

// Planes of all children in world space; see RP_ROW_UPPER.
typedef struct rp_planes {
    float at[6 * RP_WIDE_CHILDREN];
} rp_planes;

static inline void rp_decode_planes(const __global rp_wide_node* node, rp_planes* planes) {
    for (uint a = 0u; a < 3u; a++) {
        const float cell = as_float((uint)node->exponent[a] << 23), origin = node->origin[a];
        vstore8(convert_float8(vload8(0, node->lower[a])) * cell + origin, a, planes->at);
        vstore8(convert_float8(vload8(0, node->upper[a])) * cell + origin, a + RP_ROW_UPPER, planes->at);
    }
}

// For each child that is met: which rays meet it (not said of a ray that is tested alone: it meets all of these), and the least distance at
// which one of them enters.
typedef struct rp_children_met {
    ulong rays[RP_WIDE_CHILDREN];
    float entry[RP_WIDE_CHILDREN];
} rp_children_met;

// Children that any of the stream's rays can meet, by bounds of all their origins and reciprocals: of those that are left out, none is met.
// REQUIRES: all directions have the same signs.
static inline uint rp_possible_children(const rp_stream* s, const rp_planes* planes, uint count) {
    float8 enter = (float8)(0.0f), leave = (float8)(INFINITY);
    for (uint a = 0u; a < 3u; a++) {
        const bool negative = (s->signs >> a & 1u) != 0u;
        const float8 lower = vload8(a, planes->at), upper = vload8(a + RP_ROW_UPPER, planes->at);
        const float8 near = (negative ? upper : lower) - (negative ? s->min_origin[a] : s->greatest_origin[a]);
        const float8 far = (negative ? lower : upper) - (negative ? s->greatest_origin[a] : s->min_origin[a]);
        const float least = s->min_inverse[a], greatest = s->greatest_inverse[a];
        enter = rp_max(enter, rp_min(near * least, near * greatest));
        leave = rp_min(leave, rp_max(far * least, far * greatest));
    }
    return rp_mask8(enter <= leave * RP_STREAM_WIDEN) & ((1u << count) - 1u);
}

// Sixteen rays, all directions of the same signs, against one child after the other. Adds to what is met, and returns the children that are.
static inline uint rp_packet_meets(const rp_stream* s, const rp_planes* planes, uint p, float16 until, uint lanes, uint children, const bool any_hit,
                                   rp_children_met* met) {
    const uint signs = s->packet_signs[p];
    const float* near_x = planes->at + (signs & 1u ? 24u : 0u);
    const float* far_x = planes->at + (signs & 1u ? 0u : 24u);
    const float* near_y = planes->at + (signs & 2u ? 32u : 8u);
    const float* far_y = planes->at + (signs & 2u ? 8u : 32u);
    const float* near_z = planes->at + (signs & 4u ? 40u : 16u);
    const float* far_z = planes->at + (signs & 4u ? 16u : 40u);
    const float16 ix = s->inverse[0][p], iy = s->inverse[1][p], iz = s->inverse[2][p];
    const float16 nx = s->near_shift[0][p], ny = s->near_shift[1][p], nz = s->near_shift[2][p];
    const float16 fx = s->far_shift[0][p], fy = s->far_shift[1][p], fz = s->far_shift[2][p];
    const float16 from = s->from[p];
    uint met_by_any = 0u;
    for (; children != 0u; children &= children - 1u) {
        const uint k = rp_lowest(children);
        const float16 enter_x = fma((float16)(near_x[k]), ix, nx), enter_y = fma((float16)(near_y[k]), iy, ny);
        const float16 enter_z = fma((float16)(near_z[k]), iz, nz);
        const float16 leave_x = fma((float16)(far_x[k]), ix, fx), leave_y = fma((float16)(far_y[k]), iy, fy);
        const float16 leave_z = fma((float16)(far_z[k]), iz, fz);
        // Of integers it costs one instruction, and a negative float is a negative integer.
        const float16 enter = as_float16(max(as_int16(rp_max(rp_max(enter_x, enter_y), enter_z)), as_int16(from)));
        const float16 leave = rp_min(rp_min(leave_x, leave_y), rp_min(leave_z, until)) * RP_BOX_WIDEN;
        // No branch for children that are not met: it would be mispredicted often.
        const uint meets = rp_mask16(enter <= leave) & lanes;
        met->rays[k] |= (ulong)meets << (RP_PACKET_RAYS * p);
        met_by_any |= (meets != 0u ? 1u : 0u) << k;
        if (!any_hit) met->entry[k] = rp_min(met->entry[k], rp_least16(rp_lanes16(meets) ? enter : (float16)(INFINITY)));
    }
    return met_by_any;
}

// Each of the rays against all children at once. Sets what is met, and returns the children that are.
static inline uint rp_rays_meet(const rp_stream* s, const rp_planes* planes, const float16* until, ulong rays, uint count, const bool any_hit,
                                rp_children_met* met) {
    uint8 met_low = (uint8)(0u), met_high = (uint8)(0u);  // of each child: the rays that meet it
    float8 entry = (float8)(INFINITY);
    const int8 present = (int8)(0, 1, 2, 3, 4, 5, 6, 7) < (int)count;
    do {
        const uint r = rp_lowest(rays);
        rays &= rays - 1ul;
        const uint x = RP_BYTE_OF_RAY(s->near_at[0], r), y = RP_BYTE_OF_RAY(s->near_at[1], r), z = RP_BYTE_OF_RAY(s->near_at[2], r);
        const float ix = RP_OF_RAY(s->inverse[0], r), iy = RP_OF_RAY(s->inverse[1], r), iz = RP_OF_RAY(s->inverse[2], r);
        const float8 enter_x = fma(vload8(0, planes->at + x), (float8)(ix), (float8)(RP_OF_RAY(s->near_shift[0], r)));
        const float8 enter_y = fma(vload8(0, planes->at + y), (float8)(iy), (float8)(RP_OF_RAY(s->near_shift[1], r)));
        const float8 enter_z = fma(vload8(0, planes->at + z), (float8)(iz), (float8)(RP_OF_RAY(s->near_shift[2], r)));
        const float8 leave_x = fma(vload8(0, planes->at + 24u - x), (float8)(ix), (float8)(RP_OF_RAY(s->far_shift[0], r)));
        const float8 leave_y = fma(vload8(0, planes->at + 40u - y), (float8)(iy), (float8)(RP_OF_RAY(s->far_shift[1], r)));
        const float8 leave_z = fma(vload8(0, planes->at + 56u - z), (float8)(iz), (float8)(RP_OF_RAY(s->far_shift[2], r)));
        // As above. All operands are vectors, though OpenCL takes scalars here: oclgrind reads whatever lies behind them.
        const float8 from = (float8)(RP_OF_RAY(s->from, r)), end = (float8)(RP_OF_RAY(until, r));
        const float8 enter = as_float8(max(as_int8(rp_max(rp_max(enter_x, enter_y), enter_z)), as_int8(from)));
        const float8 leave = rp_min(rp_min(leave_x, leave_y), rp_min(leave_z, end)) * RP_BOX_WIDEN;
        const int8 meets = (enter <= leave) & present;
        const ulong ray = 1ul << r;
        met_low |= as_uint8(meets) & (uint)ray;
        met_high |= as_uint8(meets) & (uint)(ray >> 32);
        if (!any_hit) entry = meets ? rp_min(entry, enter) : entry;
    } while (rays != 0ul);
    vstore8(convert_ulong8(met_low) | convert_ulong8(met_high) << 32, 0, met->rays);
    if (!any_hit) vstore8(entry, 0, met->entry);
    return rp_mask8((met_low | met_high) != 0u);
}

// One ray against all children, operation by operation as rp_rays_meet, but it leaves met->rays as they are. Most nodes that rays come to which
// have little in common are met by a single one: what is only for more than one costs as much there as the test itself.
static inline uint rp_ray_meets(const rp_stream* s, const __global rp_wide_node* node, const float16* until, ulong rays, const bool any_hit,
                                rp_children_met* met) {
    const uint r = rp_lowest(rays);
    const __global uchar* planes = node->lower[0];
    float8 enter[3], leave[3];
#pragma unroll
    for (uint a = 0u; a < 3u; a++) {
        const float cell = as_float((uint)node->exponent[a] << 23), origin = node->origin[a], inverse = RP_OF_RAY(s->inverse[a], r);
        const uint near = RP_BYTE_OF_RAY(s->near_at[a], r), far = 8u * (2u * a + RP_ROW_UPPER) - near;
        enter[a] = fma(convert_float8(vload8(0, planes + near)) * cell + origin, (float8)(inverse), (float8)(RP_OF_RAY(s->near_shift[a], r)));
        leave[a] = fma(convert_float8(vload8(0, planes + far)) * cell + origin, (float8)(inverse), (float8)(RP_OF_RAY(s->far_shift[a], r)));
    }
    const float8 from = (float8)(RP_OF_RAY(s->from, r)), end = (float8)(RP_OF_RAY(until, r));
    const float8 first = as_float8(max(as_int8(rp_max(rp_max(enter[0], enter[1]), enter[2])), as_int8(from)));
    const float8 last = rp_min(rp_min(leave[0], leave[1]), rp_min(leave[2], end)) * RP_BOX_WIDEN;
    if (!any_hit) vstore8(first, 0, met->entry);
    return rp_mask8(first <= last) & ((1u << node->count) - 1u);
}

// Returns the children that one of the rays meets between where it begins (from) and `until`: a distance of each ray, by packets.
static inline uint rp_meet_children(const rp_stream* s, const __global rp_wide_node* node, const float16* until, ulong rays, const bool any_hit,
                                    rp_children_met* met) {
    if (rp_is_single(rays)) return rp_ray_meets(s, node, until, rays, any_hit, met);
    rp_planes planes;
    rp_decode_planes(node, &planes);
    const uint count = node->count;
    if (popcount(rays) < RP_DENSE_BOXES) return rp_rays_meet(s, &planes, until, rays, count, any_hit, met);
    uint possible = (1u << count) - 1u, packets = 0u;
    if (s->signs != RP_MIXED && popcount(rays) >= RP_DENSE_STREAM) possible = rp_possible_children(s, &planes, count);
    ulong alone = 0ul;
    for (uint p = 0u; p < RP_PACKETS; p++) {
        const uint lanes = rp_lanes_of(rays, p);
        if (popcount(lanes) < RP_DENSE_BOXES || s->packet_signs[p] == RP_MIXED)
            alone |= (ulong)lanes << (RP_PACKET_RAYS * p);
        else
            packets |= 1u << p;
    }
    // What is met is told by what these return: to read it back as a vector would be to wait for eight stores.
    uint children = 0u;
    if (alone != 0ul) {
        children = rp_rays_meet(s, &planes, until, alone, count, any_hit, met);
    } else {
        vstore8((ulong8)(0ul), 0, met->rays);
        if (!any_hit) vstore8((float8)(INFINITY), 0, met->entry);
    }
    for (; packets != 0u; packets &= packets - 1u) {
        const uint p = rp_lowest(packets);
        children |= rp_packet_meets(s, &planes, p, until[p], rp_lanes_of(rays, p), possible, any_hit, met);
    }
    return children;
}

#endif
