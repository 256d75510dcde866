#include "support/recorded_films.hpp"

#include <fmt/format.h>

#include <fstream>

namespace raypager::support {

std::string film_device(const std::string& name, const std::string& driver) {
    // PoCL's CPUs, whose names go on with a model: "pthread-haswell-..." of version 3, "cpu-haswell-..." of version 5.
    for (const std::string prefix : {"pthread-", "cpu-"})
        if (name.starts_with(prefix)) return name.substr(0, name.find('-', prefix.size())) + ", " + driver;
    return name + ", " + driver;
}

std::optional<uint64_t> recorded_film(const std::string& device, const std::string& scene) {
    std::ifstream file(RAYPAGER_SOURCE_DIR "/tests/golden/films.txt");
    for (std::string line; std::getline(file, line);) {
        const std::string start = device + ": " + scene + " ";
        if (line.starts_with(start)) return std::stoull(line.substr(start.size()), nullptr, 16);
    }
    return std::nullopt;
}

std::string film_line(const std::string& device, const std::string& scene, uint64_t hash) {
    return fmt::format("{}: {} {:016x}", device, scene, hash);
}

}  // namespace raypager::support
