// Angles on RP_LANES lanes.
#include "common/begin_lanes.cl"

// Sine and cosine of u whole turns, u in [0, 1]. Polynomials of Cephes (Moshier 1984) on an eighth of a turn.
static inline void RP_NAME(rp_sincos_turns_)(RP_FLOATS u, RP_FLOATS* sine, RP_FLOATS* cosine) {
    const RP_FLOATS quarter = rint(u * 4.0f), x = (u * 4.0f - quarter) * (0.5f * RP_PI), x2 = x * x;
    const RP_FLOATS s = x + x * x2 * (-1.6666654611e-1f + x2 * (8.3321608736e-3f - x2 * 1.9515295891e-4f));
    const RP_FLOATS c = 1.0f - 0.5f * x2 + x2 * x2 * (4.166664568298827e-2f + x2 * (-1.388731625493765e-3f + x2 * 2.443315711809948e-5f));
    const RP_INTS i = RP_TO_INTS(quarter);
    const RP_INTS odd = (i & 1) != 0, down = (i & 2) != 0, left = ((i + 1) & 2) != 0;
    const RP_FLOATS a = odd ? c : s, b = odd ? s : c;
    *sine = down ? -a : a;
    *cosine = left ? -b : b;
}

#include "common/end_lanes.cl"
