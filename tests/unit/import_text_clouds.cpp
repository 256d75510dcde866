// Which column of a text cloud is what: by names, by what it looks like, and as the user says.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "import/cloud_file.hpp"
#include "raypager/bake.hpp"
#include "raypager/import.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

class ImportTextClouds : public testing::Test {
protected:
    struct Cloud {
        std::vector<CloudPoint> points;
        bool has_color = false;
        std::array<double, 3> origin = {};
        std::vector<std::string> warnings;
        Status status;
    };
    Cloud read(const std::string& content, const std::string& columns = "", const std::string& name = "a.txt") {
        Cloud cloud;
        const auto named = columns.empty() ? Result<PointColumns>(PointColumns()) : parse_point_columns(columns);
        EXPECT_TRUE(named.ok()) << named.status().message();
        const auto file = CloudFile::open(folder.write(name, content), *named);
        cloud.status = file.status();
        if (!file) return cloud;
        cloud.has_color = (*file)->has_color();
        cloud.origin = (*file)->origin();
        cloud.warnings = (*file)->warnings();
        MeshIssues issues;
        cloud.status = (*file)->stream(
            [&](std::span<const CloudPoint> piece) {
                cloud.points.insert(cloud.points.end(), piece.begin(), piece.end());
                return Status();
            },
            issues);
        EXPECT_LE(cloud.points.size(), (*file)->count());
        return cloud;
    }
    // The same points, in the same colours, whatever the warnings.
    void expect_same(const std::string& content, const std::string& plain, const std::string& columns = "") {
        SCOPED_TRACE(content.substr(0, 200));
        const Cloud got = read(content, columns), wanted = read(plain);
        ASSERT_TRUE(got.status.ok()) << got.status.message();
        ASSERT_TRUE(wanted.status.ok()) << wanted.status.message();
        EXPECT_EQ(got.has_color, wanted.has_color);
        EXPECT_EQ(got.origin, wanted.origin);
        ASSERT_EQ(got.points.size(), wanted.points.size());
        for (size_t n = 0; n < got.points.size(); ++n) {
            EXPECT_EQ(got.points[n].position, wanted.points[n].position) << n;
            EXPECT_EQ(got.points[n].color, wanted.points[n].color) << n;
            EXPECT_EQ(got.points[n].radius, wanted.points[n].radius) << n;
        }
    }
    void expect_error(const std::string& content, const std::string& what, const std::string& columns = "") {
        const Cloud got = read(content, columns);
        ASSERT_FALSE(got.status.ok()) << content;
        EXPECT_EQ(got.status.message().find((folder / "a.txt").string()), 0u) << got.status.message();
        EXPECT_NE(got.status.message().find(what), std::string::npos) << got.status.message();
    }
    struct Point {
        double x, y, z;
        int r, g, b, i, number, returns, label;
        double nx, ny, nz;
    };
    // 60 points on a ball, in two colours.
    static std::vector<Point> points() {
        std::mt19937 random(1);
        std::vector<Point> all;
        for (int k = 0; k < 60; ++k) {
            const auto unit = [&] { return static_cast<double>(random() % 20001) / 10000 - 1; };
            double v[3] = {unit(), unit(), unit()};
            const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) + 1e-9;
            const bool red = random() % 2;
            const int returns = 1 + static_cast<int>(random() % 3);
            all.push_back({v[0], v[1], v[2], red ? 220 : 40, red ? 40 : 200, red ? 40 : 60, static_cast<int>(random() % 256),
                           1 + static_cast<int>(random()) % returns, returns, static_cast<int>(random() % 5), v[0] / length, v[1] / length,
                           v[2] / length});
        }
        return all;
    }
    template <class... Values>
    static std::string table(const std::string& format, const Values&... values) {
        std::string text;
        for (const Point& p : points()) text += fmt::format(fmt::runtime(format + "\n"), p.*values...);
        return text;
    }
    static constexpr auto x = &Point::x, y = &Point::y, z = &Point::z, nx = &Point::nx, ny = &Point::ny, nz = &Point::nz;
    static constexpr auto r = &Point::r, g = &Point::g, b = &Point::b, i = &Point::i, number = &Point::number, returns = &Point::returns,
                          label = &Point::label;
    static std::string xyz() { return table("{:.4f} {:.4f} {:.4f}", x, y, z); }
    static std::string xyzrgb() { return table("{:.4f} {:.4f} {:.4f} {} {} {}", x, y, z, r, g, b); }
    static std::string xyzi() { return table("{:.4f} {:.4f} {:.4f} {}", x, y, z, i); }
    support::TemporaryFolder folder;
};

