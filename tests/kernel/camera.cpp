// The rays of kernels/common/camera.cl: of each kind of camera against the host's model, and samples where the pixel filter has them.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "render/params.hpp"
#include "scene/pixel_filter.hpp"
#include "scene/projection.hpp"
#include "support/device_scene.hpp"
#include "support/probe_kernels.hpp"

namespace raypager {
namespace {

using Ray4 = std::array<float, 4>;
using Word4 = std::array<uint32_t, 4>;

class CameraRays : public testing::Test {
protected:
    void SetUp() override {
        auto device = Device::open("", 0);
        ASSERT_TRUE(device.ok()) << device.status().message();
        device_ = std::move(*device);
        scene_.width = 40;
        scene_.height = 30;
        scene_.spp = 1;
        scene_.camera = *make_camera({1, 2, 3}, {-2, 1, 0.5f}, {0, 1, 0.1f}, 50, 40, 30, false);
    }

    template <class Result, class Item>
    std::vector<Result> run(const char* name, const std::string& definitions, const std::vector<Item>& items, size_t results_each) {
        const auto params = make_params(scene_, {});
        auto kernel = support::probe_kernel(*device_, "single_ray/probe", name, "-DRP_SLABS=1 -DRP_STACK_SIZE=96" + definitions);
        if (!params.ok() || !kernel.ok()) throw std::runtime_error(params.ok() ? kernel.status().message() : params.status().message());
        std::vector<Result> results(items.size() * results_each);
        auto of = device_->upload(std::as_bytes(std::span(&*params, 1)), "params"), in = device_->upload(bytes_of(items), "items"),
             out = device_->allocate(results.size() * sizeof(Result), "results");
        const bool done = of.ok() && in.ok() && out.ok() && kernel->set(*of, *in, static_cast<uint32_t>(items.size()), *out).ok() &&
                          device_->kernels().launch(*kernel, items.size(), 1).ok() &&
                          device_->kernels().read_now(*out, 0, std::as_writable_bytes(std::span(results))).ok();
        if (!done) throw std::runtime_error("the kernel did not run");
        return results;
    }

    // Places of the picture, and a little beyond where a filter may look.
    std::vector<Word4> places(size_t count) {
        std::vector<Word4> result;
        for (size_t i = 0; i < count; i++) {
            const auto number = [&] { return std::bit_cast<uint32_t>(std::uniform_real_distribution<float>(-0.02f, 1.02f)(random_)); };
            const uint32_t u = number(), v = number();
            result.push_back({u, v, static_cast<uint32_t>(random_()), static_cast<uint32_t>(random_())});
        }
        return result;
    }

    void expect_rays_of_the_model(const std::string& definitions) {
        const Camera& camera = scene_.camera;
        const std::vector<Word4> at = places(2000);
        const auto rays = run<Ray4>("rp_probe_camera", definitions, at, 2);
        for (size_t i = 0; i < at.size(); i++) {
            const double u = std::bit_cast<float>(at[i][0]), v = std::bit_cast<float>(at[i][1]);
            // Beyond an edge the map of equal areas is folded.
            if (camera.projection == Projection::equal_area && (u < 0 || u > 1 || v < 0 || v > 1)) continue;
            ViewRay expected = view_ray(camera, u, v);
            if (camera.lens_radius > 0) {
                const double radius = camera.lens_radius * std::sqrt(at[i][2] * 0x1p-32), turn = 2 * std::numbers::pi * (at[i][3] * 0x1p-32);
                const Vector ahead = 1 / dot(expected.direction, unit(vector(camera.forward))) * expected.direction;
                const Vector in_focus = expected.origin + camera.focal_distance * length(vector(camera.forward)) * ahead;
                expected.origin =
                    expected.origin + radius * std::cos(turn) * unit(vector(camera.right)) + radius * std::sin(turn) * unit(vector(camera.up));
                expected.direction = unit(in_focus - expected.origin);
            }
            for (size_t a = 0; a < 3; a++) {
                ASSERT_NEAR(rays[2 * i][a], expected.origin[a], 4e-6) << definitions << " at " << u << ", " << v;
                ASSERT_NEAR(rays[2 * i + 1][a], expected.direction[a], 2e-6) << definitions << " at " << u << ", " << v;
            }
        }
    }

