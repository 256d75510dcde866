// Layered materials (kernels/shading/layers.cl) and metals (bsdf.cl): directions come with the density that is told for them, and BSDFs are
// reciprocal.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "raypager/materials.hpp"
#include "scene/texture_use.hpp"
#include "support/device_scene.hpp"
#include "support/probe_kernels.hpp"

namespace raypager {
namespace {

using LayerFloat4 = std::array<float, 4>;

struct LayerCase {
    const char* name;
    rp_material material;
    bool inside = false;
};

std::vector<LayerCase> layer_cases() {
    constexpr Float3 white{1, 1, 1}, third{0.3f, 0.3f, 0.3f};
    rp_material plastic = glossy_material({0.4f, 0.2f, 0.1f}, {0.4f, 0.3f, 0.5f}, 0.3f), substrate = plastic, leaf = plastic;
    plastic.flags = 0;
    substrate.flags = RP_MATERIAL_BLEND;
    leaf.flags = RP_MATERIAL_SOLID;
    for (int k = 0; k < 3; k++) leaf.transmittance[k] = 0.3f, leaf.refracted[k] = 0.4f;
    return {{"plastic", plastic},
            {"substrate", substrate},
            {"gloss", glossy_material({0.4f, 0.2f, 0.1f}, {0.1f, 0.2f, 0.3f}, 0.4f)},
            {"smooth coat", coated_diffuse_material({0.7f, 0.3f, 0.1f}, 1.5f, 0)},
            {"rough coat", coated_diffuse_material({0.7f, 0.3f, 0.1f}, 1.5f, 0.3f)},
            {"coated metal", coated_conductor_material({0.2f, 0.9f, 1.1f}, {3.9f, 2.5f, 2.4f}, 0.4f, 1.5f, 0.3f)},
            {"rough paint", rough_diffuse_material({0.7f, 0.6f, 0.5f}, 30)},
            {"translucent", translucent_material({0.2f, 0.1f, 0.1f}, third)},
            {"leaf", leaf},
            {"rough glass", dielectric_material(1.5f, 0.3f, white, third)},
            {"rough glass from inside", dielectric_material(1.5f, 0.3f, white, third), true},
            {"rough metal", conductor_of_reflectance(third, 0.3f)},
            {"brushed metal", anisotropic(conductor_of_reflectance(third, 0.2f), 0.6f)},
            {"brushed substrate", anisotropic(substrate, 0.5f)},
            {"brushed coat", anisotropic(coated_diffuse_material({0.7f, 0.3f, 0.1f}, 1.5f, 0.5f), 0.2f)},
            {"brushed metal under a brushed coat",
             anisotropic(coated_conductor_material({0.2f, 0.9f, 1.1f}, {3.9f, 2.5f, 2.4f}, 0.2f, 1.5f, 0.5f), 0.2f, 0.5f)},
            {"brushed glass", anisotropic(dielectric_material(1.5f, 0.2f, white, third), 0.5f)},
            {"brushed glass from inside", anisotropic(dielectric_material(1.5f, 0.5f, white, third), 0.2f), true}};
}

class LayeredMaterials : public testing::Test {
protected:
    void SetUp() override {
        auto device = Device::open("", 0);
        ASSERT_TRUE(device.ok()) << device.status().message();
        device_ = std::move(*device);
    }

    // results: of each element so many vectors.
    std::vector<LayerFloat4> run(const char* name, const rp_material& material, const std::vector<LayerFloat4>& views,
                                 const std::vector<LayerFloat4>& others, size_t results_each) {
        auto kernel = support::probe_kernel(*device_, "shading/probe", name, is_anisotropic(material) ? "-DRP_ANISOTROPIC" : "");
        if (!kernel.ok()) throw std::runtime_error(kernel.status().message());
        std::vector<LayerFloat4> results(views.size() * results_each);
        auto one = device_->upload(std::as_bytes(std::span(&material, 1)), "material"), from = device_->upload(bytes_of(views), "views"),
             with = device_->upload(bytes_of(others), "others"), out = device_->allocate(results.size() * sizeof(LayerFloat4), "results");
        const auto count = static_cast<uint32_t>(views.size());
        const bool done = one.ok() && from.ok() && with.ok() && out.ok() && kernel->set(*one, *from, *with, count, *out).ok() &&
                          device_->kernels().launch(*kernel, count, 1).ok() &&
                          device_->kernels().read_now(*out, 0, std::as_writable_bytes(std::span(results))).ok();
        if (!done) throw std::runtime_error("the kernel did not run");
        return results;
    }

