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
    const auto planck = [&](double nanometres) {
        const double wavelength = nanometres * 1e-9, second_radiation_constant = 1.438776877e-2;
        // Times the fifth power of 550 nm, which cancels in the end and keeps the numbers near 1.
        return std::pow(550 / nanometres, 5) / std::expm1(second_radiation_constant / (wavelength * kelvin));
    };
    const std::array<double, 3> c = {planck(primaries[0]), planck(primaries[1]), planck(primaries[2])};
    const double y = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    if (!(y > 0)) return {1, 0, 0};  // too cold to compute with: all that is left is red
    return {static_cast<float>(c[0] / y), static_cast<float>(c[1] / y), static_cast<float>(c[2] / y)};
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

Float3 color_of_xyz(const Float3& c) {
    const Float3 rgb{3.2404542f * c.x - 1.5371385f * c.y - 0.4985314f * c.z, -0.9692660f * c.x + 1.8760108f * c.y + 0.0415560f * c.z,
                     0.0556434f * c.x - 0.2040259f * c.y + 1.0572252f * c.z};
    return {std::max(rgb.x, 0.0f), std::max(rgb.y, 0.0f), std::max(rgb.z, 0.0f)};
}

}  // namespace raypager
