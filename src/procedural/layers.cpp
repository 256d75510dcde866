#include "procedural/layers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/parallel.hpp"

namespace raypager {
namespace {

constexpr uint64_t instance_bytes = 1 << 22;  // a file is full when it has as many
constexpr size_t rows_at_a_time = 64;

void write_line(std::string& text, const Stance& stance, std::string_view object) {
    const Float3 x = float3(stance.x), y = float3(stance.y), z = float3(stance.z), o = float3(stance.origin);
    fmt::format_to(std::back_inserter(text), "Transform [{} {} {} 0 {} {} {} 0 {} {} {} 0 {} {} {} 1] ObjectInstance \"{}\"\n", x.x, x.y, x.z, y.x,
                   y.y, y.z, z.x, z.y, z.z, o.x, o.y, o.z, object);
}

class LayerWriter {
public:
    LayerWriter(SceneWriter& scene, const Layer& layer, const LayerGround& ground, uint64_t seed)
        : scene_(scene),
          layer_(layer),
          cells_(static_cast<size_t>(std::ceil(std::sqrt(2.0 * static_cast<double>(layer.count))))),
          step_(ground.side / static_cast<double>(std::max<size_t>(cells_, 1))),
          origin_(ground.origin),
          seed_(mix_bits(seed + hash_of(layer.name))) {}

    Status write() {
        if (layer_.count == 0) return {};
        // Where the rows begin in the sum of all densities.
        std::vector<double> begins(cells_ + 1, 0);
        parallel_for(cells_, 4, [&](size_t begin, size_t end) {
            for (size_t r = begin; r < end; r++)
                for (size_t c = 0; c < cells_; c++) begins[r + 1] += density(c, r);
        });
        for (size_t r = 0; r < cells_; r++) begins[r + 1] += begins[r];
        std::string text;
        for (size_t first = 0; first < cells_; first += rows_at_a_time) {
            std::vector<std::string> rows(std::min(rows_at_a_time, cells_ - first));
            parallel_for(rows.size(), 1, [&](size_t begin, size_t end) {
                for (size_t i = begin; i < end; i++) rows[i] = row_text(first + i, begins);
            });
            for (const std::string& row : rows) {
                text += row;
                if (text.size() >= instance_bytes) RAYPAGER_TRY(put_out(text));
            }
        }
        return put_out(text);
    }

private:
    static uint64_t hash_of(std::string_view name) {
        uint64_t hash = 0;
        for (const char c : name) hash = mix_bits(hash + static_cast<unsigned char>(c));
        return hash;
    }
    double density(size_t column, size_t row) const {
        return layer_.density((static_cast<double>(column) + 0.5) * step_, (static_cast<double>(row) + 0.5) * step_);
    }

    std::string row_text(size_t row, const std::vector<double>& begins) const {
        std::string text;
        Random random(seed_, row);
        const double scale = static_cast<double>(layer_.count) / begins.back();
        const auto before = [&](double sum) { return static_cast<uint64_t>(std::floor((begins[row] + sum) * scale + 0.5)); };
        double sum = 0;
        for (size_t c = 0; c < cells_; c++) {
            const uint64_t from = before(sum);
            sum += density(c, row);
            for (uint64_t i = from; i < before(sum); i++) {
                const double x = (static_cast<double>(c) + random.uniform()) * step_, z = (static_cast<double>(row) + random.uniform()) * step_;
                auto [kind, stance] = layer_.place(x, z, random);
                stance.origin = stance.origin - origin_;
                write_line(text, stance, fmt::format("{}-{:02}", layer_.name, kind));
            }
        }
        return text;
    }

    Status put_out(std::string& text) {
        if (text.empty()) return {};
        RAYPAGER_TRY(scene_.include(fmt::format("instances/{}-{:04}.pbrt", layer_.name, files_++), text));
        text.clear();
        return {};
    }

    SceneWriter& scene_;
    const Layer& layer_;
    size_t cells_;  // along a side
    double step_;
    Vector origin_;
    uint64_t seed_;
    int files_ = 0;
};

}  // namespace

Stance turned_stance(const Vector& at, const Vector& up, Random& random) {
    const SinCos angle = sincos_turns(random.uniform());
    const Vector x = unit(Vector{angle.cos, 0, angle.sin} - up * dot({angle.cos, 0, angle.sin}, up));
    return {x, up, cross(x, up), at};
}

Stance scaled(Stance stance, double across, double along) {
    stance.x = stance.x * across;
    stance.y = stance.y * along;
    stance.z = stance.z * across;
    return stance;
}

std::string instance_line(const Stance& stance, std::string_view object) {
    std::string text;
    write_line(text, stance, object);
    return text;
}

Status write_layer(SceneWriter& scene, const Layer& layer, const LayerGround& ground, uint64_t seed) {
    return LayerWriter(scene, layer, ground, seed).write();
}

}  // namespace raypager
