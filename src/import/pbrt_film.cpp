#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "import/pbrt_reader.hpp"
#include "import/pbrt_spectra.hpp"
#include "import/text.hpp"
#include "scene/pixel_filter.hpp"

namespace raypager {

Status PbrtReader::film(const Directive& directive) {
    std::string type;
    PbrtParameters parameters = no_parameters();
    RAYPAGER_TRY(take_type_and_parameters(type, parameters));
    if (type == "image")
        seems_version(3);
    else if (type == "rgb" || type == "gbuffer" || type == "spectral")
        seems_version(4);
    scene_.width = parameters.count("xresolution", scene_.width, 65535);
    scene_.height = parameters.count("yresolution", scene_.height, 65535);
    RAYPAGER_TRY(parameters.status());
    if (scene_.width == 0 || scene_.height == 0) return error(directive, "the picture has no pixels");
    RAYPAGER_TRY(crop(directive, parameters));
    RAYPAGER_TRY(film_response(directive, parameters));
    warn_of_unused(directive, type, parameters, {"filename", "diagonal", "savefp16", "displayfilename", "coordinatesystem"});
    return parameters.status();
}

namespace {

// Numbers of a parameter that is to have so many; empty if it has others.
template <size_t count>
std::optional<std::array<double, count>> so_many_numbers(const PbrtParameter& parameter) {
    if (parameter.numbers.size() != count) return std::nullopt;
    std::array<double, count> result;
    std::copy(parameter.numbers.begin(), parameter.numbers.end(), result.begin());
    return result;
}

}  // namespace

// A part of the film, in shares of it or in pixels: from left to right and from top to bottom. Pixels count by where they begin, as in pbrt.
Status PbrtReader::crop(const Directive& directive, const PbrtParameters& parameters) {
    crop_.reset();
    const PbrtParameter *window = parameters.find("cropwindow"), *bounds = parameters.find("pixelbounds");
    if (!window && !bounds) return {};
    const PbrtParameter& chosen = bounds ? *bounds : *window;
    if (window && bounds) warn(window->location, "Film: both \"cropwindow\" and \"pixelbounds\" are given; the latter count");
    auto numbers = so_many_numbers<4>(chosen);
    if (!numbers) return parameter_error(chosen, "expected four numbers: left, right, top, bottom");
    const double width = scene_.width, height = scene_.height;
    bool clamped = false;
    for (size_t i = 0; i < 4; ++i) {
        const double side = i < 2 ? width : height, at = bounds ? (*numbers)[i] : std::ceil((*numbers)[i] * side);
        if (at != std::floor(at)) return parameter_error(chosen, fmt::format("expected whole numbers, but one is {}", at));
        clamped = clamped || at < 0 || at > side;
        (*numbers)[i] = std::clamp(at, 0.0, side);
    }
    const auto pixel = [&](size_t i) { return static_cast<uint32_t>((*numbers)[i]); };
    const Crop crop{pixel(0), pixel(1), pixel(2), pixel(3)};
    if (crop.left >= crop.right || crop.top >= crop.bottom)
        return error(directive, fmt::format("\"{}\" leaves no pixels of the picture", chosen.name));
    if (clamped) warn(chosen.location, fmt::format("Film: \"{}\" goes beyond the picture; what is within counts", chosen.name));
    crop_ = crop;
    return {};
}

// Samples are drawn where the filter has them (raypager/scene.hpp, PixelFilter).
Status PbrtReader::pixel_filter(const Directive& directive) {
    FilterSettings filter;
    PbrtParameters parameters = no_parameters();
    RAYPAGER_TRY(take_type_and_parameters(filter.type, parameters));
    if (parameters.find({"xwidth", "ywidth", "alpha"})) seems_version(3);
    if (parameters.find({"xradius", "yradius", "sigma"})) seems_version(4);
    const auto given = [&](std::initializer_list<std::string_view> names) {
        return parameters.find(names) ? std::optional(parameters.number(names, 0)) : std::nullopt;
    };
    filter.x_radius = given({"xradius", "xwidth"});
    filter.y_radius = given({"yradius", "ywidth"});
    filter.sigma = given({"sigma"});
    filter.alpha = given({"alpha"});
    filter.b = parameters.number("B", filter.b);
    filter.c = parameters.number("C", filter.c);
    filter.tau = parameters.number("tau", filter.tau);
    RAYPAGER_TRY(parameters.status());
    warn_of_unused(directive, filter.type, parameters, {});
    filter.location = directive.location;
    filter_ = filter;
    return {};
}

// Without any, samples lie evenly in their pixel, whatever the version: version 3 says so, too, but version 4 has a gaussian then.
Status PbrtReader::set_pixel_filter() {
    if (!filter_) return {};
    using Kind = PixelFilter::Kind;
    const FilterSettings& f = *filter_;
    PixelFilter filter;
    double radius = 2;
    if (f.type == "box") {
        radius = 0.5;
    } else if (f.type == "triangle") {
        filter.kind = Kind::triangle;
    } else if (f.type == "gaussian") {
        filter.kind = Kind::gaussian;
        const bool version_3 = f.alpha || (!f.sigma && version_ == 3);
        radius = version_3 ? 2 : 1.5;
        const double sigma = f.sigma.value_or(0.5);
        filter.first = static_cast<float>(version_3 ? f.alpha.value_or(2) : 1 / (2 * sigma * sigma));
    } else if (f.type == "mitchell") {
        filter.kind = Kind::mitchell;
        filter.first = static_cast<float>(f.b);
        filter.second = static_cast<float>(f.c);
    } else if (f.type == "sinc") {
        filter.kind = Kind::sinc;
        radius = 4;
        filter.first = static_cast<float>(f.tau);
    } else {
        warn(f.location, fmt::format("PixelFilter \"{}\" is not supported; pixels are averaged with a box filter", clipped(f.type)));
        return {};
    }
    filter.radius_x = static_cast<float>(f.x_radius.value_or(radius));
    filter.radius_y = static_cast<float>(f.y_radius.value_or(radius));
    if (const Status good = check_filter(filter); !good.ok()) return good.at(f.location.with_line() + ": PixelFilter");
    if (filter.kind == Kind::sinc)
        warn(f.location, "PixelFilter \"sinc\" is not supported; its main lobe is used");
    else if (has_negative_lobes(filter))
        warn(f.location, fmt::format("PixelFilter \"{}\" has negative lobes; they are left out, so pictures are less sharp", f.type));
    scene_.filter = filter;
    return {};
}

// Version 3: samples of more than maxsampleluminance are cut, then all is scaled. Version 4: a sensor that turns radiance into numbers, times
// exposure time * iso / 100, and a limit on these numbers; only the sensor cie1931, whose numbers are XYZ, is known here.
Status PbrtReader::film_response(const Directive& directive, const PbrtParameters& parameters) {
    FilmSettings film;
    film.scale = parameters.number("scale", 1);
    film.max_luminance = parameters.number("maxsampleluminance", FilmResponse::no_limit);
    film.iso = parameters.number("iso", 100);
    film.max_component = parameters.number("maxcomponentvalue", FilmResponse::no_limit);
    if (parameters.find("exposuretime")) film.exposure_time = parameters.number("exposuretime", 1);
    if (parameters.find("imagingratio")) film.imaging_ratio = parameters.number("imagingratio", 1);
    film.white_balance = parameters.number("whitebalance", 0);
    const std::string sensor = parameters.text("sensor", "cie1931");
    RAYPAGER_TRY(parameters.status());
    if (sensor != "cie1931") warn(directive.location, fmt::format("Film: the sensor \"{}\" is not supported; cie1931 is used", clipped(sensor)));
    for (const double x : {film.scale, film.iso, film.exposure_time.value_or(1), film.imaging_ratio.value_or(1)})
        if (!(x > 0) || !std::isfinite(static_cast<float>(x)))
            return error(directive, fmt::format("scale, iso, exposuretime and imagingratio must be more than 0, but one is {}", x));
    for (const double x : {film.max_luminance, film.max_component})
        if (!(x > 0)) return error(directive, fmt::format("a limit of samples must be more than 0, but it is {}", x));
    if (film.white_balance != 0 && !(film.white_balance >= 1000 && film.white_balance <= 1e6))
        return error(directive, fmt::format("whitebalance is a temperature from 1000 to 1000000 kelvin, not {}", film.white_balance));
    film.location = directive.location;
    film_ = film;
    return {};
}

// What camera and film together make of radiance.
Status PbrtReader::set_film_response() {
    double ratio = film_.iso / 100;
    // The shutter exposes in version 4 alone.
    const double open = camera_ && version_ != 3 ? camera_->shutter_seconds : 1;
    ratio *= film_.exposure_time.value_or(open);
    if (film_.imaging_ratio) ratio = *film_.imaging_ratio;
    const double exposure = ratio * film_.scale;
    scene_.film.exposure = static_cast<float>(exposure);
    if (!(scene_.film.exposure > 0) || !std::isfinite(scene_.film.exposure))
        return Status::failed(fmt::format("{}: the film's exposure of {} cannot be computed with", film_.location.with_line(), exposure));
    scene_.film.max_luminance = static_cast<float>(film_.max_luminance);
    scene_.film.max_xyz = static_cast<float>(film_.max_component / ratio);
    if (!(scene_.film.max_luminance > 0) || !(scene_.film.max_xyz > 0))
        return Status::failed(fmt::format("{}: the film's limit of samples is too small to compute with", film_.location.with_line()));
    if (film_.white_balance != 0) scene_.film.color_matrix = white_balance_matrix(film_.white_balance);
    return {};
}

}  // namespace raypager
