// Cameras as texts: what is printed makes the same camera again, and left is left.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "cli/view.hpp"
#include "raypager/camera_text.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

bool same(const Camera& a, const Camera& b) { return a.eye == b.eye && a.right == b.right && a.up == b.up && a.forward == b.forward; }

// Both axes are turned by less than single precision tells.
void expect_near(const Camera& a, const Camera& b) {
    EXPECT_EQ(a.eye, b.eye);
    for (const auto axis : {&Camera::right, &Camera::up, &Camera::forward}) {
        const Vector x = vector(a.*axis), y = vector(b.*axis);
        EXPECT_LT(length(x - y), 5e-7 * length(y));
    }
}

TEST(CliCamera, TextsAreKeptToTheLastBit) {
    for (const char* text : {"1,2,3,-4,5.5,6,0,1,0,40", "0.1,-1e-07,3e+20,0.333333333333,2,-3,0.1,0.2,0.9,179.5,mirrored"}) {
        const auto camera = parse_camera(text);
        ASSERT_TRUE(camera.ok()) << camera.status().message();
        EXPECT_EQ(format_camera(*camera), text);
        EXPECT_EQ(*parse_camera(format_camera(*camera)), *camera);
    }
}

TEST(CliCamera, LensesComeBehindAllElse) {
    for (const char* text : {"1,2,3,-4,5.5,6,0,1,0,40,lens,0.1,7.25", "1,2,3,-4,5.5,6,0,1,0,40,mirrored,lens,1e-05,3"}) {
        const auto camera = parse_camera(text);
        ASSERT_TRUE(camera.ok()) << camera.status().message();
        EXPECT_EQ(format_camera(*camera), text);
        const auto made = make_camera(*camera, 4, 3);
        EXPECT_EQ(made->lens_radius, camera->lens_radius);
        const auto described = describe_camera(*made, 4, 3, 9);
        ASSERT_TRUE(described);
        EXPECT_EQ(*make_camera(*described, 4, 3), *made) << format_camera(*described);
    }
    for (const char* text :
         {",lens", ",lens,1", ",lens,0,1", ",lens,1,0", ",lens,1,-2", ",lens,1,x", ",lens,1,2,", ",lens,1,2,3", ",lens,1,2,mirrored"})
        EXPECT_FALSE(parse_camera(std::string("1,2,3,-4,5.5,6,0,1,0,40") + text).ok()) << text;
}

TEST(CliCamera, AWordBehindTheNumbersMirrors) {
    EXPECT_FALSE(parse_camera("0,0,5,0,0,0,0,1,0,40")->mirrored);
    EXPECT_TRUE(parse_camera("0,0,5,0,0,0,0,1,0,40,mirrored")->mirrored);
    for (const char* text :
         {"0,0,5,0,0,0,0,1,0,40,", "0,0,5,0,0,0,0,1,0,40,Mirrored", "0,0,5,0,0,0,0,1,0,40,mirrored,", "0,0,5,0,0,0,0,1,0,mirrored"})
        EXPECT_FALSE(parse_camera(text).ok()) << text;
    // Seen from +z with y up, +x is at the right; mirrored, at the left.
    EXPECT_GT(make_camera(*parse_camera("0,0,5,0,0,0,0,1,0,40"), 4, 3)->right.x, 0);
    EXPECT_LT(make_camera(*parse_camera("0,0,5,0,0,0,0,1,0,40,mirrored"), 4, 3)->right.x, 0);
}

// The scene's own camera has no say in it.
TEST(CliCamera, AGivenCameraIsThatOfTheRealWorldWhateverTheScenesIs) {
    const auto given = parse_camera("0,0,5,0,0,0,0,1,0,40");
    const Camera own = *make_camera(*parse_camera("0,0,5,0,0,0,0,1,0,40,mirrored"), 4, 3);
    EXPECT_GT(choose_camera(*given, own, 4, 3, 4, 3)->right.x, 0);
    EXPECT_LT(choose_camera({}, own, 4, 3, 8, 3)->right.x, 0);
}

