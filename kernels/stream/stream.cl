// A stream: up to 64 rays that one work-item takes through the scene together, for CPUs. What is read of the tree is decoded once for all
// rays that meet it. Sixteen neighbouring rays form a packet, which is tested at once where enough of its rays take part.
//
// Planes and rays. A plane of a wide node lies at p, exactly (abi/wide.h). The ray reaches it at (p - o) / d; computed is
// fma(p, r, shift) with r the rounded reciprocal and shift = -o r, moved by 2^-22 |o r| towards an earlier entry or a later exit. That
// covers the roundings of the product (2^-24) and of the shift itself (2^-23 of it). So the entry is at most (p - o) r, rounded once,
// and r differs by a factor 1 + 2^-24 from the exact reciprocal. RP_BOX_WIDEN covers both roundings, and those of the distance that a
// primitive's test returns, which is between crossings (p' - o) r, rounded twice, of planes p' of the primitive's own bounds, the last
// of which is in front of the ray (rp_in_bounds_). That a ray which the test of a primitive accepts meets its bounds at all holds up to roundings of
// the test, some 2^-22 of the coordinates of the primitive relative to the ray's origin: along an axis that moves crossings by as much of themselves
// (RP_BOX_WIDEN again), or, where the primitive reaches behind the origin, by as much of its extent: RP_WIDE_SLACK_OF_EXTENT.
// tests/property/wide_boxes tries to refute all this.
#ifndef RP_STREAM_CL
#define RP_STREAM_CL

#include "common/box.cl"
#include "stream/vector.cl"
#include "raypager/abi/wide.h"

#define RP_PACKETS 4u
#define RP_PACKET_RAYS 16u
#define RP_STREAM_RAYS 64u
// Streams that a work-item traces in turn.
#ifndef RP_WALKS
#define RP_WALKS 4
#endif
#define RP_MIXED 255u  // the rays of a packet differ

// Arrays of packets: value of ray r in lane r % 16 of packet r / 16.
typedef struct rp_stream {
    float16 origin[3][RP_PACKETS], direction[3][RP_PACKETS], inverse[3][RP_PACKETS];
    float16 near_shift[3][RP_PACKETS], far_shift[3][RP_PACKETS];
    float16 shear[2][RP_PACKETS];                      // see rp_shear
    float16 t[RP_PACKETS];                             // closest hit so far, or the ray's end
    uint16 primitive[RP_PACKETS];                      // hit so far
    uint16 hit_low[RP_PACKETS], hit_high[RP_PACKETS];  // address of the leaf in which this launch found it, plus the primitive's number in it; or 0
    uchar16 axis[RP_PACKETS];                          // the one that Woop's test calls z
    uchar16 near_at[3][RP_PACKETS];                    // which row of rp_planes is the near one of an axis
    uchar packet_axis[RP_PACKETS], packet_signs[RP_PACKETS];  // of all rays of the packet, or RP_MIXED
    // Of all rays: signs or RP_MIXED, and bounds of origins and reciprocals.
    uint signs;
    float min_origin[3], greatest_origin[3], min_inverse[3], greatest_inverse[3];
    ulong active;   // rays that are still to be traced
    ulong resumed;  // rays that had waited at a block entry: they go on from there
    ulong stopped;  // rays that met an absent block
#ifdef RP_CUTOUTS
    ulong met_cutout;  // shadow rays that met something that may be nothing, and nothing else so far
    uint tested;       // of the leaf that is visited, the primitives that are looked at, as bits
#endif
    // Places in a ray's order of visits: the distance at which it enters a block entry's bounds, and the block entry. See stream/traverse.cl.
    float16 from[RP_PACKETS], wait[RP_PACKETS];
    uint16 from_block_entry[RP_PACKETS], wait_block_entry[RP_PACKETS];
#ifdef RP_INSTANCES
    uint16 number[RP_PACKETS];                                           // of the instance of the closest hit + 1; 0: in the world
    uint16 hit_instance_low[RP_PACKETS], hit_instance_high[RP_PACKETS];  // address of its record, of a hit in this launch; or 0
    float16 start[RP_PACKETS];                                           // how far along the ray in the world this one begins
    // Of a stream inside an instance: its number + 1 and its record; 0: in the world.
    uint instance_number;
    ulong instance;
#endif
} rp_stream;

