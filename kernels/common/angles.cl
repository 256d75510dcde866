// Angles, by polynomials instead of library functions, which each device has in its own way.
#ifndef RP_ANGLES_CL
#define RP_ANGLES_CL

#include "common/arithmetic.cl"

// Arc tangent of x in [0, 1], in quarter turns. Polynomial of Cephes (Moshier 1984); a coarser one would put directions into cells that are not
// theirs, next to a sun with a density that is far off.
static inline float rp_atan_quarters(float x) {
    const bool steep = x > 0.4142135624f;
    const float t = steep ? (x - 1.0f) / (x + 1.0f) : x, t2 = t * t;
    const float p = t + t * t2 * (-3.33329491539e-1f + t2 * (1.99777106478e-1f + t2 * (-1.38776856032e-1f + t2 * 8.05374449538e-2f)));
    return (steep ? 0.5f : 0.0f) + p * (2.0f * 0.318309886184f);
}

// The angle of (x, y) from the first axis towards the second, as a share of a turn, in [0, 1]; 1 where a float cannot say how little less it is.
static inline float rp_turns_of(float x, float y) {
    const float ax = fabs(x), ay = fabs(y), most = rp_max(ax, ay);
    const float part = rp_atan_quarters(most > 0.0f ? rp_min(ax, ay) / most : 0.0f), quarters = ay > ax ? 1.0f - part : part;
    const float half_turn = 0.25f * (x < 0.0f ? 2.0f - quarters : quarters);
    return y < 0.0f ? 1.0f - half_turn : half_turn;
}

#endif