TEST(CliCamera, DescriptionsMakeTheSameCamera) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> number(-1, 1);
    const std::pair<uint32_t, uint32_t> sizes[] = {{1280, 720}, {720, 1280}, {512, 512}, {1, 999}};
    int exact = 0;
    constexpr int count = 400;
    for (int i = 0; i < count; i++) {
        const double scale = std::pow(10, 4 * number(random));
        const auto point = [&] { return Vector{scale * number(random), scale * number(random), scale * number(random)}; };
        CameraText text;
        text.eye = float3(point());
        text.target = vector(float3(point()));
        text.up = i % 3 == 0 ? Vector{0, 0, 1} : i % 3 == 1 ? Vector{0, 1, 0} : Vector{number(random), 2 + number(random), number(random)};
        text.fov_degrees = 5 + std::round(800 + 790 * number(random)) / 10;
        text.mirrored = i % 2 == 1;
        const auto [width, height] = sizes[i % 4];
        const auto camera = make_camera(text, width, height);
        ASSERT_TRUE(camera);
        const auto described = describe_camera(*camera, width, height, scale);
        ASSERT_TRUE(described);
        const auto parsed = parse_camera(format_camera(*described));
        ASSERT_TRUE(parsed.ok()) << format_camera(*described);
        EXPECT_EQ(parsed->mirrored, text.mirrored);
        EXPECT_NEAR(parsed->fov_degrees, text.fov_degrees, 1e-5);
        const auto again = make_camera(*parsed, width, height);
        expect_near(*again, *camera);
        exact += same(*again, *camera);
    }
    EXPECT_GE(exact, count * 0.6) << "of these a third have an up that the picture does not tell exactly";
}

TEST(CliCamera, WhatNoTextDescribes) {
    Camera camera = *make_camera(*parse_camera("1,2,3,-4,5.5,6,0,1,0,40"), 4, 3);
    EXPECT_TRUE(describe_camera(camera, 4, 3));
    EXPECT_FALSE(describe_camera(camera, 3, 4)) << "pixels that are not square";
    Camera parallel = camera;
    parallel.projection = Projection::orthographic;
    EXPECT_FALSE(describe_camera(parallel, 4, 3));
    Camera shifted = camera;
    shifted.forward.y += 0.1f;
    EXPECT_FALSE(describe_camera(shifted, 4, 3)) << "a part of a larger picture";
    camera.right.x += 0.1f;
    EXPECT_FALSE(describe_camera(camera, 4, 3)) << "a sheared picture";
    EXPECT_EQ(camera_string(camera, 4, 3, {0, 0, 0}), "");
}

TEST(CliCamera, SizesKeepTheShorterSidesAngle) {
    const Camera own = *make_camera(*parse_camera("0,-5,0,0,0,0,0,0,1,40"), 1280, 720);
    for (const auto& [width, height] : {std::pair(720u, 1280u), {512u, 512u}, {2000u, 100u}}) {
        const auto fitted = choose_camera({}, own, 1280, 720, width, height);
        ASSERT_TRUE(fitted.ok());
        const auto text = describe_camera(*fitted, width, height);
        ASSERT_TRUE(text);
        EXPECT_NEAR(text->fov_degrees, 40, 1e-4);
    }
}

TEST(CliCamera, WhatIsNotInTheAxesStays) {
    Camera own = *make_camera(*parse_camera("3,-5,2,0,0,0,0,0,1,40,lens,0.5,6"), 4, 3);
    const Camera turned = turned_camera(own, {0, 0, 0}, {0, 0, 1}, 0.25);
    EXPECT_EQ(turned.lens_radius, 0.5f);
    EXPECT_EQ(turned.focal_distance, 6);
    EXPECT_EQ(choose_camera({}, own, 4, 3, 100, 10)->lens_radius, 0.5f);
    own = Camera();
    own.projection = Projection::equal_area;
    own.window = {0, 0.5f, 1, 0.5f};
    EXPECT_EQ(*choose_camera({}, own, 4, 3, 100, 10), own) << "all around is all around";
    const Box box = {{-20, -20, 5}, {20, 20, 6}};
    EXPECT_EQ(stand_back_for_turns(own, {0, 0, 0}, {0, 0, 1}, 8, {&box, 1}), own);
}

