// Sizes, counts, percentages, picture sizes and cameras as they are written on the command line.
#include <gtest/gtest.h>

#include "cli/values.hpp"
#include "raypager/camera_text.hpp"

namespace raypager {
namespace {

void expect_usage_error(const Status& status, const std::string& text) {
    ASSERT_FALSE(status.ok()) << "'" << text << "' was taken";
    EXPECT_EQ(status.kind(), ErrorKind::usage) << text;
    EXPECT_NE(status.message().find("'" + text + "'"), std::string::npos) << "the message does not quote '" << text << "': " << status.message();
}

TEST(CliValues, SizesAreBinary) {
    EXPECT_EQ(*parse_size("1"), 1u);
    EXPECT_EQ(*parse_size("65537"), 65537u);
    EXPECT_EQ(*parse_size("4K"), 4096u);
    EXPECT_EQ(*parse_size("4k"), 4096u);
    EXPECT_EQ(*parse_size("3M"), 3u << 20);
    EXPECT_EQ(*parse_size("1.5G"), uint64_t{3} << 29);
    EXPECT_EQ(*parse_size("2T"), uint64_t{2} << 40);
    for (const char* text : {"8G", "8g", "8GB", "8gb", "8GiB", "8gib", "8 GB", "8 GiB", "8Gib"})
        EXPECT_EQ(*parse_size(text), uint64_t{8} << 30) << text;
    for (const char* text : {"10m", "10MB", "10 MiB", "10.0 MiB", "10485760", "10485760B", "10485760 bytes", "10,485,760", "10_485_760"})
        EXPECT_EQ(*parse_size(text), uint64_t{10} << 20) << text;
    EXPECT_EQ(*parse_size("512kb"), 512u << 10);
    EXPECT_EQ(*parse_size("4096B"), 4096u);
    for (const uint64_t bytes : {uint64_t{1}, uint64_t{7340032}, uint64_t{5} << 33})
        EXPECT_EQ(*parse_size(format_bytes(bytes)), bytes) << "as printed";
}

TEST(CliValues, WrongSizesAreRefused) {
    for (const char* text : {"",      " ", "0",  "0K",  "-1",  "-4M",  "1,5", "1,50,000", ",000", "1,000K", "1,000_000", "abc", "4X",   "4MX", "4iB",
                             "4MiBB", "M", "MB", "4M ", " 4M", "4  M", "nan", "inf",      "infM", "1e30",   "0x10",      "25%", "4,5M", "+4"})
        expect_usage_error(parse_size(text).status(), text);
}

TEST(CliValues, SizeOrPercent) {
    EXPECT_EQ(parse_size_or_percent("25%")->percent, 25);
    EXPECT_EQ(parse_size_or_percent("25%")->bytes, 0u);
    EXPECT_EQ(parse_size_or_percent("0.5%")->percent, 0.5);
    EXPECT_EQ(parse_size_or_percent("100%")->percent, 100);
    EXPECT_EQ(parse_size_or_percent("64M")->bytes, 64u << 20);
    EXPECT_EQ(parse_size_or_percent("64M")->percent, 0);
    for (const char* text : {"", "%", "0%", "-5%", "101%", "nan%", "25%%", "25 %", "K%", "-1M"})
        expect_usage_error(parse_size_or_percent(text).status(), text);
}

TEST(CliValues, CountsAreDecimal) {
    EXPECT_EQ(*parse_count("64", 1, 65536), 64u);
    EXPECT_EQ(*parse_count("2.5M", 1, 1u << 30), 2500000u);
    EXPECT_EQ(*parse_count("1.1M", 1, 1u << 30), 1100000u);
    EXPECT_EQ(*parse_count("1K", 1000, 2000), 1000u);
    EXPECT_EQ(*parse_count("0", 0, 10), 0u);
    for (const char* text : {"1M", "1m", "1 M", "1000K", "1,000,000", "1_000_000"}) EXPECT_EQ(*parse_count(text, 1, 1u << 30), 1000000u) << text;
    EXPECT_EQ(*parse_count("4294967295", 0, 0xffffffffu), 0xffffffffu);
    for (const char* text :
         {"", "0", "65537", "-1", "-3", "1,00", "1,000K", "1  K", "1KB", "1.5", "1.0005K", "1e9", "sixty", "6 4", "nan", "4294967297"})
        expect_usage_error(parse_count(text, 1, 65536).status(), text);
}

TEST(CliValues, Seconds) {
    EXPECT_EQ(*parse_seconds("0.25"), 0.25);
    EXPECT_EQ(*parse_seconds("60"), 60);
    for (const char* text : {"", "0", "-1", "1m", "nan", "inf", "1e300"}) expect_usage_error(parse_seconds(text).status(), text);
}

TEST(CliValues, ImageSizes) {
    EXPECT_EQ(parse_image_size("1280x720")->width, 1280u);
    EXPECT_EQ(parse_image_size("1280x720")->height, 720u);
    EXPECT_EQ(parse_image_size("16384x16384")->height, 16384u);
    for (const char* text : {"", "x", "1280", "1280x", "x720", "0x0", "0x720", "1280x0", "-1x5", "1280X720", "1280x720x3", "1.5x2", "16385x16384",
                             "4294967297x1", "1280 x 720"})
        expect_usage_error(parse_image_size(text).status(), text);
}

TEST(CliValues, Cameras) {
    const auto camera = parse_camera("1,2,3,-4,5.5,6,0,1,0,40");
    ASSERT_TRUE(camera.ok()) << camera.status().message();
    EXPECT_EQ(camera->eye, (Float3{1, 2, 3}));
    EXPECT_EQ(camera->target, (std::array{-4.0, 5.5, 6.0}));
    EXPECT_EQ(camera->up, (std::array{0.0, 1.0, 0.0}));
    EXPECT_EQ(camera->fov_degrees, 40);
    for (const char* text :
         {"", "1,2,3", "1,2,3,4,5,6,0,1,0", "1,2,3,4,5,6,0,1,0,40,7", "1,2,3,4,5,6,0,1,0,", "1,2,3,4,5,6,0,1,0,0", "1,2,3,4,5,6,0,1,0,180",
          "1,2,3,4,5,6,0,1,0,nan", "1,2,3,4,5,6,0,1,0,-40", "1,2,3,1,2,3,0,1,0,40", "0,0,0,0,5,0,0,1,0,40", "0,0,0,0,5,0,0,0,0,40",
          "1e300,2,3,4,5,6,0,1,0,40", "a,2,3,4,5,6,0,1,0,40", "1;2;3;4;5;6;0;1;0;40", "1,2,3,4,5,6,0,1,0,40 "})
        expect_usage_error(parse_camera(text).status(), text);
}

TEST(CliValues, TextsForPeople) {
    EXPECT_EQ(format_bytes(0), "0 bytes");
    EXPECT_EQ(format_bytes(999), "999 bytes");
    EXPECT_EQ(format_bytes(4u << 20), "4.00 MiB");
    EXPECT_EQ(format_bytes(uint64_t{3} << 29), "1.50 GiB");
    EXPECT_EQ(format_bytes(1023u << 10), "1.00 MiB");
    EXPECT_EQ(format_count(0), "0");
    EXPECT_EQ(format_count(999), "999");
    EXPECT_EQ(format_count(1000), "1,000");
    EXPECT_EQ(format_count(12345678), "12,345,678");
    EXPECT_EQ(format_duration(0.421), "0.42 s");
    EXPECT_EQ(format_duration(12.34), "12.3 s");
    EXPECT_EQ(format_duration(245), "4:05");
    EXPECT_EQ(format_duration(3723), "1:02:03");
}

}  // namespace
}  // namespace raypager