    std::unique_ptr<Device> device_;
    BakedScene scene_;
    std::mt19937 random_{5};
};

TEST_F(CameraRays, of_pinholes_lenses_and_parallel_views) {
    expect_rays_of_the_model("");
    scene_.camera.lens_radius = 0.25f;
    scene_.camera.focal_distance = 3;
    expect_rays_of_the_model(" -DRP_LENS");
    scene_.camera.projection = Projection::orthographic;
    expect_rays_of_the_model(" -DRP_LENS -DRP_PROJECTION=1");
    scene_.camera.lens_radius = 0;
    expect_rays_of_the_model(" -DRP_PROJECTION=1");
}

TEST_F(CameraRays, of_views_all_around) {
    Camera& camera = scene_.camera;
    for (Float3* axis : {&camera.right, &camera.up, &camera.forward}) *axis = float3(unit(vector(*axis)));
    for (const auto projection : {Projection::equirectangular, Projection::equal_area})
        for (const auto& window : {std::array<float, 4>{0, 0, 1, 1}, std::array<float, 4>{0.25f, 0.5f, 0.5f, 0.25f}}) {
            camera.projection = projection;
            camera.window = window;
            expect_rays_of_the_model(" -DRP_PROJECTION=" + std::to_string(static_cast<int>(projection)));
        }
}

// Equal areas of the picture are equal solid angles: so the mean of all directions is 0, and that of their squares a third.
TEST_F(CameraRays, of_the_map_of_equal_areas_are_even) {
    Camera& camera = scene_.camera;
    camera = Camera();
    camera.projection = Projection::equal_area;
    constexpr int side = 64;
    std::vector<Word4> at;
    for (int i = 0; i < side * side; i++)
        at.push_back({std::bit_cast<uint32_t>((float(i % side) + 0.5f) / side), std::bit_cast<uint32_t>((float(i / side) + 0.5f) / side), 0, 0});
    const auto rays = run<Ray4>("rp_probe_camera", " -DRP_PROJECTION=3", at, 2);
    for (size_t a = 0; a < 3; a++) {
        double sum = 0, squares = 0;
        for (size_t i = 0; i < at.size(); i++) {
            sum += rays[2 * i + 1][a];
            squares += rays[2 * i + 1][a] * rays[2 * i + 1][a];
        }
        EXPECT_NEAR(sum / double(at.size()), 0, 1e-5);
        EXPECT_NEAR(squares / double(at.size()), 1.0 / 3, 1e-3);
    }
}

// A place just beyond an edge is seen in nearly the direction of the edge.
TEST_F(CameraRays, of_the_map_of_equal_areas_go_on_beyond_its_edges) {
    Camera& camera = scene_.camera;
    camera = Camera();
    camera.projection = Projection::equal_area;
    std::vector<Word4> at;
    for (float along = 0.03f; along < 1; along += 0.1f)
        for (const float across : {-1e-4f, 1e-4f, 0.9999f, 1.0001f})
            for (const bool exchanged : {false, true})
                at.push_back({std::bit_cast<uint32_t>(exchanged ? along : across), std::bit_cast<uint32_t>(exchanged ? across : along), 0, 0});
    const auto rays = run<Ray4>("rp_probe_camera", " -DRP_PROJECTION=3", at, 2);
    for (size_t i = 0; i < at.size(); i += 4)
        for (size_t k = 0; k < 2; k++)
            for (size_t a = 0; a < 3; a++) EXPECT_NEAR(rays[2 * (i + k) + 1][a], rays[2 * (i + k + 2) + 1][a], 2e-3) << i + k;
}

TEST_F(CameraRays, lie_in_pixels_as_filters_say) {
    using Kind = PixelFilter::Kind;
    constexpr uint32_t count = 1 << 16, bins = 20;
    std::vector<std::array<uint32_t, 2>> numbers;
    for (uint32_t i = 0; i < count; i++) numbers.push_back({i << 16 | 0x8000u, static_cast<uint32_t>(random_())});
    for (const PixelFilter& filter : {PixelFilter{Kind::box, 1.25f, 0.5f}, PixelFilter{Kind::triangle, 2, 1}, PixelFilter{Kind::gaussian, 1.5f, 2, 2},
                                      PixelFilter{Kind::mitchell, 2, 3, 1.0f / 3, 1.0f / 3}, PixelFilter{Kind::sinc, 4, 4, 3}}) {
        SCOPED_TRACE(static_cast<int>(filter.kind));
        ASSERT_TRUE(check_filter(filter).ok());
        scene_.filter = filter;
        const auto at = run<std::array<float, 2>>("rp_probe_filter", " -DRP_PIXEL_FILTER", numbers, 1);
        std::array<double, bins> found = {}, wanted = {};
        double sum = 0;
        for (uint32_t i = 0; i < count; i++) {
            ASSERT_LE(std::abs(at[i][0]), filter.radius_x);
            ASSERT_LE(std::abs(at[i][1]), filter.radius_y);
            ASSERT_GE(at[i][0], at[i > 0 ? i - 1 : 0][0]) << "what is spread evenly stays so";
            found[std::min<size_t>(bins - 1, size_t((at[i][0] / filter.radius_x + 1) / 2 * bins))] += 1.0 / count;
        }
        constexpr int fine = 200;
        for (int i = 0; i < int(bins) * fine; i++) {
            const double weight = filter_weight(filter, 0, filter.radius_x * (2 * (i + 0.5) / (bins * fine) - 1));
            wanted[size_t(i / fine)] += weight;
            sum += weight;
        }
        // Of 64 steps some are cut by the 10 bins; within them samples lie evenly.
        for (size_t i = 0; i < bins; i++) EXPECT_NEAR(found[i], wanted[i] / sum, 1.5e-3) << "bin " << i;
    }
}

}  // namespace
}  // namespace raypager
