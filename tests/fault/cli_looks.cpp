// Looks of bare meshes, views and turntables from end to end, as users give them.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

using support::read_file;

class CliLooks : public testing::Test {
protected:
    void SetUp() override {
        // A wedge that is not like its mirror image from any side.
        write("wedge.off", "OFF\n5 6 0\n0 0 0\n2 0 0\n2 0 1\n0 0 1\n0.3 1.4 0.8\n3 0 1 2\n3 0 2 3\n3 0 4 1\n3 1 4 2\n3 2 4 3\n3 3 4 0\n");
    }
    // The report of a render of a few pixels that must succeed.
    nlohmann::json render(const std::string& arguments) const {
        const std::string command = fmt::format("cd '{}' && timeout 120 '{}' render {} --report r.json >.stdout 2>.stderr </dev/null",
                                                folder_.string(), RAYPAGER_PROGRAM, arguments);
        const int raw = std::system(command.c_str());
        EXPECT_TRUE(WIFEXITED(raw) && WEXITSTATUS(raw) == 0) << arguments << "\n" << read_file(folder_ / ".stderr");
        return nlohmann::json::parse(read_file(folder_ / "r.json"), nullptr, false);
    }
    std::string film(const std::string& arguments) const { return render(arguments)["image"]["film_hash"]; }
    size_t block_files(const std::string& folder) const {
        size_t count = 0;
        for (const auto& entry : std::filesystem::directory_iterator(folder_ / folder)) count += entry.path().extension() == ".rpb";
        return count;
    }
    bool baked() const { return read_file(folder_ / ".stderr").find("baked already") == std::string::npos; }
    void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name, std::ios::binary) << text; }
    void write_scene(const std::string& name, const std::string& before, const std::string& color) const {
        write(name, fmt::format("Film \"rgb\" \"integer xresolution\" 24 \"integer yresolution\" 16\n{}LookAt 4 3 5  1 0.5 0.4  0 1 0\n"
                                "Camera \"perspective\" \"float fov\" 30\nSampler \"independent\" \"integer pixelsamples\" 4\nWorldBegin\n"
                                "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial \"diffuse\" \"rgb reflectance\" [{}]\n"
                                "Shape \"trianglemesh\" \"point3 P\" [0 0 0  2 0 0  2 0 1  0 0 1  0.3 1.4 0.8]\n"
                                "\"integer indices\" [0 1 2  0 2 3  0 4 1  1 4 2  2 4 3  3 4 0]\n",
                                before, color));
    }

    const support::TemporaryFolder temporary_;
    const std::filesystem::path folder_ = temporary_.path();
};

TEST_F(CliLooks, AnotherLookOrViewIsNotBakedAgain) {
    const std::string small = "wedge.off -o a.pfm --spp 2 --cache-dir ";
    render(small + "one --size 24x16");
    EXPECT_TRUE(baked());
    for (const std::string look : {"--size 24x16 --material gold --light sun:20,40,2", "--size 16x24 --sky 1,0.5,0.25 --light none",
                                   "--size 24x16 --camera 4,3,5,1,0.5,0.4,0,1,0,30 --material glass"}) {
        const std::string cached = film(small + "one " + look);
        EXPECT_FALSE(baked()) << look;
        EXPECT_EQ(block_files("one"), 1u);
        std::filesystem::remove_all(folder_ / "two");
        EXPECT_EQ(film(small + "two " + look), cached) << look;
        EXPECT_TRUE(baked());
    }
    render(small + "one --size 24x16 --no-ground");
    EXPECT_TRUE(baked()) << "that is geometry";
}

TEST_F(CliLooks, NorIsASceneWhoseColorsChange) {
    write_scene("s.pbrt", "", "0.5 0.5 0.5");
    const std::string grey = film("s.pbrt -o a.pfm --cache-dir one");
    write_scene("s.pbrt", "# a line more\n", "0.5 0.25 0.125");
    const std::string brown = film("s.pbrt -o a.pfm --cache-dir one");
    EXPECT_FALSE(baked());
    EXPECT_NE(brown, grey);
    EXPECT_EQ(film("s.pbrt -o a.pfm --cache-dir two"), brown);
    EXPECT_TRUE(baked());
}

// --camera means the same for a mesh and for a scene that contains it, whatever the scene's own camera does with left and right.
TEST_F(CliLooks, CamerasShowAMeshAsTheyShowItInAScene) {
    const std::string camera = " --spp 4 --size 24x16 --camera 4,3,5,1,0.5,0.4,0,1,0,30";
    const std::string bare = film("wedge.off -o a.pfm --material diffuse:0.5,0.5,0.5 --sky 1,1,1 --light none --no-ground" + camera);
    write_scene("left.pbrt", "", "0.5 0.5 0.5");
    write_scene("right.pbrt", "Scale -1 1 1\n", "0.5 0.5 0.5");
    EXPECT_EQ(film("left.pbrt -o a.pfm" + camera), bare);
    EXPECT_EQ(film("right.pbrt -o a.pfm" + camera), bare);
    EXPECT_NE(film("left.pbrt -o a.pfm" + camera + ",mirrored"), bare);
}

