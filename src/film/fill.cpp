#include "film/fill.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

#include "base/check.hpp"

namespace raypager {
namespace {

using Color = std::array<float, 4>;  // what an image of three channels lacks is 0

// A picture of half the size of the one before it. Cells without any sample in them are not known.
struct Level {
    size_t width = 0, height = 0;
    std::vector<Color> colors;
    std::vector<bool> known;

    Level(size_t w, size_t h) : width(w), height(h), colors(w * h), known(w * h) {}
};

// Averages of those that are known among each four cells of a picture.
template <class Known, class ColorOf>
Level halved(size_t width, size_t height, const Known& known, const ColorOf& color) {
    Level half((width + 1) / 2, (height + 1) / 2);
    for (size_t y = 0; y < half.height; y++)
        for (size_t x = 0; x < half.width; x++) {
            Color sum = {};
            float count = 0;
            for (size_t j = 2 * y; j < std::min(2 * y + 2, height); j++)
                for (size_t i = 2 * x; i < std::min(2 * x + 2, width); i++) {
                    if (!known(j * width + i)) continue;
                    const Color value = color(j * width + i);
                    for (size_t c = 0; c < std::tuple_size_v<Color>; c++) sum[c] += value[c];
                    count++;
                }
            if (count == 0) continue;
            for (size_t c = 0; c < std::tuple_size_v<Color>; c++) half.colors[y * half.width + x][c] = sum[c] / count;
            half.known[y * half.width + x] = true;
        }
    return half;
}

// Between the four cells around the centre of cell (x, y) of the picture that has twice the size, all of which are known.
Color between(const Level& half, size_t x, size_t y) {
    const auto neighbours = [](size_t at, size_t size) {
        const size_t near = at / 2, far = at % 2 ? std::min(near + 1, size - 1) : near > 0 ? near - 1 : 0;
        return std::array<size_t, 2>{near, far};
    };
    constexpr float weights[2] = {0.75f, 0.25f};
    const auto columns = neighbours(x, half.width), rows = neighbours(y, half.height);
    Color sum = {};
    for (size_t j = 0; j < 2; j++)
        for (size_t i = 0; i < 2; i++)
            for (size_t c = 0; c < std::tuple_size_v<Color>; c++)
                sum[c] += weights[i] * weights[j] * half.colors[rows[j] * half.width + columns[i]][c];
    return sum;
}

bool all_known(const Level& level) { return std::find(level.known.begin(), level.known.end(), false) == level.known.end(); }

}  // namespace

void fill_unsampled(Image& image, const std::vector<bool>& unsampled) {
    const size_t width = image.width, height = image.height;
    RAYPAGER_CHECK(unsampled.size() == width * height && image.channels <= std::tuple_size_v<Color>);
    if (std::find(unsampled.begin(), unsampled.end(), false) == unsampled.end()) return;
    const size_t channels = image.channels;
    const auto pixel = [&](size_t at) {
        Color color = {};
        std::copy_n(image.values.begin() + static_cast<std::ptrdiff_t>(channels * at), channels, color.begin());
        return color;
    };
    std::vector<Level> levels = {halved(
        width, height, [&](size_t at) { return !unsampled[at]; }, pixel)};
    while (!all_known(levels.back())) {
        const Level& last = levels.back();
        levels.push_back(halved(
            last.width, last.height, [&](size_t at) { return last.known[at]; }, [&](size_t at) { return last.colors[at]; }));
    }
    for (size_t l = levels.size() - 1; l-- > 0;) {
        Level& level = levels[l];
        for (size_t at = 0; at < level.colors.size(); at++)
            if (!level.known[at]) level.colors[at] = between(levels[l + 1], at % level.width, at / level.width);
    }
    for (size_t at = 0; at < unsampled.size(); at++) {
        if (!unsampled[at]) continue;
        const Color color = between(levels.front(), at % width, at / width);
        std::copy_n(color.begin(), channels, image.values.begin() + static_cast<std::ptrdiff_t>(channels * at));
    }
}

}  // namespace raypager
