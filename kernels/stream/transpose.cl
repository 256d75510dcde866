// Eight vectors of eight words as a matrix.
#ifndef RP_TRANSPOSE_CL
#define RP_TRANSPOSE_CL

// Rows to columns: word k of m[i] becomes word i of m[k]. In three steps of eight shuffles each, which is what processors have.
static inline void rp_transpose8(uint8* m) {
    uint8 a[8], b[8];
#pragma unroll
    for (uint i = 0u; i < 8u; i += 2u) {
        const uint8 p = m[i], q = m[i + 1u];
        a[i] = (uint8)(p.s0, q.s0, p.s1, q.s1, p.s4, q.s4, p.s5, q.s5);
        a[i + 1u] = (uint8)(p.s2, q.s2, p.s3, q.s3, p.s6, q.s6, p.s7, q.s7);
    }
#pragma unroll
    for (uint i = 0u; i < 8u; i += 4u) {
#pragma unroll
        for (uint odd = 0u; odd < 2u; odd++) {
            const uint8 p = a[i + odd], q = a[i + 2u + odd];
            b[i + 2u * odd] = (uint8)(p.s01, q.s01, p.s45, q.s45);
            b[i + 2u * odd + 1u] = (uint8)(p.s23, q.s23, p.s67, q.s67);
        }
    }
#pragma unroll
    for (uint i = 0u; i < 4u; i++) {
        m[i] = (uint8)(b[i].lo, b[i + 4u].lo);
        m[i + 4u] = (uint8)(b[i].hi, b[i + 4u].hi);
    }
}

#endif
