// Spectra as the three colours that the engine computes with.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "raypager/scene.hpp"

namespace raypager {

// A named spectrum of pbrt-v4 ("metal-Cu-eta", "glass-BK7"), or the file name of one of v3 ("spds/Cu.eta.spd").
std::optional<Float3> named_spectrum(std::string_view name);
// Light of a black body of so many kelvin, scaled to luminance 1 (source: Planck's law at the three primaries' wavelengths).
Float3 blackbody_color(double kelvin);
// Luminance of such light if its spectrum is scaled to 1 at its peak, wherever that is (pbrt-v3).
double luminance_of_peak_1(double kelvin);
// Pairs of wavelength in nanometres and value, by rising wavelength: interpolated at the three primaries' wavelengths.
Float3 sampled_color(const std::vector<double>& pairs);
// Makes light of a black body or daylight of so many kelvin white, by Bradford's method as pbrt-v4's sensors do: a matrix on linear sRGB.
std::array<float, 9> white_balance_matrix(double kelvin);
Float3 color_of_xyz(const Float3& xyz);  // linear sRGB, negative parts cut off

}  // namespace raypager