TEST_F(ImportTextClouds, ColumnsByNames) {
    const char* const headers[] = {"R G B X Y Z",
                                   "red,green,blue,x,y,z",
                                   "\"Red\";\"Green\";\"Blue\";\"X\";\"Y\";\"Z\"",
                                   "# r g b x y z",
                                   "//R G B X Y Z",
                                   "Rf Gf Bf X Y Z",
                                   "R,G,B,Easting,Northing,Elevation",
                                   "diffuse_red diffuse_green diffuse_blue x y z",
                                   "# columns: red green blue x y z"};
    for (const std::string header : headers) expect_same(header + "\n" + table("{3} {4} {5} {0:.4f} {1:.4f} {2:.4f}", x, y, z, r, g, b), xyzrgb());
    expect_same("Point Id,Y [m],X [m],Height (m),Scan Angle\n" + table("7,{1:.4f},{0:.4f},{2:.4f},12", x, y, z), xyz());
    expect_same("name\tx\ty\tz\n" + table("car\t{:.4f}\t{:.4f}\t{:.4f}", x, y, z), xyz());
    expect_same("X Y Z Scalar_Intensity Classification\n" + table("{:.4f} {:.4f} {:.4f} {} {}", x, y, z, i, label), xyzi());
    expect_same("x y z nx ny nz reflectance\n" + table("{:.4f} {:.4f} {:.4f} {:.4f} {:.4f} {:.4f} {}", x, y, z, nx, ny, nz, i), xyzi());
    expect_same("//X Y Z R G B Rf Gf Bf\n60\n" + table("{:.4f} {:.4f} {:.4f} {} {} {} 0.5 0.5 0.5", x, y, z, r, g, b), xyzrgb());
    const Cloud wide = read("x y z radius\n0 0 0 0.5\n1 1 1 0.25\n");
    EXPECT_EQ(wide.points[0].radius, 0.5f);
    EXPECT_EQ(wide.points[1].radius, 0.25f);
}

TEST_F(ImportTextClouds, NamesThatDoNotFit) {
    // Prose that happens to have as many words, names of other columns, names without coordinates: passed over.
    EXPECT_TRUE(read("# made by hand\n" + xyz()).warnings.empty());
    expect_same("# made by z\n" + xyz(), xyz());
    expect_same("exported from somewhere\n" + xyz(), xyz());
    const Cloud got = read("x y z intensity class\n" + xyzrgb());
    EXPECT_TRUE(got.status.ok());
    ASSERT_EQ(got.warnings.size(), 1u);
    EXPECT_NE(got.warnings[0].find("a.txt:1: "), std::string::npos) << got.warnings[0];
    EXPECT_NE(got.warnings[0].find("--columns"), std::string::npos) << got.warnings[0];
}

