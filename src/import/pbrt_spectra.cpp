#include "import/pbrt_spectra.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace raypager {
namespace {

// Dominant wavelengths of the sRGB primaries, in nanometres.
constexpr std::array<double, 3> primaries = {611.4, 549.1, 464.2};

struct Named {
    std::string_view name;
    Float3 value;
};

// Metals: complex index of refraction, integrated to linear RGB. Glasses: index at the sodium line.
constexpr Named spectra[] = {
    {"Ag-eta", {0.155265f, 0.116726f, 0.138342f}}, {"Ag-k", {4.828370f, 3.122480f, 2.147036f}},   {"Al-eta", {1.657460f, 0.880369f, 0.521229f}},
    {"Al-k", {9.223869f, 6.269523f, 4.837001f}},   {"Au-eta", {0.143119f, 0.374957f, 1.442479f}}, {"Au-k", {3.983160f, 2.385721f, 1.603215f}},
    {"Cu-eta", {0.200438f, 0.924033f, 1.102212f}}, {"Cu-k", {3.912949f, 2.452848f, 2.142188f}},   {"CuZn-eta", {0.444000f, 0.527000f, 1.094000f}},
    {"CuZn-k", {3.695000f, 2.765000f, 1.829000f}}, {"BK7", {1.5168f, 1.5168f, 1.5168f}},          {"BAF10", {1.6700f, 1.6700f, 1.6700f}},
    {"FK51A", {1.4866f, 1.4866f, 1.4866f}},        {"LASF9", {1.8503f, 1.8503f, 1.8503f}},        {"F5", {1.6034f, 1.6034f, 1.6034f}},
    {"SF5", {1.6727f, 1.6727f, 1.6727f}},          {"F10", {1.6234f, 1.6234f, 1.6234f}},          {"SF10", {1.7283f, 1.7283f, 1.7283f}},
    {"F11", {1.6206f, 1.6206f, 1.6206f}},          {"SF11", {1.7847f, 1.7847f, 1.7847f}},
};

// Radiance of a black body at a wavelength, up to a factor: times the fifth power of 550 nm, which keeps the numbers near 1.
double planck(double nanometres, double kelvin) {
    const double wavelength = nanometres * 1e-9, second_radiation_constant = 1.438776877e-2;
    return std::pow(550 / nanometres, 5) / std::expm1(second_radiation_constant / (wavelength * kelvin));
}

double luminance(const std::array<double, 3>& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

using Matrix3 = std::array<double, 9>;  // row by row

Matrix3 product(const Matrix3& a, const Matrix3& b) {
    Matrix3 c = {};
    for (size_t row = 0; row < 3; ++row)
        for (size_t column = 0; column < 3; ++column)
            for (size_t i = 0; i < 3; ++i) c[3 * row + column] += a[3 * row + i] * b[3 * i + column];
    return c;
}

// Chromaticity x, y of light of so many kelvin: CIE daylight from 4000 on (of up to 25000, beyond which it hardly changes), below it a black
// body (cubic approximations by Kim et al., 2002).
std::array<double, 2> white_point(double kelvin) {
    const double t = 1000 / std::clamp(kelvin * (1.4388 / 1.4380), 1667.0, 25000.0);
    if (kelvin >= 4000) {
        const double x =
            kelvin <= 7000 ? ((-4.6070 * t + 2.9678) * t + 0.09911) * t + 0.244063 : ((-2.0064 * t + 1.9018) * t + 0.24748) * t + 0.237040;
        return {x, (-3 * x + 2.870) * x - 0.275};
    }
    const double x = ((-0.2661239 * t - 0.2343589) * t + 0.8776956) * t + 0.179910;
    const double y = kelvin < 2222 ? ((-1.1063814 * x - 1.34811020) * x + 2.18555832) * x - 0.20219683
                                   : ((-0.9549476 * x - 1.37418593) * x + 2.09137015) * x - 0.16748867;
    return {x, y};
}

std::array<double, 3> cones_of_white(const Matrix3& cones_of_xyz, const std::array<double, 2>& white) {
    const std::array<double, 3> xyz = {white[0] / white[1], 1, (1 - white[0] - white[1]) / white[1]};
    std::array<double, 3> cones = {};
    for (size_t row = 0; row < 3; ++row)
        for (size_t i = 0; i < 3; ++i) cones[row] += cones_of_xyz[3 * row + i] * xyz[i];
    return cones;
}

}  // namespace

std::optional<Float3> named_spectrum(std::string_view name) {
    std::string key(name.substr(name.find_last_of("/\\") + 1));
    for (const std::string_view prefix : {"metal-", "glass-"})
        if (key.starts_with(prefix)) key.erase(0, prefix.size());
    if (key.ends_with(".spd")) key.resize(key.size() - 4);
    std::replace(key.begin(), key.end(), '.', '-');
    for (const Named& s : spectra)
        if (s.name == key) return s.value;
    return std::nullopt;
}

Float3 blackbody_color(double kelvin) {
    const std::array<double, 3> c = {planck(primaries[0], kelvin), planck(primaries[1], kelvin), planck(primaries[2], kelvin)};
    const double y = luminance(c);
    if (!(y > 0)) return {1, 0, 0};  // too cold to compute with: all that is left is red
    return {static_cast<float>(c[0] / y), static_cast<float>(c[1] / y), static_cast<float>(c[2] / y)};
}

double luminance_of_peak_1(double kelvin) {
    constexpr double wien = 2.8977721e6;  // nanometres times kelvin
    const double peak = planck(wien / kelvin, kelvin);
    const double y = luminance({planck(primaries[0], kelvin), planck(primaries[1], kelvin), planck(primaries[2], kelvin)});
    return peak > 0 && std::isfinite(peak) && std::isfinite(y) ? y / peak : 0;
}

Float3 sampled_color(const std::vector<double>& pairs) {
    const auto at = [&](double wavelength) {
        if (pairs.size() < 2) return 0.0;
        if (wavelength <= pairs[0]) return pairs[1];
        for (size_t i = 2; i + 1 < pairs.size(); i += 2)
            if (wavelength <= pairs[i]) {
                const double span = pairs[i] - pairs[i - 2];
                return span > 0 ? std::lerp(pairs[i - 1], pairs[i + 1], (wavelength - pairs[i - 2]) / span) : pairs[i + 1];
            }
        return pairs[(pairs.size() / 2) * 2 - 1];
    };
    return {static_cast<float>(at(primaries[0])), static_cast<float>(at(primaries[1])), static_cast<float>(at(primaries[2]))};
}

std::array<float, 9> white_balance_matrix(double kelvin) {
    constexpr Matrix3 xyz_of_rgb = {0.4124564, 0.3575761, 0.1804375, 0.2126729, 0.7151522, 0.0721750, 0.0193339, 0.1191920, 0.9503041};
    constexpr Matrix3 rgb_of_xyz = {3.2404542, -1.5371385, -0.4985314, -0.9692660, 1.8760108, 0.0415560, 0.0556434, -0.2040259, 1.0572252};
    // Bradford's responses of the eye's cones.
    constexpr Matrix3 cones_of_xyz = {0.8951, 0.2664, -0.1614, -0.7502, 1.7135, 0.0367, 0.0389, -0.0685, 1.0296};
    constexpr Matrix3 xyz_of_cones = {0.9869929, -0.1470543, 0.1599627, 0.4323053, 0.5183603, 0.0492912, -0.0085287, 0.0400428, 0.9684867};
    const auto from = cones_of_white(cones_of_xyz, white_point(kelvin)), to = cones_of_white(cones_of_xyz, {0.3127, 0.3290});
    const Matrix3 scale = {to[0] / from[0], 0, 0, 0, to[1] / from[1], 0, 0, 0, to[2] / from[2]};
    const Matrix3 whole = product(rgb_of_xyz, product(xyz_of_cones, product(scale, product(cones_of_xyz, xyz_of_rgb))));
    std::array<float, 9> result;
    std::transform(whole.begin(), whole.end(), result.begin(), [](double x) { return static_cast<float>(x); });
    return result;
}

Float3 color_of_xyz(const Float3& c) {
    const Float3 rgb{3.2404542f * c.x - 1.5371385f * c.y - 0.4985314f * c.z, -0.9692660f * c.x + 1.8760108f * c.y + 0.0415560f * c.z,
                     0.0556434f * c.x - 0.2040259f * c.y + 1.0572252f * c.z};
    return {std::max(rgb.x, 0.0f), std::max(rgb.y, 0.0f), std::max(rgb.z, 0.0f)};
}

}  // namespace raypager
