// Readers of point clouds: positions, colours and counts of every format, written here byte by byte.
#include <gtest/gtest.h>

#include <cerrno>
#include <cmath>

#include "import/cloud_file.hpp"
#include "raypager/import.hpp"
#include "support/failing_file_system.hpp"
#include "support/temporary_folder.hpp"
#include "unit/clouds_fixture.hpp"

namespace raypager {
namespace {

using namespace clouds_test;

TEST_F(ImportClouds, ColorsFromClassesOrIntensity) {
    LasFile file = make_las(2, 3, 40);
    for (auto& p : file.points) p.color = {0, 0, 0};
    for (size_t i = 0; i < 40; ++i) file.points[i].classification = i % 2 ? 2 : 6;
    const Points classes = read("a.las", to_las(file));
    EXPECT_TRUE(classes.has_color) << "colours that are all black are none";
    EXPECT_NE(classes.points[20].color, classes.points[21].color);
    for (auto& p : file.points) p.classification = 1;
    const Points grey = read("a.las", to_las(file));
    EXPECT_TRUE(grey.has_color);
    for (size_t i = 0; i < 40; ++i) {
        const uint32_t c = grey.points[i].color;
        EXPECT_TRUE((c & 255) == (c >> 8 & 255) && (c & 255) == c >> 16);
        EXPECT_GE(c & 255, grey.points[i == 0 ? 0 : i - 1].color & 255) << "lighter with intensity";
    }
    EXPECT_GT(grey.points[39].color & 255, (grey.points[0].color & 255) + 100);
    for (auto& p : file.points) p.intensity = 9;
    EXPECT_FALSE(read("a.las", to_las(file)).has_color) << "nothing tells the points apart";
}

TEST_F(ImportClouds, SurveyedCoordinatesKeepTheirDigits) {
    LasFile file = make_las(2, 0, 40);
    file.scale = {0.001, 0.001, 0.001};
    file.offset = {636000, 5848000.5, 120};
    const Points got = read("a.las", to_las(file));
    EXPECT_EQ(got.origin, (std::array<double, 3>{636000, 5848000, 0}));
    for (size_t i = 0; i < 40; ++i) {
        const auto& p = file.points[i].position;
        // What is left is a few metres: half a unit in the last place of 256 is 8e-6.
        EXPECT_NEAR(got.points[i].position.x, p[0] * 0.001, 8e-6);
        EXPECT_NEAR(got.points[i].position.y, p[1] * 0.001 + 0.5, 8e-6);
        EXPECT_NEAR(got.points[i].position.z, p[2] * 0.001 + 120, 8e-6);
    }
}

TEST_F(ImportClouds, DegreesAreNoMetres) {
    const auto warning = [&](const std::string& name, const std::string& content) -> std::string {
        const auto cloud = CloudFile::open(folder.write(name, content));
        EXPECT_TRUE(cloud.ok()) << cloud.status().message();
        return cloud.ok() && !(*cloud)->warnings().empty() ? (*cloud)->warnings()[0] : "";
    };
    // A tile of a kilometre at 8.4 E 50.1 N, 60 m high; the same in metres; a mast of 30 m; a grid of whole numbers.
    LasFile file = make_las(2, 0, 400);
    file.scale = {1e-7, 1e-7, 0.01};
    file.offset = {8.4, 50.1, 100};
    std::string text, mast, grid, named = "lon,lat,height\n";
    for (int i = 0; i < 400; ++i) {
        const int x = i * 7919 % 1000, y = i * 104729 % 1000, z = i * 31 % 6000;
        file.points[static_cast<size_t>(i)].position = {x * 100, y * 100, z};
        text += std::to_string(-70.5 - x * 1e-5) + " " + std::to_string(-33.4 + y * 1e-5) + " " + std::to_string(z * 0.01) + "\n";
        mast += std::to_string(3.2 + x * 2e-4) + " " + std::to_string(8.1 + y * 2e-4) + " " + std::to_string(z * 0.005) + "\n";
        grid += std::to_string(i % 2) + " " + std::to_string(i / 2 % 2) + " " + std::to_string(i * 5) + "\n";
        named += std::to_string(8 + x * 1e-2) + "," + std::to_string(50 + y * 1e-2) + "," + std::to_string(z * 0.01) + "\n";
    }
    for (const std::string& found : {warning("a.las", to_las(file)), warning("a.xyz", text), warning("a.csv", named)}) {
        EXPECT_NE(found.find("longitude and latitude"), std::string::npos) << found;
        EXPECT_NE(found.find("UTM"), std::string::npos) << found;
    }
    file.scale = {0.01, 0.01, 0.01};
    EXPECT_EQ(warning("b.las", to_las(file)), "");
    EXPECT_EQ(warning("mast.xyz", mast), "");
    EXPECT_EQ(warning("grid.xyz", grid), "");
    EXPECT_EQ(warning("stray.xyz", "0.5 0.25 0.1\n0.1 0.3 0.2\n0.7 0.2 0.9\n0.4 0.5 0.6\n0.3 0.9 0.8\n0.2 0.1 900\n"), "");
    // By what the file says of its coordinates: GTModelTypeGeoKey 1024 = 2, or a text.
    const auto keys = [](uint16_t model) {
        std::string bytes;
        for (const uint16_t v : {uint16_t{1}, uint16_t{1}, uint16_t{0}, uint16_t{1}, uint16_t{1024}, uint16_t{0}, uint16_t{1}, model})
            bytes += bytes_of(v);
        return bytes;
    };
    file.scale = {0.01, 0.01, 0.01};
    file.variable_record_count = 1;
    file.offset = {-20, 10, 0};
    file.variable_records = test::las_variable_record("LASF_Projection", 34735, keys(2));
    for (auto& p : file.points) p.position = {p.position[0] / 100, p.position[1] / 100, p.position[2]};
    EXPECT_NE(warning("c.las", to_las(file)).find("the file says"), std::string::npos);
    file.variable_records = test::las_variable_record("LASF_Projection", 34735, keys(1));
    EXPECT_EQ(warning("d.las", to_las(file)), "");
    file.variable_records = test::las_variable_record("LASF_Projection", 2112, "GEOGCS[\"WGS 84\"]");
    EXPECT_NE(warning("e.las", to_las(file)).find("the file says"), std::string::npos);
    file.variable_records = test::las_variable_record("LASF_Projection", 2112, "PROJCS[\"UTM\", GEOGCS[]]");
    EXPECT_EQ(warning("f.las", to_las(file)), "");
}

TEST_F(ImportClouds, PlyColorsOfOtherNames) {
    const auto text = [](const std::string& properties, const std::string& values) {
        return "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n" + properties + "end_header\n0 0 0 " +
               values + "\n1 1 1 " + values + "\n";
    };
    const uint32_t expected = rgb(10, 128, 255);
    EXPECT_EQ(read("a.ply", text("property uchar r\nproperty uchar g\nproperty uchar b\n", "10 128 255")).points[0].color, expected);
    EXPECT_EQ(read("b.ply", text("property uchar diffuse_red\nproperty uchar diffuse_green\nproperty uchar diffuse_blue\nproperty uchar alpha\n",
                                 "10 128 255 0"))
                  .points[0]
                  .color,
              expected);
    EXPECT_EQ(read("c.ply", text("property float blue\nproperty float Red\nproperty float green\n", "1 0.0392 0.502")).points[0].color, expected);
    const Points grey = read("d.ply",
                             "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                             "property float scalar_Intensity\nend_header\n0 0 0 10\n1 1 1 20\n2 2 2 30\n");
    ASSERT_TRUE(grey.has_color);
    EXPECT_LT(grey.points[0].color & 255, grey.points[2].color & 255);
    const auto partial = CloudFile::open(folder.write("e.ply", text("property uchar red\nproperty uchar green\n", "10 128")));
    ASSERT_TRUE(partial.ok());
    ASSERT_EQ((*partial)->warnings().size(), 1u);
    EXPECT_NE((*partial)->warnings()[0].find("red, green and blue"), std::string::npos);
    // Elements before the points, and a line end behind them.
    EXPECT_EQ(read("f.ply",
                   "ply\nformat ascii 1.0\nelement camera 2\nproperty float a\nelement vertex 2\nproperty float x\nproperty float y\n"
                   "property float z\nend_header\n7\n8\n0 0 0\n1 1 1\n")
                  .points.size(),
              2u);
    EXPECT_EQ(read("g.ply", to_point_ply(some_points(), "binary_little_endian") + "\r\n").points.size(), 40u);
}

TEST_F(ImportClouds, CompressedPointsAreRefused) {
    std::string marked = to_las(make_las(2, 3));
    marked[104] = static_cast<char>(marked[104] | 0x80);
    expect_error("a.las", marked, "compressed (LAZ)");
    expect_error("a.laz", marked, "(LAZ)");
    LasFile file = make_las(2, 3);
    file.variable_records = test::las_variable_record("laszip encoded", 22204, std::string(40, '\0'));
    file.variable_record_count = 1;
    expect_error("a.las", to_las(file), "laszip -i");
}

TEST_F(ImportClouds, PlyInEveryEncoding) {
    const auto points = some_points();
    for (const char* encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
        SCOPED_TRACE(encoding);
        const Points got = read("a.ply", to_point_ply(points, encoding));
        ASSERT_EQ(got.points.size(), points.size());
        EXPECT_EQ(got.count, points.size());
        for (size_t i = 0; i < points.size(); ++i) {
            EXPECT_EQ(got.points[i].position, points[i]);
            EXPECT_EQ(got.points[i].color, rgb(static_cast<uint32_t>(i), 128, 255));
            EXPECT_EQ(got.points[i].radius, 0);
        }
    }
}

TEST_F(ImportClouds, PlyPropertiesOfOtherTypes) {
    std::string text =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float confidence\nproperty double x\nproperty double y\nproperty double z\n"
        "property float red\nproperty float green\nproperty float blue\nproperty float radius\nproperty uchar alpha\nelement camera 1\n"
        "property float view\nend_header\n0 1 2 3 0.5 1 0 0.25 9\n\n1 nan 2 3 1 1 1 1 9\n2 4 5 6 0 0 0 -1 9\n7\n";
    const Points got = read("a.ply", text);
    ASSERT_EQ(got.points.size(), 2u);
    EXPECT_EQ(got.issues.not_finite, 1u);
    expect_position(got.points[0], 1, 2, 3);
    EXPECT_EQ(got.points[0].color, rgb(128, 255, 0));
    EXPECT_EQ(got.points[0].radius, 0.25f);
    EXPECT_EQ(got.points[1].radius, 0) << "a radius that is none";

    // Double precision far away, 16-bit colours, an element before the points and one behind.
    text =
        "ply\nformat binary_big_endian 1.0\nelement camera 2\nproperty float view\nelement vertex 2\nproperty double x\nproperty double y\n"
        "property double z\nproperty ushort red\nproperty ushort green\nproperty ushort blue\nelement face 0\n"
        "property list uchar int vertex_indices\nelement other 1\nproperty list uchar int stuff\nend_header\n";
    text += std::string(8, 'c');
    for (const double x : {4500000.125, 4500001.5}) {
        for (const double v : {x, -x, 2.0}) text += bytes_of(v, true);
        for (const uint16_t v : {uint16_t{65535}, uint16_t{257}, uint16_t{0}}) text += bytes_of(v, true);
    }
    text += std::string(1, '\0');
    const Points far = read("b.ply", text);
    ASSERT_EQ(far.points.size(), 2u);
    EXPECT_EQ(far.origin, (std::array<double, 3>{4500000, -4500000, 0}) /* rounded from the middle */);
    expect_position(far.points[0], 0.125, -0.125, 2);
    expect_position(far.points[1], 1.5, -1.5, 2);
    EXPECT_EQ(far.points[0].color, rgb(255, 1, 0));
}

TEST_F(ImportClouds, PlyThatIsDamaged) {
    const auto points = some_points();
    for (const char* encoding : {"binary_little_endian", "binary_big_endian"}) {
        const std::string sound = to_point_ply(points, encoding);
        expect_error("a.ply", sound.substr(0, sound.size() - 1), "truncated or damaged");
        expect_error("a.ply", sound + "x", "1 bytes follow the last element");
    }
    const std::string sound = to_point_ply(points, "ascii");
    expect_error("a.ply", sound.substr(0, sound.rfind('\n', sound.size() - 2)), "ends after 39 of 40 points");
    expect_error("a.ply", sound + "1 2\n", "text after the last point");
    std::string damaged = sound;
    damaged.replace(damaged.find("\n0.25 ") + 1, 4, "0,25");
    expect_error("a.ply", damaged, "a.ply:12: expected the 6 numbers of a point");
    expect_error("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n", "lack x, y or z");
    expect_error("a.ply",
                 "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                 "property list uchar int l\nend_header\n1 2 3 0\n",
                 "lists among their properties");
    expect_error("a.ply", test::to_ply_binary(test::make_box()), "it is no point cloud");
}

TEST_F(ImportClouds, LinesOfNumbers) {
    const auto expect = [&](const std::string& name, const std::string& content, std::vector<uint32_t> colors) {
        SCOPED_TRACE(content);
        const Points got = read(name, content);
        ASSERT_EQ(got.points.size(), 2u);
        expect_position(got.points[0], 1, 2.5, -3);
        expect_position(got.points[1], 4e2, 5, 6);
        EXPECT_EQ(got.has_color, !colors.empty());
        for (size_t i = 0; i < colors.size(); ++i) EXPECT_EQ(got.points[i].color, colors[i]);
    };
    expect("a.xyz", "1 2.5 -3\n4e2 5 6\n", {});
    expect("a.xyz", "# made by hand\r\n//X Y Z\r\n1,2.5,-3\r\n+4e2,5,6", {});
    expect("a.txt", "X;Y;Z;R;G;B\n1; 2.5; -3; 10; 20; 30\n\n4e2; 5; 6; 255; 0; 7\n", {rgb(10, 20, 30), rgb(255, 0, 7)});
    expect("a.pts", "2\n1 2.5 -3 -1024 10 20 30\n4e2 5 6 2047 255 0 7\n", {rgb(10, 20, 30), rgb(255, 0, 7)});
    expect("a.pts", "1\n1 2.5 -3 100 10 20 30\n1\n4e2 5 6 200 255 0 7\n", {rgb(10, 20, 30), rgb(255, 0, 7)});
    expect("a.txt", "1\t2.5\t-3\t0.5\t1\t0\n4e2\t5\t6\t0\t0.25\t1\n", {rgb(128, 255, 0), rgb(0, 64, 255)});
    expect("a.xyz", "1 2.5 -3 0.6 0 0.8\n4e2 5 6 1 0 0\n", {});  // normals
    expect("a.xyz", "1 2.5 -3 90 80 70 0.6 0 0.8\n4e2 5 6 100 20 3 1 0 0\n", {rgb(90, 80, 70), rgb(100, 20, 3)});
    expect("a.txt", "1 2.5 -3 17 tree\n4e2 5 6 17 house\n", {});
    EXPECT_TRUE(read("a.xyz", "1 2 3 10\n1 2 4 20\n1 2 5 30\n").has_color) << "intensity";
    const Points holes = read("a.xyz", "1 2 3\nnan 1 2\n1 1e400 2\n4 5 1e-400\n");
    EXPECT_EQ(holes.points.size(), 2u);
    EXPECT_EQ(holes.issues.not_finite, 2u);
}

TEST_F(ImportClouds, LinesThatAreDamaged) {
    expect_error("a.xyz", "", "is empty");
    expect_error("a.xyz", "\n# nothing\n", "has no points");
    expect_error("a.xyz", "1 2\n", "a.xyz:1: too few numbers");
    expect_error("a.xyz", "1 2 3\n1 2\n", "a.xyz:2: 2 numbers, where the first point has 3");
    expect_error("a.xyz", "1 2 3\n1 2 3 4\n", "a.xyz:2: 4 numbers");
    expect_error("a.xyz", "# c\n1 2 3\n1 2 3x\n", "a.xyz:3: \"3x\" is no number");
    expect_error("a.xyz", "1 2 3\nhello\n", "a.xyz:2: \"hello\" is neither");
    expect_error("a.pts", "3\n1 2 3\n1 2 3\n", "line 1 promises 3 points, but 2 came");
    expect_error("a.pts", "1\n1 2 3\n1 2 3\n", "line 1 promises 1 points, but 2 came");
    expect_error("a.pts", "2\n1 2 3\n1\n1 2 3\n", "a.pts:3: line 1 promises 2 points, but 1 came");
    expect_error("a.xyz", std::string("1 2 3\n1 \0 3\n", 12), "a.xyz:2: a zero byte");
}

TEST_F(ImportClouds, ManyPointsComeInPiecesAndInOrder) {
    std::vector<Float3> points;
    for (uint32_t i = 0; i < 200'000; ++i) points.push_back({0.125f * static_cast<float>(i), static_cast<float>(i % 7), 0});
    for (const char* encoding : {"ascii", "binary_little_endian"}) {
        const auto cloud = CloudFile::open(folder.write("many.ply", to_point_ply(points, encoding)));
        ASSERT_TRUE(cloud.ok());
        uint32_t next = 0, calls = 0;
        MeshIssues issues;
        const auto check = [&](std::span<const CloudPoint> piece) {
            EXPECT_LE(piece.size() * sizeof(CloudPoint), size_t{4} << 20);
            ++calls;
            for (const CloudPoint& p : piece) EXPECT_EQ(p.position, points[next++]);
            return Status();
        };
        EXPECT_TRUE((*cloud)->stream(check, issues).ok());
        EXPECT_EQ(next, points.size());
        EXPECT_GT(calls, 1u);
        // An error of the taker ends the stream.
        calls = 0;
        const Status ended = (*cloud)->stream(
            [&](std::span<const CloudPoint>) {
                ++calls;
                return Status::failed("enough");
            },
            issues);
        EXPECT_EQ(ended.message(), "enough");
        EXPECT_EQ(calls, 1u);
        // The sample is spread over all of the file.
        const auto sample = (*cloud)->sample();
        ASSERT_TRUE(sample.ok());
        EXPECT_EQ(sample->size(), points.size());
        EXPECT_EQ(sample->back().position, points.back());
    }
}

// Threads read parts of the file, of which some points are left out.
TEST_F(ImportClouds, WhatIsNotFiniteIsLeftOutWhereverItIs) {
    std::vector<Float3> points, kept;
    for (uint32_t i = 0; i < 150'000; ++i) {
        const bool finite = i % 7 != 3 && (i < 20'000 || i > 40'000);
        points.push_back({finite ? static_cast<float>(i) : NAN, 1, 2});
        if (finite) kept.push_back(points.back());
    }
    const auto cloud = CloudFile::open(folder.write("holes.ply", to_point_ply(points, "binary_little_endian")));
    ASSERT_TRUE(cloud.ok());
    size_t next = 0;
    MeshIssues issues;
    const Status status = (*cloud)->stream(
        [&](std::span<const CloudPoint> piece) {
            for (const CloudPoint& p : piece) {
                EXPECT_TRUE(next < kept.size() && p.position == kept[next]) << next;
                next++;
            }
            return Status();
        },
        issues);
    EXPECT_TRUE(status.ok()) << status.message();
    EXPECT_EQ(next, kept.size());
    EXPECT_EQ(issues.not_finite, points.size() - kept.size());
}

TEST_F(ImportClouds, AReadThatFailsEndsTheStream) {
    const std::vector<Float3> points(150'000, Float3{1, 2, 3});
    const auto path = folder.write("many.ply", to_point_ply(points, "binary_little_endian"));
    const auto cloud = CloudFile::open(path);
    ASSERT_TRUE(cloud.ok());
    support::FailingFileSystem disk;
    disk.error_number = EIO;
    for (const int after : {1, 5, 33}) {
        disk.fail_read_in = after;
        MeshIssues issues;
        const Status status = (*cloud)->stream([](std::span<const CloudPoint>) { return Status(); }, issues);
        disk.fail_read_in = 0;
        ASSERT_FALSE(status.ok()) << after;
        EXPECT_EQ(status.message().find(path.string()), 0u) << status.message();
        EXPECT_EQ(status.message().find('\n'), std::string::npos) << status.message();
    }
}

TEST_F(ImportClouds, EndingAndHeaderTellCloudsFromMeshes) {
    EXPECT_TRUE(is_cloud_file(folder.write("a.ply", to_point_ply(some_points(), "ascii"))));
    EXPECT_FALSE(is_cloud_file(folder.write("b.ply", test::to_ply_text(test::make_box()))));
    EXPECT_FALSE(is_cloud_file(folder / "absent.ply"));
    for (const char* name : {"a.las", "A.LAS", "a.laz", "a.xyz", "a.pts", "a.txt"}) EXPECT_TRUE(is_cloud_file(name)) << name;
    for (const char* name : {"a.obj", "a.pbrt", "a.rpb", "las"}) EXPECT_FALSE(is_cloud_file(name)) << name;
}

}  // namespace
}  // namespace raypager