TEST_F(ImportTextClouds, ColumnsByTheirLooks) {
    const std::string three = "{:.4f} {:.4f} {:.4f} ";
    expect_same(table(three + "{} {} {} {}", x, y, z, r, g, b, label), xyzrgb());
    expect_same(table(three + "{} {} {} 255", x, y, z, r, g, b), xyzrgb());
    expect_same(table(three + "{} {} {} {}", x, y, z, i, r, g, b), xyzrgb());
    expect_same(table(three + "{} {} {} {} {}", x, y, z, i, r, g, b, label), xyzrgb());
    expect_same(table(three + "{} {} {} {:.4f} {:.4f} {:.4f}", x, y, z, r, g, b, nx, ny, nz), xyzrgb());
    expect_same(table(three + "{:.4f} {:.4f} {:.4f} {} {} {}", x, y, z, nx, ny, nz, r, g, b), xyzrgb());
    expect_same(table(three + "{} {} {} car", x, y, z, r, g, b), xyzrgb());
    expect_same(table(three + "{} {} {} {}", x, y, z, i, number, returns, label), xyzi());
    expect_same(table(three + "{} {} {}", x, y, z, i, number, returns), xyzi());
    expect_same(table(three + "{} {}", x, y, z, i, label), xyzi());
    expect_same(table(three + "car", x, y, z), xyz());
    // 16 bits, and fractions.
    std::string words, fractions;
    for (const Point& p : points()) {
        const std::string start = fmt::format("{:.4f} {:.4f} {:.4f}", p.x, p.y, p.z);
        words += start + fmt::format(" {} {} {} {}\n", p.i, p.r * 257, p.g * 257, p.b * 257);
        fractions += start + fmt::format(" {:.5f} {:.5f} {:.5f}\n", p.r / 255.0, p.g / 255.0, p.b / 255.0);
    }
    expect_same(words, xyzrgb());
    expect_same(fractions, xyzrgb());
}

TEST_F(ImportTextClouds, WhatIsNotSureIsSaid) {
    const std::string three = "{:.4f} {:.4f} {:.4f} ";
    EXPECT_TRUE(read(xyz()).warnings.empty());
    EXPECT_TRUE(read(xyzrgb()).warnings.empty());
    EXPECT_TRUE(read(xyzi()).warnings.empty());
    EXPECT_TRUE(read(table(three + "{} {} {} {}", x, y, z, i, r, g, b)).warnings.empty()) << "as PTS has it";
    const Cloud returned = read(table(three + "{} {} {} {}", x, y, z, i, number, returns, label));
    ASSERT_EQ(returned.warnings.size(), 1u);
    EXPECT_NE(returned.warnings[0].find("x,y,z,i,_,_,_"), std::string::npos) << returned.warnings[0];
    EXPECT_NE(returned.warnings[0].find("--columns"), std::string::npos) << returned.warnings[0];
    const Cloud two = read("0 0 0 9 200 100 50\n1 1 1 90 100 50 20\n");
    ASSERT_EQ(two.warnings.size(), 1u) << "of two points, nothing tells intensity and blue apart";
    EXPECT_TRUE(read("X Y Z A B C D\n" + table(three + "{} {} {} {}", x, y, z, i, number, returns, label), "x,y,z,i").warnings.empty());
}

TEST_F(ImportTextClouds, ColumnsAsTheUserSays) {
    const std::string swapped = table("{3} {4} {5} {0:.4f} {1:.4f} {2:.4f}", x, y, z, r, g, b);
    expect_same(swapped, xyzrgb(), "r,g,b,x,y,z");
    expect_same(swapped, xyz(), "_,-,_,x,y,z");
    expect_same("a header of words\n" + swapped, xyzrgb(), "red,green,blue,easting,northing,height");
    expect_same("x y z r g b\n" + swapped, xyzrgb(), "r,g,b,x,y,z");  // against the names
    expect_same(table("{:.4f} {:.4f} {:.4f} {} 1 2 3", x, y, z, i), xyzi(), "x,y,z,i");
    expect_same(table("car {:.4f} {:.4f} {:.4f}", x, y, z), xyz(), "_,x,y,z");
    expect_error("1 2 3\n", "a.txt:1: 3 numbers, while 4 columns are named", "x,y,z,i");
    expect_error("1 2 3\n4 five 6\n", "a.txt:2: \"five\" is no number", "x,y,z");
    for (const char* wrong : {"", "x,y", "x,y,z,q", "x,y,z,x", "x,y,z,r,g", "x,,y,z"}) {
        const auto columns = parse_point_columns(wrong);
        ASSERT_FALSE(columns.ok()) << wrong;
        EXPECT_EQ(columns.status().exit_code(), 2) << wrong;
    }
    EXPECT_EQ(point_column_list(*parse_point_columns("X,Y,Z,intensity,Red,green,B,label,class,radius")), "x,y,z,i,r,g,b,_,class,radius");
}

