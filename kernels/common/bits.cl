// Bits of masks.
#ifndef RP_BITS_CL
#define RP_BITS_CL

// Whether no more than one bit is set.
static inline bool rp_is_single(ulong mask) { return (mask & (mask - 1ul)) == 0ul; }
// Index of the lowest bit that is set. REQUIRES: mask is not 0.
static inline uint rp_lowest(ulong mask) { return (uint)popcount(~mask & (mask - 1ul)); }
static inline uint rp_lowest_bit(uint mask) { return 31u - clz(mask & -mask); }

#endif
