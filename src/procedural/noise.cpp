#include "procedural/noise.hpp"

#include <cmath>

namespace raypager {
namespace {

uint64_t lattice_hash(int64_t x, int64_t y, int64_t z, uint64_t seed) {
    uint64_t h = seed ^ static_cast<uint64_t>(x) * 0x9e3779b97f4a7c15u ^ static_cast<uint64_t>(y) * 0xc2b2ae3d27d4eb4fu;
    h = mix_bits(h ^ static_cast<uint64_t>(z) * 0x165667b19e3779f9u);
    return h;
}

double signed_unit(uint64_t hash) { return static_cast<double>(static_cast<int64_t>(hash) >> 11) * 0x1p-52; }

double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }
double fade_slope(double t) { return 30 * t * t * (t * (t - 2) + 1); }
double mix(double a, double b, double t) { return a + (b - a) * t; }

// Dot product with one of the twelve edge directions of a cube (four of them twice).
double edge_gradient(uint64_t hash, double x, double y, double z) {
    const unsigned h = static_cast<unsigned>(hash >> 60);
    const double u = h < 8 ? x : y;
    const double v = h < 4 ? y : h == 12 || h == 14 ? x : z;
    return ((h & 1) != 0 ? -u : u) + ((h & 2) != 0 ? -v : v);
}

}  // namespace

Noise2 value_noise(double x, double z, uint64_t seed) {
    const double fx = std::floor(x), fz = std::floor(z);
    const auto ix = static_cast<int64_t>(fx), iz = static_cast<int64_t>(fz);
    const double tx = x - fx, tz = z - fz;
    const double a = signed_unit(lattice_hash(ix, 0, iz, seed)), b = signed_unit(lattice_hash(ix + 1, 0, iz, seed));
    const double c = signed_unit(lattice_hash(ix, 0, iz + 1, seed)), d = signed_unit(lattice_hash(ix + 1, 0, iz + 1, seed));
    const double u = fade(tx), v = fade(tz), twist = a - b - c + d;
    return {a + (b - a) * u + (c - a) * v + twist * u * v, fade_slope(tx) * (b - a + twist * v), fade_slope(tz) * (c - a + twist * u)};
}

double gradient_noise(const Vector& p, uint64_t seed) {
    const double fx = std::floor(p[0]), fy = std::floor(p[1]), fz = std::floor(p[2]);
    const auto ix = static_cast<int64_t>(fx), iy = static_cast<int64_t>(fy), iz = static_cast<int64_t>(fz);
    const double x = p[0] - fx, y = p[1] - fy, z = p[2] - fz;
    const auto corner = [&](int dx, int dy, int dz) { return edge_gradient(lattice_hash(ix + dx, iy + dy, iz + dz, seed), x - dx, y - dy, z - dz); };
    const double u = fade(x), v = fade(y), w = fade(z);
    return mix(mix(mix(corner(0, 0, 0), corner(1, 0, 0), u), mix(corner(0, 1, 0), corner(1, 1, 0), u), v),
               mix(mix(corner(0, 0, 1), corner(1, 0, 1), u), mix(corner(0, 1, 1), corner(1, 1, 1), u), v), w);
}

double fractal_noise(const Vector& p, int octaves, double gain, uint64_t seed) {
    double sum = 0, amplitude = 1, frequency = 1;
    for (int octave = 0; octave < octaves; octave++) {
        sum += amplitude * gradient_noise(p * frequency, seed + static_cast<uint64_t>(octave));
        amplitude *= gain;
        frequency *= 2;
    }
    return sum;
}

double ridged_noise(const Vector& p, int octaves, double gain, uint64_t seed) {
    double sum = 0, amplitude = 1, total = 0, frequency = 1;
    for (int octave = 0; octave < octaves; octave++) {
        const double ridge = 1 - std::abs(gradient_noise(p * frequency, seed + static_cast<uint64_t>(octave)));
        sum += amplitude * ridge * ridge;
        total += amplitude;
        amplitude *= gain;
        frequency *= 2;
    }
    return sum / total;
}

}  // namespace raypager
