// Lattice noise from integer hashes: smooth pseudo-random functions without period (within 2^32 cells).
#pragma once

#include <cstdint>

#include "procedural/numeric.hpp"

namespace raypager {

// Value of a smooth function in [-1, 1] and its gradient.
struct Noise2 {
    double value, dx, dz;
};
// Value noise with quintic interpolation: the second derivative is continuous. One lattice cell a unit.
Noise2 value_noise(double x, double z, uint64_t seed);

// Gradient noise (Perlin 2002) in space, about within [-1, 1].
double gradient_noise(const Vector& p, uint64_t seed);

// Sum of octaves of gradient noise, each with twice the frequency and gain times the amplitude of the one before.
double fractal_noise(const Vector& p, int octaves, double gain, uint64_t seed);

// The same with each octave folded at zero: sharp ridges, in [0, 1] about (Musgrave's ridged multifractal, without his feedback).
double ridged_noise(const Vector& p, int octaves, double gain, uint64_t seed);

}  // namespace raypager