TEST(CliCamera, TurntablesGoAroundTheUprightAxis) {
    const Camera own = *make_camera(*parse_camera("3,-5,2,0,0,0,0,0,1,40"), 4, 3);
    EXPECT_EQ(upright_axis(own), (Vector{0, 0, 1}));
    const Vector center = {1, 1, 7};
    EXPECT_TRUE(same(turned_camera(own, center, upright_axis(own), 0), own));
    const Camera quarter = turned_camera(own, center, upright_axis(own), 0.25);
    // (2, -6) from the centre becomes (6, 2).
    EXPECT_NEAR(quarter.eye.x, 7, 1e-5);
    EXPECT_NEAR(quarter.eye.y, 3, 1e-5);
    EXPECT_NEAR(quarter.eye.z, 2, 1e-6);
    EXPECT_NEAR(quarter.up.z, own.up.z, 1e-6);
    EXPECT_NEAR(quarter.forward.x, -own.forward.y, 1e-6);
    EXPECT_NEAR(quarter.right.z, 0, 1e-6);
    Camera again = own;
    for (int i = 0; i < 4; i++) again = turned_camera(again, center, upright_axis(again), 0.25);
    EXPECT_NEAR(again.eye.x, own.eye.x, 1e-4);
    EXPECT_NEAR(again.eye.y, own.eye.y, 1e-4);
}

double farthest_aside(const Camera& camera, const Box& box) {
    double most = 0;
    for (int corner = 0; corner < 8; corner++) {
        const Vector p = {(corner & 1 ? box.upper : box.lower)[0], (corner & 2 ? box.upper : box.lower)[1], (corner & 4 ? box.upper : box.lower)[2]};
        const auto along = [&](const Float3& axis) { return dot(p - vector(camera.eye), vector(axis)) / dot(vector(axis), vector(axis)); };
        EXPECT_GT(along(camera.forward), 0);
        most = std::max(most, std::max(std::abs(along(camera.right)), std::abs(along(camera.up))) / along(camera.forward));
    }
    return most;
}

TEST(CliCamera, TurntablesStandBackWhereALongThingWouldNotFit) {
    // Seen end on, it fills the picture.
    const Box plank = {{-1, -10, -1}, {1, 10, 1}};
    const Camera own = *make_camera(*parse_camera("0,-14,0,0,0,0,0,0,1,40"), 4, 4);
    const Camera back = stand_back_for_turns(own, {0, 0, 0}, {0, 0, 1}, 8, {&plank, 1});
    double most = 0;
    for (int i = 0; i < 8; i++) most = std::max(most, farthest_aside(turned_camera(back, {0, 0, 0}, {0, 0, 1}, i / 8.0), plank));
    EXPECT_NEAR(most, 1, 1e-5) << "as far as it must, and no farther";
    EXPECT_LT(back.eye.y, own.eye.y);
    EXPECT_EQ(back.eye.x, 0);

    const Box ball = {{-1, -1, -1}, {1, 1, 1}};
    EXPECT_TRUE(same(stand_back_for_turns(own, {0, 0, 0}, {0, 0, 1}, 8, {&ball, 1}), own)) << "fits as it is";
    const Box room = {{-20, -20, -5}, {20, 20, 5}};
    EXPECT_TRUE(same(stand_back_for_turns(own, {0, 0, 0}, {0, 0, 1}, 8, {&room, 1}), own)) << "from within";
}

}  // namespace
}  // namespace raypager
