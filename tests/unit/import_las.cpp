// Readers of LAS files: every version and point format, and headers that are damaged or contradict themselves.
#include <gtest/gtest.h>

#include "unit/clouds_fixture.hpp"

namespace raypager {
namespace {

using namespace clouds_test;

class ImportLas : public ImportClouds {};

TEST_F(ImportLas, OfEveryVersionAndFormat) {
    for (const uint8_t minor : {0, 1, 2, 3, 4})
        for (uint8_t format = 0; format <= 10; ++format)
            for (const uint16_t extra : {0, 5}) {
                SCOPED_TRACE("1." + std::to_string(minor) + " format " + std::to_string(format) + " extra " + std::to_string(extra));
                LasFile file = make_las(minor, format);
                file.extra_bytes = extra;
                file.offset = {3, -2, 0.5};
                const Points got = read("a.las", to_las(file));
                ASSERT_EQ(got.points.size(), file.points.size());
                EXPECT_TRUE(got.has_color) << "classes where there is no colour";
                for (size_t i = 0; i < got.points.size(); ++i) {
                    const auto& p = file.points[i].position;
                    expect_position(got.points[i], p[0] * 0.01 + 3, p[1] * 0.01 - 2, p[2] * 0.01 + 0.5);
                    const bool colored = format == 2 || format == 3 || format == 5 || format == 7 || format == 8 || format == 10;
                    if (!colored) continue;
                    EXPECT_EQ(got.points[i].color, rgb((1000 * i + 128) / 257, (65535 - 1000 * i + 128) / 257, 128));
                }
            }
}

TEST_F(ImportLas, BetweenOtherRecords) {
    LasFile file = make_las(4, 7);
    file.variable_records = test::las_variable_record("LASF_Projection", 2112, std::string(300, 'x')) + test::las_variable_record("me", 1, "");
    file.variable_record_count = 2;
    file.extended_records = std::string(100, 'e');
    EXPECT_EQ(read("a.las", to_las(file)).points.size(), file.points.size());
    file.legacy_count = false;
    EXPECT_EQ(read("a.las", to_las(file)).points.size(), file.points.size()) << "the count in 64 bits";
    file.legacy_count = true;
    file.wide_count = false;
    EXPECT_EQ(read("a.las", to_las(file)).points.size(), file.points.size()) << "the count in 32 bits";
}

TEST_F(ImportLas, LeavesOutWithheldPointsAndNoise) {
    for (const uint8_t format : {uint8_t{0}, uint8_t{6}}) {
        LasFile file = make_las(4, format, 10);
        file.points[3].withheld = true;
        file.points[5].classification = 7;
        file.points[6].classification = 18;  // only 31 classes before format 6; there 18 is reserved
        const Points got = read("a.las", to_las(file));
        EXPECT_EQ(got.points.size(), format == 0 ? 8u : 7u);
        EXPECT_EQ(got.count, 10u);
    }
}

TEST_F(ImportLas, ColorsOfEightBits) {
    LasFile file = make_las(2, 3, 5);
    for (size_t i = 0; i < 5; ++i) file.points[i].color = {static_cast<uint16_t>(60 * i), 255, 1};
    const Points got = read("a.las", to_las(file));
    for (size_t i = 0; i < 5; ++i) EXPECT_EQ(got.points[i].color, rgb(60 * static_cast<uint32_t>(i), 255, 1));
    file.points[4].color[2] = 256;
    EXPECT_EQ(read("a.las", to_las(file)).points[4].color, rgb(1, 1, 1)) << "one value beyond a byte: all are of 16 bits";
}

TEST_F(ImportLas, ThatIsDamaged) {
    const LasFile file = make_las(4, 7);
    const std::string sound = to_las(file);
    const auto with = [&](size_t at, const std::string& bytes) {
        std::string damaged = sound;
        test::put(damaged, at, bytes);
        return damaged;
    };
    expect_error("a.las", "", "is empty");
    expect_error("a.las", "LAS", "LASF");
    expect_error("a.las", sound.substr(0, 200), "ends within its header");
    expect_error("a.las", sound.substr(0, sound.size() - 1), "promises 40 points of 36 bytes, but only 39 are there");
    expect_error("a.las", with(0, "LASZ"), "not a LAS file");
    expect_error("a.las", with(24, "\2"), "version 2.4");
    expect_error("a.las", with(25, "\5"), "version 1.5");
    expect_error("a.las", with(94, bytes_of(uint16_t{227})), "header of 227 bytes");
    expect_error("a.las", with(96, bytes_of(uint32_t{10})), "byte 96");
    expect_error("a.las", with(96, bytes_of(0xffffffffu)), "byte 96");
    expect_error("a.las", with(104, "\x0b"), "point format 11");
    expect_error("a.las", with(105, bytes_of(uint16_t{35})), "points of 35 bytes");
    expect_error("a.las", with(107, bytes_of(39u)).replace(247, 8, bytes_of(uint64_t{38})), "there are 39 points and in byte 247 that there are 38");
    expect_error("a.las", with(107, bytes_of(41u)).replace(247, 8, bytes_of(uint64_t{42})), "there are 41 points and in byte 247 that there are 42");
    expect_error("a.las", with(107, bytes_of(41u)).replace(247, 8, bytes_of(uint64_t{41})), "promises 41 points");
    const std::string no_count = with(107, std::string(4, '\0')).replace(247, 8, std::string(8, '\0'));
    expect_error("a.las", no_count.substr(0, 375), "has no points");
    expect_error("a.las", no_count.substr(0, no_count.size() - 1), "has no points");
    expect_error("a.las", with(107, std::string(4, '\xff')).replace(247, 8, std::string(8, '\xff')).substr(0, sound.size() - 1), "damaged");
    expect_error("a.las", with(131, bytes_of(0.0)), "scale of 0");
    expect_error("a.las", with(139, bytes_of(double{NAN})), "scale of nan");
    expect_error("a.las", with(147, bytes_of(1e300)), "coordinates beyond");
    expect_error("a.las", with(155, bytes_of(double{INFINITY})), "coordinates beyond");
}

// What contradicts itself in a header is read as the size of the file bears it out, and said.
TEST_F(ImportLas, ThatContradictsItself) {
    const auto expect = [&](const std::string& bytes, size_t points, const std::string& warning) {
        const auto cloud = CloudFile::open(folder.write("odd.las", bytes));
        ASSERT_TRUE(cloud.ok()) << cloud.status().message();
        EXPECT_EQ((*cloud)->count(), points);
        EXPECT_EQ(read("odd.las", bytes).points.size(), points);
        ASSERT_EQ((*cloud)->warnings().size(), warning.empty() ? 0u : 1u) << (*cloud)->warnings().at(0);
        if (warning.empty()) return;
        EXPECT_EQ((*cloud)->warnings()[0].find((folder / "odd.las").string() + ": "), 0u) << (*cloud)->warnings()[0];
        EXPECT_NE((*cloud)->warnings()[0].find(warning), std::string::npos) << (*cloud)->warnings()[0];
    };
    LasFile file = make_las(4, 7);
    const std::string sound = to_las(file), ones(8, '\xff'), zeros(8, '\0');
    const auto counts = [&](const std::string& old, const std::string& wide) {
        return std::string(sound).replace(107, 4, old).replace(247, 8, wide);
    };
    const std::string right = bytes_of(uint64_t{40});
    expect(counts(ones.substr(0, 4), right), 40, "");
    expect(counts(zeros.substr(0, 4), right), 40, "");
    expect(counts(bytes_of(40u), zeros), 40, "");
    expect(counts(bytes_of(39u), right), 40, "its size bears out 40");
    expect(counts(bytes_of(40u), bytes_of(uint64_t{1} << 40)), 40, "its size bears out 40");
    expect(counts(bytes_of(40u), ones), 40, "its size bears out 40");
    expect(counts(bytes_of(100u), right) + "x", 40, "its size bears out 40");
    expect(counts(zeros.substr(0, 4), zeros), 40, "its size says 40");
    expect(counts(ones.substr(0, 4), ones), 40, "its size says 40");
    expect(std::string(sound).replace(100, 4, ones.substr(0, 4)), 40, "variable length record 1 of 4294967295");
    expect(std::string(sound).replace(243, 4, bytes_of(1u)), 40, "extended records");
    expect(std::string(sound).replace(235, 12, ones + bytes_of(1u)), 40, "extended records");
    const std::string old = to_las(make_las(2, 3));
    expect(std::string(old).replace(107, 4, ones.substr(0, 4)), 40, "its size says 40");
    expect(std::string(old).replace(107, 4, bytes_of(30u)), 30, "");
    file.variable_records = test::las_variable_record("x", 1, "four").substr(0, 57);
    file.variable_record_count = 1;
    expect(to_las(file), 40, "would reach into the points");
    file.extended_records = std::string(100, 'e');
    file.variable_records.clear();
    file.variable_record_count = 0;
    expect(to_las(file).replace(107, 4, bytes_of(7u)), 40, "its size bears out 40");
    // A longer header than the version has.
    std::string longer = sound;
    longer.insert(375, 20, 'h').replace(94, 6, bytes_of(uint16_t{395}) + bytes_of(395u));
    expect(longer, 40, "");
}

}  // namespace
}  // namespace raypager
