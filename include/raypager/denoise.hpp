// Pictures without noise, by Intel's Open Image Denoise (openimagedenoise.org), major version 1 or 2: a shared library that is looked for when it is
// first needed. Where it is not installed, an error says what to install.
#pragma once

#include <filesystem>
#include <string>

#include "raypager/picture.hpp"
#include "raypager/status.hpp"

namespace raypager {

struct Denoiser {
    std::filesystem::path library;  // where it lies
    std::string version;            // "2.5.1"
};

// Whether pictures can be denoised here; to be asked before a long render. The library is the file that is named; or else the one that the
// environment variable RAYPAGER_OIDN names; or else what the dynamic linker finds as libOpenImageDenoise.so; or else the one in Python's package
// pyoidn, in the virtual environment that is active, or where pip installs for a user or for all. An error of the kind "failed": there is none, or it
// does not work.
Result<Denoiser> find_denoiser(const std::filesystem::path& library = {});

struct DenoiseOptions {
    std::filesystem::path library;  // empty: looked for
    // Albedo and normal are taken with the noise that they have. Takes a seventh of the time; small details and lamps get less sharp.
    bool fast = false;
};

// What a render shows, in linear light before any exposure, and what helps to tell edges from noise: FilmLayer::albedo and FilmLayer::normal of the
// same render, which are three channels each. A normal needs an albedo beside it. Of four channels the last, alpha, stays as it is. Values that are
// negative or NaN count as 0, infinite ones as the largest float; albedos are brought to 0 to 1, normals to -1 to 1. Runs on the CPU, with all of its
// cores, of which one would take some 20 seconds for a million pixels: memory of the device is the render's. Main memory: 60 bytes a pixel beside
// what it is given, and what the library takes, up to 3 GiB for large pictures. Usage error: channels or sizes that do not fit; otherwise as
// find_denoiser(), or with what the library says.
Result<Image> denoise(const Image& picture, const Image* albedo = nullptr, const Image* normal = nullptr, const DenoiseOptions& options = {});

}  // namespace raypager