// A bake of other columns must not be taken for this one.
TEST_F(ImportTextClouds, ColumnsTellBakesApart) {
    const auto path = folder.write("a.xyz", xyzrgb());
    const auto fingerprint = [&](const char* columns) {
        const auto named = std::string(columns).empty() ? PointColumns() : *parse_point_columns(columns);
        const auto scene = import_scene({path}, {default_keep_bytes, {}, named});
        EXPECT_TRUE(scene.ok()) << scene.status().message();
        const auto value = bake_fingerprint(*scene, {});
        EXPECT_TRUE(value.ok());
        return *value;
    };
    EXPECT_EQ(fingerprint(""), fingerprint(""));
    EXPECT_EQ(fingerprint("x,y,z,b,g,r"), fingerprint("x,y,z,b,g,r"));
    EXPECT_NE(fingerprint(""), fingerprint("x,y,z,b,g,r"));
    EXPECT_NE(fingerprint("x,y,z,r,g,b"), fingerprint("x,y,z,b,g,r"));
}

TEST_F(ImportTextClouds, DecimalCommas) {
    std::string semicolons, blanks, tabs, quoted;
    for (const Point& p : points()) {
        const auto comma = [](double value) {
            std::string text = fmt::format("{:.4f}", value);
            text[text.find('.')] = ',';
            return text;
        };
        const std::string X = comma(p.x), Y = comma(p.y), Z = comma(p.z);
        semicolons += X + ";" + Y + ";" + Z + ";" + fmt::format("{};{};{}\n", p.r, p.g, p.b);
        blanks += X + " " + Y + "  " + Z + fmt::format(" {} {} {}\n", p.r, p.g, p.b);
        tabs += X + "\t" + Y + "\t" + Z + fmt::format("\t{}\t{}\t{}\n", p.r, p.g, p.b);
        quoted += "\"" + X + "\",\"" + Y + "\",\"" + Z + fmt::format("\",{},{},{}\n", p.r, p.g, p.b);
    }
    for (const std::string& text : {semicolons, blanks, tabs, quoted, "X;Y;Z;R;G;B\n" + semicolons}) expect_same(text, xyzrgb());
    // Commas that separate.
    expect_same("1, 2, 3\n10, 20, 30\n", "1 2 3\n10 20 30\n");
    expect_same("1,2,3\n10,20,30\n", "1 2 3\n10 20 30\n");
    expect_same("1.5,2,3\n10,2.5,30\n", "1.5 2 3\n10 2.5 30\n");
    expect_same("1 ,2 ,3\n10 ,20 ,30\n", "1 2 3\n10 20 30\n");
    std::string damaged;
    for (int line = 0; line < 12; ++line) damaged += "1,5;2,5;3,5\n";
    expect_error(damaged + "1,5;2,5;3.x\n", "a.txt:13: \"3.x\" is no number");
}

TEST_F(ImportTextClouds, NumbersAsOthersWriteThem) {
    const std::string plain = "0.5 -250 3\n1 2 0.75\n";
    expect_same("5D-01 -2.5d+2 3.\n+1 2 7.5D-1\n", plain);
    expect_same("\"0.5\",\"-250\",\"3\"\n\"1\", \"2\" ,\"0.75\"\n", plain);
    expect_same("'0.5' '-250' '3'\n'1' '2' '0.75'\n", plain);
    expect_same("  0.5\t -250 \t3  \n1,2,0.75,\n", plain);
    expect_same(
        "\xef\xbb\xbf"
        "0.5 -250 3\n1 2 0.75",
        plain);
    expect_same("0.5 -250 3\r1 2 0.75\r", plain);
    expect_same("0.5 -250 3 \"a red car\"\n1 2 0.75 \"tree\"\n", plain);
    expect_same("0.5 -250 3 traffic light\n1 2 0.75 tree\n", plain);
    expect_error("0.5 -25o 3\n1 2 0.75\n", "a.txt:1: \"-25o\" is no number");
    expect_error("1x 2 3\n1 2 3\n", "a.txt:1: \"1x\" is no number");
    expect_error("1 2 3\n1 2 3.9197F-01\n", "a.txt:2: \"3.9197F-01\" is no number");
    expect_error(
        "\xff\xfe"
        "1\n",
        "UTF-16");
}

}  // namespace
}  // namespace raypager
