#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "import/pbrt_reader.hpp"
#include "import/pbrt_spectra.hpp"
#include "import/text.hpp"

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
    warn_if_present(parameters, {"cropwindow", "pixelbounds"}, "the whole picture is rendered");
    RAYPAGER_TRY(film_response(directive, parameters));
    warn_of_unused(directive, type, parameters, {"filename", "diagonal", "savefp16", "displayfilename", "coordinatesystem"});
    return parameters.status();
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