// What a report says of its camera shows the same picture.
TEST_F(CliLooks, CamerasOfReportsComeBack) {
    write_scene("left.pbrt", "", "0.5 0.5 0.5");
    write_scene("right.pbrt", "Scale -1 1 1\n", "0.5 0.5 0.5");
    for (const std::string input : {"left.pbrt", "right.pbrt", "wedge.off"})
        for (const std::string size : {"24x16", "16x24"}) {
            const auto own = render(fmt::format("{} -o a.pfm --spp 2 --size {}", input, size));
            const std::string text = own["camera"];
            EXPECT_EQ(text.ends_with(",mirrored"), input == "left.pbrt");
            const auto again = render(fmt::format("{} -o a.pfm --spp 2 --size {} --camera {}", input, size, text));
            EXPECT_EQ(again["image"]["film_hash"], own["image"]["film_hash"]) << input << " " << size << " " << text;
            EXPECT_EQ(again["camera"], own["camera"]);
            EXPECT_EQ(own["bounds"]["min"], (nlohmann::json{0, 0, 0})) << "the ground is not counted";
        }
}

// So do lenses; of a camera that no text describes the report says nothing but its axes.
TEST_F(CliLooks, LensesOfReportsComeBack) {
    write_scene("lens.pbrt", "Scale -1 1 1\n", "0.5 0.5 0.5");
    std::string text = read_file(folder_ / "lens.pbrt");
    text.replace(text.find("\"float fov\""), 0, "\"float lensradius\" 0.2 \"float focaldistance\" 6 ");
    write("lens.pbrt", text);
    const auto own = render("lens.pbrt -o a.pfm --spp 2");
    const std::string camera = own["camera"];
    EXPECT_TRUE(camera.ends_with(",lens,0.2,6")) << camera;
    EXPECT_NEAR(own["settings"]["camera"]["lens"]["radius"].get<double>(), 0.2, 1e-6);
    EXPECT_EQ(film("lens.pbrt -o a.pfm --spp 2 --camera " + camera), own["image"]["film_hash"]);
    EXPECT_NE(film("lens.pbrt -o a.pfm --spp 2 --camera " + camera.substr(0, camera.find(",lens"))), own["image"]["film_hash"]);
    text.replace(text.find("\"perspective\""), 13, "\"orthographic\"");
    write("parallel.pbrt", text);
    const auto parallel = render("parallel.pbrt -o a.pfm --spp 2");
    EXPECT_TRUE(parallel["camera"].is_null());
    EXPECT_EQ(parallel["settings"]["camera"]["projection"], "orthographic");
}

TEST_F(CliLooks, TurntablesWriteAllTheirPictures) {
    const auto report = render("wedge.off -o turn.pfm --spp 2 --size 24x16 --turntable 3");
    ASSERT_EQ(report["turntable"].size(), 3u);
    for (const char* name : {"turn_000.pfm", "turn_001.pfm", "turn_002.pfm"}) EXPECT_TRUE(std::filesystem::exists(folder_ / name)) << name;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "turn.pfm"));
    EXPECT_EQ(report["turntable"][1]["output"], "turn_001.pfm");
    for (const size_t i : {0u, 2u}) {
        const std::string camera = report["turntable"][i]["camera"];
        EXPECT_EQ(film("wedge.off -o a.pfm --spp 2 --size 24x16 --camera " + camera), report["turntable"][i]["film_hash"]) << i;
    }
    // A camera that is given stays.
    const std::string given = "3,-4,3,1,0.7,0.5,0,0,1,30";
    const auto turned = render("wedge.off -o turn.pfm --spp 2 --size 24x16 --turntable 2 --camera " + given);
    EXPECT_EQ(film("wedge.off -o a.pfm --spp 2 --size 24x16 --camera " + given), turned["turntable"][0]["film_hash"]);
}

// Twice the light, to the last bit; the film itself is as it was.
TEST_F(CliLooks, ExposureMultipliesThePicture) {
    const std::string base = film("wedge.off -o a.pfm --spp 2 --size 24x16");
    EXPECT_EQ(film("wedge.off -o b.pfm --spp 2 --size 24x16 --exposure 1"), base);
    const std::string a = read_file(folder_ / "a.pfm"), b = read_file(folder_ / "b.pfm");
    ASSERT_EQ(a.size(), b.size());
    const size_t header = a.size() - size_t{24} * 16 * 12;
    bool any = false;
    for (size_t at = header; at < a.size(); at += 4) {
        float x, y;
        std::memcpy(&x, &a[at], 4);
        std::memcpy(&y, &b[at], 4);
        EXPECT_EQ(y, 2 * x);
        any = any || x > 0;
    }
    EXPECT_TRUE(any);
}

}  // namespace
}  // namespace raypager
