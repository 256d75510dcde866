// What the page says and gets, as texts and bytes.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "base/half.hpp"
#include "raypager/bake.hpp"
#include "support/small_scene.hpp"
#include "view/block_map.hpp"
#include "view/commands.hpp"
#include "view/page_files.hpp"
#include "view/picture_bytes.hpp"
#include "view/request_check.hpp"
#include "view/view_rates.hpp"

namespace raypager {
namespace {

TEST(ViewRequests, TargetsHaveATokenAndANameThatIsNoPath) {
    const auto target = parse_target("/abc/view.js?x=1&empty=&&y=a=b&x=2&alone");
    ASSERT_TRUE(target);
    EXPECT_EQ(target->token, "abc");
    EXPECT_EQ(target->name, "view.js");
    EXPECT_EQ(target->query, (std::map<std::string, std::string>{{"x", "1"}, {"empty", ""}, {"y", "a=b"}}));
    EXPECT_EQ(parse_target("/abc/")->name, "");
    for (const char* text : {"", "abc", "/abc", "/abc/d/e", "/abc/%2e", "/a b/c", "/abc/..\\x", "/abc/\xc3\xa4"})
        EXPECT_FALSE(parse_target(text)) << text;
}

TEST(ViewRequests, ComeFromTheirOwnPage) {
    EXPECT_TRUE(is_from_own_page({"127.0.0.1:81", "http://127.0.0.1:81", "same-origin"}, 81));
    EXPECT_TRUE(is_from_own_page({"LOCALHOST:81", {}, "none"}, 81));
    EXPECT_FALSE(is_from_own_page({"127.0.0.1", {}, {}}, 81));
    EXPECT_FALSE(is_from_own_page({"127.0.0.1:82", {}, {}}, 81));
    EXPECT_FALSE(is_from_own_page({"127.0.0.1:81", "http://localhost:81", {}}, 81));
    EXPECT_FALSE(is_from_own_page({"127.0.0.1:81", {}, "cross-site"}, 81));
    EXPECT_FALSE(is_from_own_page({{}, {}, {}}, 81));
    // Browsers leave the usual port out.
    EXPECT_TRUE(is_from_own_page({"127.0.0.1", "http://127.0.0.1", {}}, 80));
    EXPECT_TRUE(is_from_own_page({"localhost", {}, {}}, 80));
    EXPECT_FALSE(is_from_own_page({"elsewhere", {}, {}}, 80));
}

TEST(ViewRequests, TokensAreComparedAsAWhole) {
    const std::string token = random_token();
    EXPECT_EQ(token.size(), 32u);
    EXPECT_TRUE(same_token(token, token));
    EXPECT_FALSE(same_token(token.substr(1), token));
    EXPECT_FALSE(same_token("", token));
    for (size_t i = 0; i < token.size(); i++) {
        std::string other = token;
        other[i] = other[i] == '0' ? '1' : '0';
        EXPECT_FALSE(same_token(other, token));
    }
}

TEST(ViewRequests, CamerasAreThoseOfTheCommandLine) {
    const auto command = parse_camera_command(R"({"camera": "1,2,3,4,5,6,0,1,0,40,mirrored", "moving": true, "more": [1]})");
    ASSERT_TRUE(command.ok()) << command.status().message();
    EXPECT_EQ(format_camera(command->camera), "1,2,3,4,5,6,0,1,0,40,mirrored");
    EXPECT_TRUE(command->moving);
    EXPECT_FALSE(parse_camera_command(R"({"camera": "1,2,3,4,5,6,0,1,0,40", "moving": 1})")->moving);
    const std::string deep = std::string(8000, '[') + std::string(8000, ']');
    for (const std::string& body :
         {std::string(), std::string("{"), std::string("[]"), std::string("null"), std::string("{}"), deep, std::string(R"({"camera": 7})"),
          std::string(R"({"camera": "1,2,3"})"), std::string(R"({"camera": "1,2,3,1,2,3,0,1,0,40"})"),
          std::string(R"({"camera": "nan,2,3,4,5,6,0,1,0,40"})"), std::string("{\"camera\": \"\xff\xfe\"}"), std::string("\0\0", 2)})
        EXPECT_EQ(parse_camera_command(body).status().kind(), ErrorKind::usage) << body.substr(0, 60);
}

TEST(ViewRequests, LimitsAreThoseOfTheCommandLine) {
    EXPECT_EQ(parse_limit_command(R"({"limit": "512M"})")->bytes, uint64_t{512} << 20);
    EXPECT_EQ(parse_limit_command(R"({"limit": "12.5%"})")->percent, 12.5);
    const auto none = parse_limit_command(R"({"limit": ""})");
    ASSERT_TRUE(none.ok());
    EXPECT_EQ(none->bytes, 0u);
    EXPECT_EQ(none->percent, 0);
    for (const char* body : {"{}", R"({"limit": 5})", R"({"limit": "-1"})", R"({"limit": "0%"})", R"({"limit": "101%"})", R"({"limit": "1e99G"})"})
        EXPECT_FALSE(parse_limit_command(body).ok()) << body;
}

TEST(ViewRequests, PixelsLieInThePicture) {
    const auto pixel = parse_pixel_query({{"x", "639"}, {"y", "0"}}, 640, 360);
    ASSERT_TRUE(pixel.ok());
    EXPECT_EQ(pixel->x, 639u);
    for (const auto& [x, y] :
         {std::pair{"640", "0"}, {"0", "360"}, {"-1", "0"}, {"", "0"}, {"1.5", "0"}, {"99999999999999999999", "0"}, {"1", "0x1"}})
        EXPECT_FALSE(parse_pixel_query({{"x", x}, {"y", y}}, 640, 360).ok()) << x << " " << y;
    EXPECT_FALSE(parse_pixel_query({{"x", "1"}}, 640, 360).ok());
    EXPECT_EQ(parse_after({{"after", "12"}}), 12u);
    EXPECT_EQ(parse_after({{"after", "-12"}}), 0u);
    EXPECT_EQ(parse_after({}), 0u);
}

TEST(ViewRequests, SavedPicturesArePngOrExr) {
    EXPECT_EQ(parse_save_query({{"format", "exr"}})->ending, ".exr");
    EXPECT_EQ(parse_save_query({{"format", "png"}, {"exposure", "-1.5"}})->exposure, -1.5);
    for (const Query& query :
         {Query{}, Query{{"format", "../x"}}, Query{{"format", "png"}, {"exposure", "65"}}, Query{{"format", "png"}, {"exposure", "nan"}}})
        EXPECT_FALSE(parse_save_query(query).ok());
}

TEST(ViewRequests, ThePageIsAllThereIs) {
    ASSERT_NE(find_page_file(""), nullptr);
    EXPECT_EQ(find_page_file(""), find_page_file("index.html"));
    EXPECT_EQ(find_page_file(".."), nullptr);
    EXPECT_EQ(find_page_file("view.hpp"), nullptr);
    // Scripts and styles of the page are in the program, and nothing that it names is elsewhere.
    for (const PageFile& file : page_files()) {
        EXPECT_EQ(file.text.find("://"), std::string_view::npos) << file.name;
        for (size_t at = 0; (at = file.text.find("from \"./", at)) != std::string_view::npos; at++) {
            const std::string_view rest = file.text.substr(at + 8);
            EXPECT_NE(find_page_file(rest.substr(0, rest.find('"'))), nullptr) << file.name << ": " << rest.substr(0, 20);
        }
    }
}

TEST(ViewRequests, PicturesGoAsHalves) {
    const Image image = {2, 1, 4, {0.5f, 1, -2, 0.25f, 1e9f, std::nanf(""), 1e-7f, 1}};
    const std::string bytes = half_pixels(image);
    ASSERT_EQ(bytes.size(), 12u);
    const auto half = [&](size_t i) {
        return static_cast<uint16_t>(static_cast<unsigned char>(bytes[2 * i]) | static_cast<unsigned char>(bytes[2 * i + 1]) << 8);
    };
    EXPECT_EQ(half(0), 0x3800);
    EXPECT_EQ(half(1), 0x3c00);
    EXPECT_EQ(half(2), 0xc000);
    EXPECT_EQ(float_of_half(half(3)), largest_half);
    EXPECT_EQ(half(4), 0);
    EXPECT_EQ(half(5), 2);
}

TEST(ViewRequests, BlocksThatAreWantedComeFirst) {
    BakeOptions options;
    options.block_bytes = 16 << 10;
    const auto baked = bake(support::small_scene(30), options);
    ASSERT_TRUE(baked.ok()) << baked.status().message();
    const Blocks& scene = baked->blocks;
    EXPECT_EQ(scene.first_block_in_world(), 0u);
    std::vector<BlockStatus> status(scene.count());
    ASSERT_GT(status.size(), 4u);
    const auto last = static_cast<uint32_t>(status.size() - 1);
    status[last].waiting_rays = 7;
    status[last - 1].state = BlockStatus::State::on_its_way;
    std::array<float, 3> eye = scene.bounds(0).first;
    eye[0] -= 0.001f;
    EXPECT_EQ(blocks_to_show(scene, status, eye, 100).size(), status.size());
    auto shown = blocks_to_show(scene, status, eye, 3);
    ASSERT_EQ(shown.size(), 3u);
    std::sort(shown.begin(), shown.end());
    EXPECT_EQ(shown[1], last - 1);
    EXPECT_EQ(shown[2], last);
    const std::string records = block_records(scene, status, shown);
    ASSERT_EQ(records.size(), 96u);
    float upper_y;
    uint32_t words[2];
    std::memcpy(&upper_y, records.data() + 64 + 16, 4);
    std::memcpy(words, records.data() + 64 + 24, 8);
    EXPECT_EQ(upper_y, scene.bounds(last).second[1]);
    EXPECT_EQ(words[0], 0u);
    EXPECT_EQ(words[1], 7u);
}

TEST(ViewRequests, RatesAreThoseOfTheLastSecond) {
    RateMeter meter;
    EXPECT_EQ(meter.rates().rays, 0);
    RenderProgress progress;
    for (int i = 0; i <= 300; i++) {
        progress.rays = static_cast<uint64_t>(i < 200 ? 1000 * i : 200000 + 10 * (i - 200));
        progress.bytes_loaded = static_cast<uint64_t>(5 * i);
        meter.add(0.01 * i, progress);
        if (i == 150) {
            EXPECT_NEAR(meter.rates().rays, 100000, 1000);
        }
    }
    EXPECT_NEAR(meter.rates().bytes, 500, 10);
    EXPECT_LT(meter.rates().rays, 25000);  // of a second and a tenth
    meter.begin_anew();
    progress.rays = 0;
    meter.add(4, progress);
    EXPECT_EQ(meter.rates().rays, 0);
}

}  // namespace
}  // namespace raypager
