// Colours of pbrt: of numbers, spectra and temperatures.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/files.hpp"
#include "import/pbrt_reader.hpp"
#include "import/pbrt_spectra.hpp"
#include "import/text.hpp"

namespace raypager {
namespace {

constexpr uint64_t largest_spectrum_file = uint64_t{1} << 24;

bool usable(const Float3& c) {
    for (const float x : {c.x, c.y, c.z})
        if (!std::isfinite(x) || x < 0) return false;
    return true;
}

// Pairs of wavelength and value, in whatever lines; the rest of a line behind # is a comment.
Status read_spectrum_file(const std::filesystem::path& path, std::vector<double>& pairs) {
    auto text = read_text(path, largest_spectrum_file);
    if (!text) return text.status();
    size_t line_number = 0;
    const size_t begin = text->starts_with("\xef\xbb\xbf") ? 3 : 0;  // a byte order mark
    for (size_t at = begin; at < text->size(); ++line_number) {
        const size_t end = std::min(text->find_first_of("\r\n", at), text->size());
        std::string_view line = std::string_view(*text).substr(at, end - at);
        for (const std::string_view word : split_words(line.substr(0, line.find('#')))) {
            const auto number = parse_number(word);
            if (!number || !std::isfinite(*number))
                return Status::failed(fmt::format("{}:{}: expected a number instead of \"{}\"", path.string(), line_number + 1, clipped(word)));
            pairs.push_back(*number);
        }
        at = end + (text->compare(end, 2, "\r\n") == 0 ? 2 : 1);
    }
    if (pairs.empty() || pairs.size() % 2 != 0)
        return Status::failed(fmt::format("{}: expected pairs of wavelength and value, but it has {} numbers", path.string(), pairs.size()));
    return {};
}

}  // namespace

// A spectrum by name: a file beside the scene, or one that pbrt knows.
Status PbrtReader::named_color(const PbrtParameter& p, const Float3& fallback, Float3& result) {
    std::filesystem::path path;
    bool exists = false;
    const std::string& name = p.strings[0];
    if (const Status found = find_file(name, path, exists); !found.ok()) return parameter_error(p, found.message());
    std::error_code ignored;
    if (exists && std::filesystem::is_regular_file(path, ignored)) {
        std::vector<double> pairs;
        if (const Status read = read_spectrum_file(path, pairs); !read.ok()) return read;
        if (listed_files_.insert(path.string()).second) scene_.files.push_back(path.string());
        warn(p.location, "sampled spectra are approximated by three colours");
        result = sampled_color(pairs);
        return {};
    }
    const auto known = named_spectrum(name);
    if (!known)
        warn(p.location, fmt::format("the spectrum \"{}\" is neither known nor a file here; \"{}\" stays at its default", clipped(name), p.name));
    result = known.value_or(fallback);
    return {};
}

Status PbrtReader::blackbody_parameter(const PbrtParameter& p, Float3& result) {
    if (!(p.numbers[0] > 0)) return parameter_error(p, "expected a temperature of more than 0 kelvin");
    warn(p.location, "blackbody spectra are approximated by three colours");
    // Version 3 has a scale, and spectra whose peak is 1, wherever that is; version 4 has a luminance of 1.
    const bool version_3 = p.numbers.size() > 1 && version_ != 4;
    const auto scale = static_cast<float>((p.numbers.size() > 1 ? p.numbers[1] : 1) * (version_3 ? luminance_of_peak_1(p.numbers[0]) : 1));
    const Float3 c = blackbody_color(p.numbers[0]);
    result = {scale * c.x, scale * c.y, scale * c.z};
    return {};
}

Status PbrtReader::parameter_color(const PbrtParameter& p, const Float3& fallback, Float3& result) {
    const auto& v = p.numbers;
    const auto f = [&](size_t i) { return static_cast<float>(v[i]); };
    result = fallback;
    if (p.type == "texture" && p.strings.size() == 1) {
        const auto texture = textures_.spectra.find(p.strings[0]);
        if (texture == textures_.spectra.end()) {
            warn(p.location, fmt::format("there is no spectrum texture \"{}\"; \"{}\" stays at its default", clipped(p.strings[0]), clipped(p.name)));
            return {};
        }
        if (!texture->second.fault.ok()) return texture->second.fault;
        if (!texture->second.value.is_constant() || texture->second.approximated)
            warn(texture->second.location, texture_approximation(texture->second.type, p.name));
        result = texture->second.value.mean();
    } else if (p.strings.size() == 1) {
        RAYPAGER_TRY(named_color(p, fallback, result));
    } else if (p.type == "blackbody" && !v.empty()) {
        RAYPAGER_TRY(blackbody_parameter(p, result));
    } else if (p.type == "xyz" && v.size() == 3) {
        result = color_of_xyz({f(0), f(1), f(2)});
    } else if (v.size() == 1) {
        result = {f(0), f(0), f(0)};
    } else if (p.type == "spectrum" && v.size() % 2 == 0 && !v.empty()) {
        warn(p.location, "sampled spectra are approximated by three colours");
        result = sampled_color(v);
    } else if (v.size() == 3) {
        result = {f(0), f(1), f(2)};
    } else {
        return parameter_error(p, "expected one colour");
    }
    return usable(result) ? Status() : parameter_error(p, "expected values that are finite and 0 or more");
}

Status PbrtReader::color(const PbrtParameters& parameters, std::initializer_list<std::string_view> names, const Float3& fallback, Float3& result) {
    result = fallback;
    const PbrtParameter* p = parameters.find(names);
    return p ? parameter_color(*p, fallback, result) : Status();
}

}  // namespace raypager