// Distance along the ray in the world.
#ifdef RP_INSTANCES
#define RP_IN_WORLD(stream, r, t) ((t) + RP_OF_RAY((stream)->start, r))
#define RP_PACKET_IN_WORLD(stream, p, t) ((t) + (stream)->start[p])
#else
#define RP_IN_WORLD(stream, r, t) (t)
#define RP_PACKET_IN_WORLD(stream, p, t) (t)
#endif

#define RP_OF_RAY(packets, r) (((const float*)(packets))[r])
#define RP_BYTE_OF_RAY(packets, r) (((const uchar*)(packets))[r])
#define RP_SET_OF_RAY(packets, r, value) (((float*)(packets))[r] = (value))

// Of the rays, those of a packet.
static inline uint rp_lanes_of(ulong rays, uint p) { return (uint)(rays >> (RP_PACKET_RAYS * p)) & 0xffffu; }

// Rows of eight: the lower planes of x, y, z, then the upper ones.
#define RP_ROW_UPPER 3u

static inline float16 rp_safe_reciprocal16(float16 x) { return 1.0f / (fabs(x) < 1e-18f ? copysign((float16)(1e-18f), x) : x); }

static inline uint rp_common(uchar16 values) {
    const ulong2 differences = as_ulong2(values ^ (uchar16)(values.s0));
    return (differences.x | differences.y) != 0ul ? RP_MIXED : values.s0;
}

// Derives the rest from the origins and directions of a packet's rays; none has waited.
static inline void rp_prepare_packet(rp_stream* s, uint p) {
    uchar16 signs = (uchar16)(0);
    for (uint a = 0u; a < 3u; a++) {
        const float16 inverse = rp_safe_reciprocal16(s->direction[a][p]);
        const float16 shift = s->origin[a][p] * inverse, slack = fabs(shift) * 0x1p-22f;
        s->inverse[a][p] = inverse;
        s->near_shift[a][p] = -shift - slack;
        s->far_shift[a][p] = slack - shift;
        const uchar16 negative = convert_uchar16(as_uint16(inverse) >> 31);
        s->near_at[a][p] = (uchar16)((uchar)(8u * a)) + negative * (uchar)(8u * RP_ROW_UPPER);
        signs |= negative << (uchar)a;
    }
    const float16 x = s->direction[0][p], y = s->direction[1][p], z = s->direction[2][p];
    const float16 mx = fabs(x), my = fabs(y), mz = fabs(z);
    const int16 along_x = mx >= rp_max(my, mz), along_y = my >= mz;  // where not along x
    const float16 shear_z = along_x ? s->inverse[0][p] : along_y ? s->inverse[1][p] : s->inverse[2][p];
    s->shear[0][p] = (along_x ? y : along_y ? z : x) * shear_z;
    s->shear[1][p] = (along_x ? z : along_y ? x : y) * shear_z;
    const int16 axis = along_x ? (int16)(0) : along_y ? (int16)(1) : (int16)(2);
    s->axis[p] = convert_uchar16(axis);
    s->packet_signs[p] = rp_common(signs);
    s->packet_axis[p] = rp_common(s->axis[p]);
    s->hit_low[p] = s->hit_high[p] = (uint16)(0u);
    s->from[p] = (float16)(0.0f);
    s->from_block_entry[p] = (uint16)(0u);
    s->wait[p] = (float16)(INFINITY);
    s->wait_block_entry[p] = (uint16)(RP_NONE);
#ifdef RP_INSTANCES
    s->hit_instance_low[p] = s->hit_instance_high[p] = (uint16)(0u);
#endif
}

