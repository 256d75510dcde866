// Films that were recorded, by kind of device and scene: tests/golden/films.txt.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace raypager::support {

// What decides about the last bits of a film on a device: its name without the model of the processor, which PoCL appends to the instruction set that
// it compiles for, and its driver.
std::string film_device(const std::string& name, const std::string& driver);
std::optional<uint64_t> recorded_film(const std::string& device, const std::string& scene);
std::string film_line(const std::string& device, const std::string& scene, uint64_t hash);

}  // namespace raypager::support
