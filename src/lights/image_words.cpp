#include "lights/image_words.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "lights/steps.hpp"
#include "raypager/sky.hpp"

namespace raypager {
namespace {

// Half a degree, as the sun is wide, is more than one of so many cells a side.
constexpr uint32_t max_cells = 1024;

bool is_sky(const rp_light& light, size_t number) { return light.kind == RP_LIGHT_INFINITE && light.flags >> RP_LIGHT_IMAGE_SHIFT == number + 1; }

uint32_t cells_of(const LightImage& image, std::span<const rp_light> lights, size_t number) {
    const bool drawn_from = std::ranges::any_of(lights, [&](const rp_light& light) { return is_sky(light, number); });
    return drawn_from ? sky_cells(image.width) : 0;
}

uint64_t head_words(uint64_t cells) { return RP_IMAGE_HEAD + cells + cells * cells; }

// Integral up to t of the tent over [-1, 1] by which a texel counts around its middle.
double tent_integral(double t) {
    if (t <= -1) return 0;
    if (t >= 1) return 1;
    return t < 0 ? (t + 1) * (t + 1) / 2 : 1 - (1 - t) * (1 - t) / 2;
}

// By how much texels count in a cell of a row: those from `first` on, which may be -1, to one behind the last texel.
struct CellTexels {
    int64_t first = 0;
    std::vector<double> weights;
};

std::vector<CellTexels> texels_of_cells(uint32_t size, uint32_t cells) {
    std::vector<CellTexels> result(cells);
    for (uint32_t c = 0; c < cells; c++) {
        const double begin = double(size) * c / cells - 0.5, end = double(size) * (c + 1) / cells - 0.5;
        result[c].first = static_cast<int64_t>(std::floor(begin));
        const auto last = std::min<int64_t>(static_cast<int64_t>(std::ceil(end)), size);
        for (int64_t i = result[c].first; i <= last; i++)
            result[c].weights.push_back(tent_integral(end - static_cast<double>(i)) - tent_integral(begin - static_cast<double>(i)));
    }
    return result;
}

double brightness(const rp_texel& texel) {
    const Float3 c = texel_color(texel);
    return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z;
}

std::vector<uint32_t> head_of(const LightImage& image, uint32_t cells) {
    std::vector<uint32_t> words(RP_IMAGE_HEAD);
    words[RP_IMAGE_WIDTH] = image.width;
    words[RP_IMAGE_HEIGHT] = image.height;
    words[RP_IMAGE_CELLS] = cells;
    if (cells == 0) return words;
    const std::vector<double> weights = cell_weights(image, cells);
    std::vector<double> rows, within(cells);
    std::vector<uint32_t> columns;
    for (uint32_t y = 0; y < cells; y++) {
        const auto row = std::span(weights).subspan(size_t{y} * cells, cells);
        rows.push_back(std::accumulate(row.begin(), row.end(), 0.0));
        // Where nothing shines it does not matter.
        std::ranges::transform(row, within.begin(), [&](double w) { return rows.back() > 0 ? w / rows.back() : 1.0 / cells; });
        const std::vector<uint32_t> steps = steps_of(within);
        columns.insert(columns.end(), steps.begin(), steps.end());
    }
    const double all = std::accumulate(rows.begin(), rows.end(), 0.0);
    for (double& row : rows) row = all > 0 ? row / all : 1.0 / cells;
    const std::vector<uint32_t> steps = steps_of(rows);
    words.insert(words.end(), steps.begin(), steps.end());
    words.insert(words.end(), columns.begin(), columns.end());
    return words;
}

}  // namespace

std::vector<double> cell_weights(const LightImage& image, uint32_t cells) {
    const auto size = static_cast<int64_t>(image.width);
    const std::vector<CellTexels> parts = texels_of_cells(image.width, cells);
    std::vector<double> weights(size_t{cells} * cells), shines(static_cast<size_t>(size) + 2), in_row(cells);
    uint32_t first_cell = 0;
    for (int64_t y = -1; y <= size; y++) {
        // Beyond an edge follows the edge itself, its halves swapped; beyond a corner the corner opposite.
        const int64_t row = std::clamp<int64_t>(y, 0, size - 1);
        for (int64_t x = -1; x <= size; x++) {
            const bool past_row = row != y, past_column = x < 0 || x >= size;
            int64_t column = std::clamp<int64_t>(x, 0, size - 1);
            if (past_row) column = size - 1 - column;
            const int64_t from = past_column ? size - 1 - row : row;
            shines[static_cast<size_t>(x + 1)] = brightness(image.texels[static_cast<size_t>(from * size + column)]);
        }
        for (uint32_t c = 0; c < cells; c++) {
            in_row[c] = 0;
            for (size_t i = 0; i < parts[c].weights.size(); i++)
                in_row[c] += parts[c].weights[i] * shines[static_cast<size_t>(parts[c].first + 1) + i];
        }
        const auto reaches = [&](uint32_t c) { return parts[c].first + static_cast<int64_t>(parts[c].weights.size()) > y; };
        while (first_cell < cells && !reaches(first_cell)) first_cell++;
        for (uint32_t c = first_cell; c < cells && parts[c].first <= y; c++) {
            if (!reaches(c)) continue;
            const double weight = parts[c].weights[static_cast<size_t>(y - parts[c].first)];
            for (uint32_t k = 0; k < cells; k++) weights[size_t{c} * cells + k] += weight * in_row[k];
        }
    }
    return weights;
}

uint64_t image_words_bytes(const LightImages& images, std::span<const rp_light> lights, std::span<const uint32_t> sky_in_pages) {
    uint64_t words = sky_in_pages.size();
    for (size_t i = 0; i < images.size(); i++)
        if (!images[i]->texels.empty()) words += head_words(cells_of(*images[i], lights, i)) + 2 * images[i]->texels.size();
    return words * sizeof(uint32_t);
}

Status for_image_words(const LightImages& images, std::vector<rp_light>& lights, uint64_t first_word,
                       const std::function<Status(std::span<const uint32_t> head, std::span<const rp_texel> texels)>& take,
                       std::span<const uint32_t> sky_in_pages) {
    for (size_t i = 0; i < images.size(); i++) {
        const bool in_pages = images[i]->texels.empty();
        const std::vector<uint32_t> head =
            in_pages ? std::vector(sky_in_pages.begin(), sky_in_pages.end()) : head_of(*images[i], cells_of(*images[i], lights, i));
        for (rp_light& light : lights)
            if (light.flags >> RP_LIGHT_IMAGE_SHIFT == i + 1) light.area = std::bit_cast<float>(static_cast<uint32_t>(first_word));
        if (Status status = take(head, images[i]->texels); !status.ok()) return status;
        first_word += head.size() + 2 * images[i]->texels.size();
    }
    return {};
}

uint32_t sky_cells(uint32_t size) { return std::min(size, max_cells); }

std::vector<uint32_t> sky_head(const LightImage& image) { return head_of(image, sky_cells(image.width)); }

bool are_sky_words(std::span<const uint32_t> words) {
    if (words.size() < RP_IMAGE_HEAD) return false;
    const uint32_t cells = words[RP_IMAGE_CELLS];
    if (cells == 0 || cells > max_cells || words.size() != head_words(cells)) return false;
    for (auto steps = words.subspan(RP_IMAGE_HEAD); !steps.empty(); steps = steps.subspan(cells)) {
        const auto some = steps.first(cells);
        if (some.back() != UINT32_MAX || std::ranges::adjacent_find(some, std::greater_equal()) != some.end()) return false;
    }
    return true;
}

}  // namespace raypager