// The same of all packets, and of the stream. All 64 rays must be there; those that are not used repeat others.
static inline void rp_prepare_stream(rp_stream* s) {
    for (uint p = 0u; p < RP_PACKETS; p++) rp_prepare_packet(s, p);
    s->stopped = s->resumed = 0ul;
    s->signs = s->packet_signs[0];
    for (uint p = 1u; p < RP_PACKETS; p++)
        if (s->packet_signs[p] != s->signs) s->signs = RP_MIXED;
    if (s->signs == RP_MIXED) return;
    for (uint a = 0u; a < 3u; a++) {
        const float16* o = s->origin[a];
        const float16* i = s->inverse[a];
        s->min_origin[a] = rp_least16(rp_min(rp_min(o[0], o[1]), rp_min(o[2], o[3])));
        s->greatest_origin[a] = rp_greatest16(rp_max(rp_max(o[0], o[1]), rp_max(o[2], o[3])));
        s->min_inverse[a] = rp_least16(rp_min(rp_min(i[0], i[1]), rp_min(i[2], i[3])));
        s->greatest_inverse[a] = rp_greatest16(rp_max(rp_max(i[0], i[1]), rp_max(i[2], i[3])));
    }
}

static inline bool rp_hit_in_launch(const rp_stream* s, uint r) { return (((const uint*)s->hit_low)[r] | ((const uint*)s->hit_high)[r]) != 0u; }
static inline ulong rp_hit_place(const rp_stream* s, uint r) { return (ulong)((const uint*)s->hit_high)[r] << 32 | ((const uint*)s->hit_low)[r]; }
static inline const __global rp_wide_leaf* rp_hit_leaf(const rp_stream* s, uint r) {
    return (const __global rp_wide_leaf*)(rp_hit_place(s, r) & ~15ul);
}
static inline uint rp_hit_number(const rp_stream* s, uint r) { return (uint)rp_hit_place(s, r) & 15u; }
#ifdef RP_INSTANCES
static inline const __global rp_instance* rp_hit_instance(const rp_stream* s, uint r) {
    return (const __global rp_instance*)((ulong)((const uint*)s->hit_instance_high)[r] << 32 | ((const uint*)s->hit_instance_low)[r]);
}
#endif

// What a work-item has taken of a queue of rays, cut into streams. It takes a few neighbouring streams at a time, and more when it is through
// with them: some streams are a hundred times as dear as others, and drivers give half of all work-items to the first of two cores at once.
#define RP_STREAMS_TAKEN 8u
typedef struct rp_share {
    uint next, end, streams, each, rays;
} rp_share;

static inline rp_share rp_share_of(uint rays) {
    rp_share share;
    share.next = share.end = 0u;
    share.rays = rays;
    share.streams = (rays + RP_STREAM_RAYS - 1u) / RP_STREAM_RAYS;
    share.each = clamp(share.streams / (16u * (uint)get_global_size(0)), 1u, RP_STREAMS_TAKEN);
    return share;
}

// How many rays the next stream has, and where in the queue it begins; 0: there is none. taken: streams of the queue that work-items have
// taken.
static inline uint rp_next_stream(rp_share* share, volatile __global uint* taken, uint* first) {
    if (share->next == share->end) {
        share->next = min(atomic_add(taken, share->each), share->streams);
        share->end = min(share->next + share->each, share->streams);
        if (share->next == share->end) return 0u;
    }
    *first = share->next++ * RP_STREAM_RAYS;
    return min(share->rays - *first, RP_STREAM_RAYS);
}

// The stream that the work-item will take next, as rp_next_stream; 0: not known yet.
static inline uint rp_expected_stream(const rp_share* share, uint* first) {
    if (share->next == share->end) return 0u;
    *first = share->next * RP_STREAM_RAYS;
    return min(share->rays - *first, RP_STREAM_RAYS);
}

#endif
