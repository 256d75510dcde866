#include "procedural/heightmap.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "raypager/picture.hpp"

namespace raypager {
namespace {

constexpr float lowest_height = -12000;  // below the deepest sea floor

bool is_void(float height) { return !std::isfinite(height) || height < lowest_height; }

// The mean of the neighbours of a pixel that have a height; NaN if there are none.
float neighbour_mean(const Heightmap& map, uint32_t x, uint32_t y) {
    double sum = 0;
    int count = 0;
    for (uint32_t v = y > 0 ? y - 1 : 0; v <= std::min(y + 1, map.height - 1); v++)
        for (uint32_t u = x > 0 ? x - 1 : 0; u <= std::min(x + 1, map.width - 1); u++) {
            const float height = map.values[size_t{v} * map.width + u];
            if (is_void(height)) continue;
            sum += height;
            count++;
        }
    return count > 0 ? static_cast<float>(sum / count) : NAN;
}

// Voids shrink by one pixel from their borders in each pass; a pass looks only at the pixels that are still void.
// REQUIRES: at least one pixel has a height.
void fill_voids(Heightmap& map, std::vector<size_t> voids) {
    while (!voids.empty()) {
        std::vector<std::pair<size_t, float>> filled;
        std::vector<size_t> left;
        for (const size_t at : voids) {
            const float height = neighbour_mean(map, static_cast<uint32_t>(at % map.width), static_cast<uint32_t>(at / map.width));
            if (is_void(height))
                left.push_back(at);
            else
                filled.emplace_back(at, height);
        }
        for (const auto& [at, height] : filled) map.values[at] = height;
        voids = std::move(left);
    }
}

double interpolate(const Heightmap& map, double x, double y) {
    x = std::clamp(x, 0.0, map.width - 1.0);
    y = std::clamp(y, 0.0, map.height - 1.0);
    const auto column = std::min(static_cast<size_t>(x), size_t{map.width} - 2), row = std::min(static_cast<size_t>(y), size_t{map.height} - 2);
    const double u = x - static_cast<double>(column), v = y - static_cast<double>(row);
    const float* at = &map.values[row * map.width + column];
    return (1 - v) * ((1 - u) * at[0] + u * at[1]) + v * ((1 - u) * at[map.width] + u * at[map.width + 1]);
}

}  // namespace

Result<Heightmap> read_heightmap(const std::filesystem::path& path) {
    auto image = read_image(path, true);
    if (!image) return image.status();
    if (image->width < 2 || image->height < 2)
        return Status::failed(fmt::format("{}: has {} x {} pixels; a height map needs at least 2 x 2", path.string(), image->width, image->height));
    Heightmap map{image->width, image->height, image->width == 1201 ? 90.0 : 30.0, {}};
    map.values.resize(size_t{map.width} * map.height);
    std::vector<size_t> voids;
    for (size_t i = 0; i < map.values.size(); i++) {
        map.values[i] = image->values[i * image->channels];
        if (is_void(map.values[i])) voids.push_back(i);
    }
    if (voids.size() == map.values.size()) return Status::failed(fmt::format("{}: has no heights, only voids", path.string()));
    fill_voids(map, std::move(voids));
    return map;
}

HeightField field_of(const Heightmap& map, uint64_t triangles) {
    HeightField field;
    field.columns = map.width - 1;
    field.rows = map.height - 1;
    if (triangles > 0) {
        const double aspect = static_cast<double>(field.columns) / static_cast<double>(field.rows);
        field.columns = std::max<uint64_t>(1, static_cast<uint64_t>(std::sqrt(static_cast<double>(triangles) / 2 * aspect)));
        field.rows = std::max<uint64_t>(1, triangles / 2 / field.columns);
    }
    const double scale_x = (map.width - 1.0) / static_cast<double>(field.columns), scale_z = (map.height - 1.0) / static_cast<double>(field.rows);
    field.spacing_x = map.spacing * scale_x;
    field.spacing_z = map.spacing * scale_z;
    field.height = [&map, scale_x, scale_z](double column, double row) { return interpolate(map, column * scale_x, row * scale_z); };
    return field;
}

}  // namespace raypager
