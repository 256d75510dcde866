// Sines and cosines on RP_LANES lanes; between begin_lanes.cl and end_lanes.cl, as often as one likes.
#if (RP_LANES == 1 && !defined(RP_HAS_TURNS_1)) || (RP_LANES == 8 && !defined(RP_HAS_TURNS_8)) || (RP_LANES == 16 && !defined(RP_HAS_TURNS_16))
#if RP_LANES == 1
#define RP_HAS_TURNS_1
#elif RP_LANES == 8
#define RP_HAS_TURNS_8
#else
#define RP_HAS_TURNS_16
#endif

#ifndef RP_PI
#define RP_PI 3.14159265359f
#endif

// Sine and cosine of u whole turns, u in [-1, 2]. Polynomials of Cephes (Moshier 1984) on an eighth of a turn.
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

#endif
