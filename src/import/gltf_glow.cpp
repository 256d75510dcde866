#include "import/gltf_glow.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "import/gltf_arrays.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

// Each group is a mesh that is read on its own.
constexpr size_t most_groups = 24;
constexpr double dark = 1.0 / 256;  // of the brightest texel

// Over the triangle, as many places as it has texels, within reason.
Vector mean_over(const GltfSmallImage& image, const Float2& a, const Float2& b, const Float2& c) {
    const double area = std::abs((double{b.x} - a.x) * (double{c.y} - a.y) - (double{b.y} - a.y) * (double{c.x} - a.x)) * image.width * image.height;
    const int cuts = std::isfinite(area) ? static_cast<int>(std::clamp(std::sqrt(area), 3.0, 48.0)) : 3;
    Vector sum = {};
    int count = 0;
    for (int i = 0; i < cuts; ++i)
        for (int j = 0; i + j < cuts; ++j, ++count) {
            const double s = (i + 1.0 / 3) / cuts, t = (j + 1.0 / 3) / cuts;
            sum = sum +
                  vector(image.at(a.x + s * (double{b.x} - a.x) + t * (double{c.x} - a.x), a.y + s * (double{b.y} - a.y) + t * (double{c.y} - a.y)));
        }
    return (1.0 / count) * sum;
}

double brightest_of(const Vector& c) { return std::max({c[0], c[1], c[2]}); }

// Alike are colours of about the same brightness, by steps of four, and of about the same hue.
int kind_of(const Vector& color, double brightest, bool hues) {
    const double bright = brightest_of(color);
    if (!(bright > dark * brightest)) return -1;
    int kind = static_cast<int>(std::clamp(std::floor(-std::log2(bright / brightest) / 2), 0.0, 3.0));
    for (size_t c = 0; c < 3 && hues; ++c) kind = 3 * kind + static_cast<int>(std::min(3 * color[c] / bright, 2.0));
    return kind;
}

}  // namespace

Result<GltfGlow> group_by_glow(const GltfModel& model, const GltfReading& reading, const GltfSmallImage& image) {
    GltfArrays arrays;
    if (auto status = read_gltf_arrays(model, reading, arrays); !status.ok()) return status;
    const auto& primitive = model.content().meshes[static_cast<size_t>(reading.mesh)].primitives[static_cast<size_t>(reading.primitive)];
    const std::vector<Triangle> triangles = gltf_triangles(arrays.corners, primitive.mode);
    const uint64_t vertices = arrays.positions.size();
    if (arrays.uvs.empty()) arrays.uvs.resize(vertices);
    double brightest = 0;
    for (const Float3& texel : image.texels) brightest = std::max(brightest, brightest_of(vector(texel)));
    std::vector<Vector> colors(triangles.size());
    std::vector<double> areas(triangles.size(), 0);
    for (size_t i = 0; i < triangles.size(); ++i) {
        const auto& [a, b, c] = triangles[i];
        if (a >= vertices || b >= vertices || c >= vertices) continue;
        colors[i] = mean_over(image, arrays.uvs[a], arrays.uvs[b], arrays.uvs[c]);
        const double area =
            length(cross(vector(arrays.positions[b]) - vector(arrays.positions[a]), vector(arrays.positions[c]) - vector(arrays.positions[a])));
        if (std::isfinite(area)) areas[i] = area;
    }
    std::map<int, uint8_t> numbers;
    bool hues = true;
    const auto number_all = [&] {
        numbers.clear();
        for (const Vector& color : colors)
            if (const int kind = kind_of(color, brightest, hues); kind >= 0 && numbers.size() <= most_groups)
                numbers.try_emplace(kind, static_cast<uint8_t>(numbers.size() + 1));
    };
    number_all();
    if (numbers.size() > most_groups) {
        hues = false;
        number_all();
    }
    auto groups = std::make_shared<std::vector<uint8_t>>(triangles.size(), uint8_t{0});
    std::vector<Vector> sums(numbers.size() + 1);
    std::vector<double> weights(numbers.size() + 1, 0);
    for (size_t i = 0; i < triangles.size(); ++i) {
        const int kind = kind_of(colors[i], brightest, hues);
        if (kind < 0) continue;
        const uint8_t group = (*groups)[i] = numbers.at(kind);
        sums[group] = sums[group] + areas[i] * colors[i];
        weights[group] += areas[i];
    }
    GltfGlow glow{std::move(groups), {Float3{}}};
    for (size_t g = 1; g < sums.size(); ++g) glow.means.push_back(weights[g] > 0 ? float3((1 / weights[g]) * sums[g]) : Float3{});
    return glow;
}

}  // namespace raypager
