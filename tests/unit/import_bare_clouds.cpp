// Clouds in scenes: bare ones get a camera and light that suit them, and pbrt scenes place them with Shape "points".
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "raypager/import.hpp"
#include "scene/point_distance.hpp"
#include "scene/vector.hpp"
#include "support/temporary_folder.hpp"
#include "unit/cloud_files.hpp"

namespace raypager {
namespace {

using support::TemporaryFolder;

// Image coordinates of p: 0 to 1 inside the frame.
std::array<double, 3> project(const Camera& c, const std::array<double, 3>& p) {
    const double d[3] = {p[0] - c.eye.x, p[1] - c.eye.y, p[2] - c.eye.z};
    const auto along = [&](const Float3& axis) {
        return (d[0] * axis.x + d[1] * axis.y + d[2] * axis.z) / (double{axis.x} * axis.x + double{axis.y} * axis.y + double{axis.z} * axis.z);
    };
    const double depth = along(c.forward);
    return {0.5 + 0.5 * along(c.right) / depth, 0.5 - 0.5 * along(c.up) / depth, depth};
}

// A hilly tile of 200 x 150 metres around (x, y).
test::LasFile make_tile(double x, double y, size_t points = 5000) {
    std::mt19937 random(7);
    test::LasFile file = test::make_las(2, 3, points);
    file.offset = {x, y, 300};
    for (auto& p : file.points) {
        const auto east = static_cast<int32_t>(random() % 20000), north = static_cast<int32_t>(random() % 15000);
        p.position = {east - 10000, north - 7500, static_cast<int32_t>(500 * std::sin(east * 5e-4))};
    }
    return file;
}

class ImportBareClouds : public testing::Test {
protected:
    Scene import(const std::vector<std::filesystem::path>& paths) {
        auto scene = import_scene(paths);
        EXPECT_TRUE(scene.ok()) << scene.status().message();
        return scene.ok() ? std::move(*scene) : Scene();
    }
    static std::vector<std::array<double, 3>> world_points(const Shape& shape) {
        std::vector<std::array<double, 3>> points;
        MeshIssues issues;
        const Status status = shape.points->stream(
            [&](std::span<const CloudPoint> piece) {
                for (const CloudPoint& p : piece) points.push_back(shape.to_world.point(p.position.x, p.position.y, p.position.z));
                return Status();
            },
            issues);
        EXPECT_TRUE(status.ok()) << status.message();
        return points;
    }
    // Shares of the points inside the frame, and how much of it they fill in the direction that they fill more of.
    struct View {
        double inside = 0, filled = 0;
    };
    static View view(const Scene& scene, const std::vector<std::array<double, 3>>& points) {
        double low[2] = {1, 1}, high[2] = {0, 0}, inside = 0;
        for (const auto& p : points) {
            const auto q = project(scene.camera, p);
            if (q[2] <= 0 || q[0] < 0 || q[0] > 1 || q[1] < 0 || q[1] > 1) continue;
            ++inside;
            for (size_t a = 0; a < 2; ++a) low[a] = std::min(low[a], q[a]), high[a] = std::max(high[a], q[a]);
        }
        return {inside / static_cast<double>(points.size()), std::max(high[0] - low[0], high[1] - low[1])};
    }
    TemporaryFolder folder;
};

TEST_F(ImportBareClouds, ALandscapeHasSunAndSkyAndNoGround) {
    const Scene scene = import({folder.write("tile.las", test::to_las(make_tile(0, 0)))});
    ASSERT_EQ(scene.shapes.size(), 1u);
    ASSERT_TRUE(scene.shapes[0].points);
    EXPECT_TRUE(scene.shapes[0].points->has_color());
    EXPECT_EQ(scene.shapes[0].point_radius, 0) << "from the spacing";
    ASSERT_EQ(scene.lights.size(), 2u);
    EXPECT_EQ(scene.lights[0].kind, RP_LIGHT_INFINITE);
    EXPECT_EQ(scene.lights[1].kind, RP_LIGHT_DISTANT);
    EXPECT_GT(scene.lights[1].p[2], 0.3f) << "the sun is up, and z is up";
    EXPECT_GT(scene.camera.eye.z, 50);
    EXPECT_GT(scene.camera.up.z, 0);
    const View seen = view(scene, world_points(scene.shapes[0]));
    EXPECT_EQ(seen.inside, 1);
    EXPECT_NEAR(seen.filled, 0.88, 0.01);
    EXPECT_TRUE(scene.warnings.empty()) << scene.warnings[0];
}

TEST_F(ImportBareClouds, StraysDoNotShrinkThePicture) {
    test::LasFile file = make_tile(0, 0);
    file.points[17].position = {0, 0, 2000000};  // 20 km up
    file.points[99].position = {-90000000, 0, 0};
    const Scene scene = import({folder.write("tile.las", test::to_las(file))});
    const View seen = view(scene, world_points(scene.shapes[0]));
    EXPECT_NEAR(seen.filled, 0.88, 0.01);
    EXPECT_GT(seen.inside, 0.999);
}

TEST_F(ImportBareClouds, CloudsFarAwayShareAnOrigin) {
    const auto west = folder.write("west.las", test::to_las(make_tile(500400, 5400100)));
    const auto east = folder.write("east.las", test::to_las(make_tile(500600, 5400100)));
    const Scene scene = import({west, east});
    ASSERT_EQ(scene.shapes.size(), 2u);
    const auto a = world_points(scene.shapes[0]), b = world_points(scene.shapes[1]);
    ASSERT_EQ(a.size(), b.size());
    for (size_t i = 0; i < a.size(); ++i) {
        EXPECT_LT(std::abs(a[i][0]), 1000);
        EXPECT_NEAR(b[i][0] - a[i][0], 200, 1e-4) << "though their origins differ";
        EXPECT_NEAR(b[i][1] - a[i][1], 0, 1e-4);
    }
    ASSERT_EQ(scene.warnings.size(), 1u);
    EXPECT_NE(scene.warnings[0].find("(500000, 5400000, 0)"), std::string::npos) << scene.warnings[0];
}

// A scanned object stands upright, on a ground and under a lamp, like a mesh.
TEST_F(ImportBareClouds, AnObjectStandsOnTheGround) {
    std::mt19937 random(3);
    std::normal_distribution<float> normal;
    std::vector<Float3> points;
    for (int i = 0; i < 5000; ++i) {
        const float x = normal(random), y = normal(random), z = normal(random), scale = 1 / std::sqrt(x * x + y * y + z * z);
        points.push_back({x * scale, 2 * y * scale, z * scale});
    }
    const Scene scene = import({folder.write("egg.ply", test::to_point_ply(points, "binary_little_endian"))});
    ASSERT_EQ(scene.shapes.size(), 2u);
    EXPECT_EQ(scene.shapes[1].name, "ground");
    ASSERT_EQ(scene.lights.size(), 3u);
    EXPECT_EQ(scene.lights[2].flags, RP_LIGHT_UNSEEN);
    EXPECT_GT(scene.camera.up.y, 0);
    EXPECT_NEAR(view(scene, world_points(scene.shapes[0])).filled, 0.88, 0.01);
    TriangleMesh ground;
    MeshIssues issues;
    ASSERT_TRUE(scene.shapes[1].mesh->load(ground, issues).ok());
    EXPECT_LT(ground.positions[0].y, -1.99f);
    EXPECT_GT(ground.positions[0].y, -2.1f);
}

TEST_F(ImportBareClouds, BesideMeshes) {
    const auto mesh = folder.write("box.ply", test::to_ply_binary(test::make_box(30, 20, 40)));
    const Scene scene = import({folder.write("tile.las", test::to_las(make_tile(0, 0))), mesh});
    ASSERT_EQ(scene.shapes.size(), 2u);
    EXPECT_TRUE(scene.shapes[0].mesh);
    EXPECT_TRUE(scene.shapes[1].points);
}

TEST_F(ImportBareClouds, WhatCannotBeShown) {
    const auto expect_error = [&](const std::filesystem::path& path, const std::string& what) {
        const auto scene = import_scene({path});
        ASSERT_FALSE(scene.ok());
        EXPECT_NE(scene.status().message().find(what), std::string::npos) << scene.status().message();
    };
    expect_error(folder.write("a.laz", "LASF"), "laszip");
    expect_error(folder.write("a.xyz", "nan nan nan\n"), "has no point that can be shown");
    expect_error(folder / "absent.las", "cannot be opened");
    test::LasFile file = test::make_las(2, 0, 3);
    for (auto& p : file.points) p.withheld = true;
    expect_error(folder.write("withheld.las", test::to_las(file)), "has no point that can be shown");
    expect_error(folder.write("none.xyz", "a b c\nd e f\n"), "none.xyz:2: \"d\" is no number");
}

// Their balls are seen from outside and as a whole, with room between those of few points.
TEST_F(ImportBareClouds, FewPoints) {
    std::mt19937 random(11);
    for (const size_t count : {1, 2, 3, 4, 7, 23, 24, 100, 300}) {
        SCOPED_TRACE(count);
        std::string text;
        std::vector<Float3> points;
        for (size_t i = 0; i < count; ++i) {
            const auto unit = [&] { return static_cast<float>(random() % 1000) / 1000; };
            points.push_back({unit(), unit(), unit()});
            text += test::to_text(points.back()) + "\n";
        }
        const Scene scene = import({folder.write("few.xyz", text)});
        ASSERT_FALSE(scene.shapes.empty());
        const float spacing = count > 1 ? compared_spacing(points) : 1.0f;
        const double radius = point_radius_of_spacing * spacing;
        double covered = 0;
        for (const auto& p : world_points(scene.shapes[0])) {
            const auto q = project(scene.camera, p);
            const double beyond = std::hypot(p[0] - scene.camera.eye.x, p[1] - scene.camera.eye.y, p[2] - scene.camera.eye.z);
            EXPECT_GT(beyond, radius) << "the camera is inside";
            const double half_height =
                std::sqrt(double{scene.camera.up.x} * scene.camera.up.x + double{scene.camera.up.y} * scene.camera.up.y +
                          double{scene.camera.up.z} * scene.camera.up.z) /
                std::sqrt(double{scene.camera.forward.x} * scene.camera.forward.x + double{scene.camera.forward.y} * scene.camera.forward.y +
                          double{scene.camera.forward.z} * scene.camera.forward.z);
            const double share = radius / (q[2] * length(vector(scene.camera.forward))) / (2 * half_height);  // of the picture's height
            covered += 3.14 * share * share * 9 / 16;
            EXPECT_GT(q[1] - share, 0);
            EXPECT_LT(q[1] + share, 1);
            EXPECT_GT(q[0] - share * 9 / 16, 0);
            EXPECT_LT(q[0] + share * 9 / 16, 1);
        }
        EXPECT_GT(covered, 0.02);
        if (count < 24) {
            EXPECT_LT(covered, 0.8);
        }
    }
}

TEST_F(ImportBareClouds, OneStrayAmongFewPoints) {
    for (const size_t count : {5, 12, 60, 400}) {
        SCOPED_TRACE(count);
        std::mt19937 random(5);
        std::string text = "0 0 4000\n";
        std::vector<std::array<double, 3>> subject;
        for (size_t i = 1; i < count; ++i) {
            subject.push_back(
                {static_cast<double>(random() % 100) / 10, static_cast<double>(random() % 100) / 10, static_cast<double>(random() % 100) / 10});
            text += fmt::format("{} {} {}\n", subject.back()[0], subject.back()[1], subject.back()[2]);
        }
        const Scene scene = import({folder.write("stray.xyz", text)});
        const View seen = view(scene, subject);
        EXPECT_EQ(seen.inside, 1);
        EXPECT_GT(seen.filled, 0.3);
    }
    const Scene apart = import({folder.write("apart.xyz", "0 0 0\n100 0 5000\n")});
    EXPECT_EQ(view(apart, world_points(apart.shapes[0])).inside, 1);
}

class ImportPbrtPoints : public ImportBareClouds {
protected:
    static constexpr const char* start = "Camera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\n";
    Scene pbrt(const std::string& shapes) { return import({folder.write("scene.pbrt", start + shapes)}); }
    void expect_error(const std::string& shapes, const std::string& what) {
        const auto scene = import_scene({folder.write("scene.pbrt", start + shapes)});
        ASSERT_FALSE(scene.ok());
        EXPECT_NE(scene.status().message().find(what), std::string::npos) << scene.status().message();
    }
};

TEST_F(ImportPbrtPoints, ArePlacedByTheTransform) {
    folder.write("tile.las", test::to_las(make_tile(500400, 5400100)));
    const Scene scene = pbrt(
        "AttributeBegin\n Scale 2 2 2\n Translate -500400 -5400100 -300\n"
        " Shape \"points\" \"string filename\" \"tile.las\" \"float radius\" 0.25 \"float scale\" [1.5]\nAttributeEnd\n");
    ASSERT_EQ(scene.shapes.size(), 1u);
    const Shape& shape = scene.shapes[0];
    EXPECT_EQ(shape.point_radius, 0.25f);
    EXPECT_EQ(shape.radius_scale, 1.5f);
    const auto points = world_points(shape);
    const auto tile = make_tile(0, 0);
    for (size_t i = 0; i < points.size(); ++i)
        for (size_t a = 0; a < 3; ++a)
            EXPECT_NEAR(points[i][a], 2 * 0.01 * tile.points[i].position[a], 2 * 4e-5) << "half a unit in the last place of 512, scaled";
    EXPECT_TRUE(scene.warnings.empty()) << scene.warnings[0];
}

TEST_F(ImportPbrtPoints, ShareTheirFileAndMakeInstances) {
    folder.write("c.xyz", "0 0 0\n1 0 0\n0 1 0\n");
    const std::string shape = "Shape \"points\" \"string filename\" \"c.xyz\"\n";
    const Scene scene = pbrt(shape + "ObjectBegin \"o\"\n" + shape + "ObjectEnd\nScale 1 2 3\nObjectInstance \"o\"\n");
    ASSERT_EQ(scene.shapes.size(), 2u);
    EXPECT_EQ(scene.shapes[0].points, scene.shapes[1].points);
    EXPECT_FALSE(scene.shapes[1].mesh) << "points are no ellipsoids";
    EXPECT_EQ(world_points(scene.shapes[1])[2][1], 2);
}

TEST_F(ImportPbrtPoints, NameTheirColumns) {
    folder.write("c.xyz", "0 7 0 1\n1 7 0 2\n0 7 1 3\n");
    const std::string shape = "Shape \"points\" \"string filename\" \"c.xyz\"";
    const Scene scene = pbrt(shape + "\n" + shape + " \"string columns\" \"x,_,y,z\"\n");
    ASSERT_EQ(scene.shapes.size(), 2u);
    EXPECT_EQ(world_points(scene.shapes[0])[2], (std::array<double, 3>{0, 7, 1}));
    EXPECT_EQ(world_points(scene.shapes[1])[2], (std::array<double, 3>{0, 1, 3}));
    EXPECT_NE(scene.shapes[0].points->reading(), scene.shapes[1].points->reading());
    expect_error(shape + " \"string columns\" \"x,y\"\n", "x, y and z must all be there");
}

TEST_F(ImportPbrtPoints, WarnAndFail) {
    folder.write("far.xyz", "500000 0 0\n500001 0 0\n");
    const std::string far = "Shape \"points\" \"string filename\" \"far.xyz\"\n";
    const Scene unmoved = pbrt(far);
    ASSERT_EQ(unmoved.warnings.size(), 1u);
    EXPECT_NE(unmoved.warnings[0].find("Translate -500000 0 0"), std::string::npos) << unmoved.warnings[0];
    const Scene shining = pbrt("Translate -500000 0 0\nAreaLightSource \"diffuse\"\n" + far);
    ASSERT_EQ(shining.warnings.size(), 1u);
    EXPECT_NE(shining.warnings[0].find("shine"), std::string::npos) << shining.warnings[0];
    EXPECT_FALSE(shining.shapes[0].area_light);
    expect_error("Shape \"points\"\n", "the name of a file is missing");
    expect_error("Shape \"points\" \"string filename\" \"absent.las\"\n", "scene.pbrt:4: ");
    expect_error("Shape \"points\" \"string filename\" \"far.xyz\" \"float radius\" -1\n", "radius must be");
    expect_error("Shape \"points\" \"string filename\" \"far.xyz\" \"float scale\" 0\n", "scale must be");
    folder.write("box.ply", test::to_ply_binary(test::make_box()));
    expect_error("Shape \"points\" \"string filename\" \"box.ply\"\n", "no point cloud");
    folder.write("points.ply", test::to_point_ply(test::some_points(), "ascii"));
    expect_error("Shape \"plymesh\" \"string filename\" \"points.ply\"\n", "Shape \"points\" takes point clouds");
}

}  // namespace
}  // namespace raypager