    std::unique_ptr<Device> device_;
};

LayerFloat4 direction_of(double cosine, double azimuth, float w = 0) {
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    return {static_cast<float>(sine * std::cos(azimuth)), static_cast<float>(sine * std::sin(azimuth)), static_cast<float>(cosine), w};
}

// The density over bins of the sphere against counts of samples.
TEST_F(LayeredMaterials, are_sampled_with_the_density_that_is_told) {
    constexpr int rows = 16, columns = 16, fine = 24, samples = 400000;
    std::mt19937 random(7);
    for (const LayerCase& c : layer_cases())
        for (const double cosine : {0.9, 0.35}) {
            SCOPED_TRACE(testing::Message() << c.name << ", cosine " << cosine);
            const LayerFloat4 view = direction_of(cosine, 0.4, c.inside ? 1 : 0);
            std::vector<LayerFloat4> numbers(samples), grid;
            const auto unit = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
            for (LayerFloat4& n : numbers) n = {unit(), unit(), unit(), 0};
            const auto sampled = run("rp_probe_sample_layers", c.material, std::vector(samples, view), numbers, 2);
            for (int r = 0; r < rows * fine; r++)
                for (int k = 0; k < columns * fine; k++)
                    grid.push_back(direction_of(1 - 2 * (r + 0.5) / (rows * fine), 2 * std::numbers::pi * (k + 0.5) / (columns * fine)));
            const auto densities = run("rp_probe_evaluate_layers", c.material, std::vector(grid.size(), view), grid, 1);
            std::vector<double> expected(rows * columns), counted(rows * columns);
            const double cell = 4 * std::numbers::pi / static_cast<double>(grid.size());
            for (size_t i = 0; i < grid.size(); i++)
                expected[i / (columns * fine) / fine * columns + i % (columns * fine) / fine] += double{densities[i][3]} * cell * samples;
            for (int i = 0; i < samples; i++) {
                const LayerFloat4& d = sampled[2 * static_cast<size_t>(i)];
                if (!(d[3] > 0)) continue;
                const int row = std::clamp(static_cast<int>((1 - double{d[2]}) / 2 * rows), 0, rows - 1);
                const double turns = std::atan2(double{d[1]}, double{d[0]}) / (2 * std::numbers::pi);
                counted[row * columns + std::clamp(static_cast<int>((turns < 0 ? turns + 1 : turns) * columns), 0, columns - 1)]++;
            }
            double chi2 = 0, few = 0, few_counted = 0;
            int bins = 0;
            for (size_t i = 0; i < expected.size(); i++) {
                if (expected[i] < 40) {  // where the midpoint rule or the square would say little
                    few += expected[i], few_counted += counted[i];
                    continue;
                }
                // The midpoint rule is off by up to a percent where a lobe is narrow.
                const double variance = expected[i] + std::pow(0.01 * expected[i], 2);
                chi2 += (counted[i] - expected[i]) * (counted[i] - expected[i]) / variance;
                bins++;
            }
            ASSERT_GT(bins, 8);
            EXPECT_LT(std::abs(few_counted - few), 5 * std::sqrt(few) + 40);
            // Wilson and Hilferty: 4.3 standard deviations, one in a hundred thousand.
            const double n = bins, limit = n * std::pow(1 - 2 / (9 * n) + 4.3 * std::sqrt(2 / (9 * n)), 3);
            EXPECT_LT(chi2, limit) << bins << " bins";
        }
}

TEST_F(LayeredMaterials, scatter_alike_in_both_directions) {
    std::mt19937 random(11);
    constexpr size_t pairs = 2000;
    for (const LayerCase& c : layer_cases()) {
        SCOPED_TRACE(c.name);
        std::vector<LayerFloat4> from, to, back_from, back_to;
        const auto unit = [&] { return (static_cast<double>(random() >> 8) + 0.5) * 0x1p-24; };
        const bool solid = (c.material.flags & RP_MATERIAL_SOLID) != 0;
        for (size_t i = 0; i < pairs; i++) {
            const bool through = i % 2 == 1;
            const double a = 0.05 + 0.95 * unit(), b = 0.05 + 0.95 * unit(), x = 6 * unit(), y = 6 * unit();
            from.push_back(direction_of(a, x, c.inside ? 1 : 0));
            to.push_back(direction_of(through ? -b : b, y));
            // From the other side the frame is turned over.
            back_from.push_back(direction_of(b, y, c.inside != (through && solid) ? 1 : 0));
            back_to.push_back(direction_of(through ? -a : a, x));
        }
        const auto there = run("rp_probe_evaluate_layers", c.material, from, to, 1),
                   back = run("rp_probe_evaluate_layers", c.material, back_from, back_to, 1);
        const double n2 = solid ? std::pow(c.inside ? 1 / double{c.material.ior} : double{c.material.ior}, 2) : 1;
        size_t not_black = 0;
        for (size_t i = 0; i < pairs; i++)
            for (size_t k = 0; k < 3; k++) {
                const double f = double{there[i][k]} / std::abs(double{to[i][2]}), g = double{back[i][k]} / std::abs(double{back_to[i][2]});
                // Radiance is more where the index is higher, by its square; diffuse transmission knows no index.
                const double diffuse = i % 2 ? double{c.material.transmittance[k]} / std::numbers::pi : 0;
                ASSERT_NEAR((f - diffuse) * (i % 2 ? n2 : 1), g - diffuse, 2e-4 * (f + g) + 1e-6) << i;
                not_black += f > 0;
            }
        EXPECT_GT(not_black, pairs / 2);
    }
}

}  // namespace
}  // namespace raypager
