// The program as its users meet it: exit status, one clear line on stderr for whatever is wrong, and a small job from end to end.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

using support::read_file;

// Digits in the longest run of them.
size_t longest_number(const std::string& text) {
    size_t longest = 0, run = 0;
    for (const char c : text) {
        run = c >= '0' && c <= '9' ? run + 1 : 0;
        longest = std::max(longest, run);
    }
    return longest;
}

// A folder of its own for every test, and the program run inside it.
class CliProgram : public testing::Test {
protected:
    struct Outcome {
        int status = -1;
        std::string output, errors;
    };

    // arguments: as typed into a shell.
    Outcome run(const std::string& arguments) const {
        // The redirections come first, so that a test can name others.
        const std::string command =
            fmt::format("cd '{}' && timeout 120 '{}' >.stdout 2>.stderr </dev/null {}", folder_.string(), program_, arguments);
        const int raw = std::system(command.c_str());
        return {WIFEXITED(raw) ? WEXITSTATUS(raw) : -1, read_file(folder_ / ".stdout"), read_file(folder_ / ".stderr")};
    }

    // setup: shell commands that come first.
    Outcome run_after(const std::string& setup, const std::string& arguments) const {
        const std::string command =
            fmt::format("cd '{}' && {} && '{}' >.stdout 2>.stderr </dev/null {}", folder_.string(), setup, program_, arguments);
        const int raw = std::system(command.c_str());
        return {WIFEXITED(raw) ? WEXITSTATUS(raw) : -1, read_file(folder_ / ".stdout"), read_file(folder_ / ".stderr")};
    }

    // The command must fail with this status and say why in one line that contains what is named.
    void expect_error(const std::string& arguments, int status, const std::string& named) const {
        const Outcome outcome = run(arguments);
        EXPECT_EQ(outcome.status, status) << arguments << "\n" << outcome.errors;
        EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1) << arguments << "\n" << outcome.errors;
        EXPECT_TRUE(outcome.errors.starts_with("raypager: ")) << arguments << "\n" << outcome.errors;
        EXPECT_NE(outcome.errors.find(named), std::string::npos) << arguments << ": no '" << named << "' in: " << outcome.errors;
        EXPECT_EQ(outcome.output, "") << arguments;
    }

    void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name, std::ios::binary) << text; }
    bool exists(const std::string& name) const { return std::filesystem::exists(folder_ / name); }
    nlohmann::json read_json(const std::string& name) const { return nlohmann::json::parse(read_file(folder_ / name), nullptr, false); }

    // A bumpy sheet of 2 n^2 triangles under a white sky, 16 x 12 pixels.
    void write_scene(const std::string& name, int n) const {
        std::string points, indices;
        for (int y = 0; y <= n; ++y)
            for (int x = 0; x <= n; ++x) points += fmt::format("{} {} {} ", x, (x * 7 + y * 13) % 5 * 0.1, y);
        for (int y = 0; y < n; ++y)
            for (int x = 0; x < n; ++x) {
                const int corner = y * (n + 1) + x;
                indices += fmt::format("{} {} {} {} {} {} ", corner, corner + n + 1, corner + 1, corner + 1, corner + n + 1, corner + n + 2);
            }
        write(name, fmt::format("Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 12\n"
                                "Sampler \"independent\" \"integer pixelsamples\" 2\nIntegrator \"volpath\" \"integer maxdepth\" 3\n"
                                "LookAt {0} {1} {2}  {0} 0 {0}  0 1 0\nCamera \"perspective\" \"float fov\" 60\nWorldBegin\n"
                                "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial \"diffuse\" \"rgb reflectance\" [0.5 0.4 0.3]\n"
                                "Shape \"trianglemesh\" \"point3 P\" [{3}] \"integer indices\" [{4}]\n",
                                n * 0.5, n * 0.8, n * -0.6, points, indices));
    }

    const char* program_ = RAYPAGER_PROGRAM;
    const support::TemporaryFolder temporary_;
    const std::filesystem::path folder_ = temporary_.path();
};

// The system's signal for it would end the program without a word.
TEST_F(CliProgram, AFileThatMayNotGrowIsAnError) {
    const Outcome outcome = run_after("ulimit -f 64", "make-scene clutter -o clutter --triangles 100k");
    EXPECT_EQ(outcome.status, 1) << outcome.errors;
    EXPECT_NE(outcome.errors.find("File too large"), std::string::npos) << outcome.errors;
}

TEST_F(CliProgram, HelpAndVersionSucceed) {
    EXPECT_EQ(run("--version").output.substr(0, 9), "raypager ");
    for (const char* verb : {"", "devices", "make-scene", "bake", "inspect", "render", "plan", "compare"}) {
        const Outcome outcome = run(fmt::format("{} --help", verb));
        EXPECT_EQ(outcome.status, 0) << verb;
        EXPECT_NE(outcome.output.find("Usage: raypager"), std::string::npos) << verb;
        EXPECT_EQ(outcome.errors, "") << verb;
    }
}

TEST_F(CliProgram, HelpOfAVerb) {
    for (const char* verb : {"devices", "make-scene", "bake", "inspect", "render", "plan", "compare", "bench", "bench sweep"}) {
        const Outcome by_name = run(fmt::format("help {}", verb)), by_option = run(fmt::format("{} --help", verb));
        EXPECT_EQ(by_name.status, 0) << verb;
        EXPECT_EQ(by_name.output, by_option.output) << verb;
        EXPECT_EQ(by_name.output.find(fmt::format("Usage: raypager {}", verb)), 0u) << by_name.output;
        std::istringstream lines(by_name.output);
        for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80u) << line;
    }
    EXPECT_EQ(run("help").output, run("--help").output);
    EXPECT_NE(run("help").output.find("3  stopped by Ctrl-C"), std::string::npos);
    expect_error("help paint", 2, "'paint'");
}

TEST_F(CliProgram, BadUsage) {
    expect_error("", 2, "no verb");
    expect_error("paint", 2, "'paint'");
    expect_error("render", 2, "INPUT");
    expect_error("render a.rpb", 2, "-o is missing");
    expect_error("render a.rpb -o a.pfm --nonsense", 2, "--nonsense");
    expect_error("render a.rpb -o a.pfm --size 0x0", 2, "--size");
    expect_error("render a.rpb -o a.pfm --memory-limit -1G", 2, "--memory-limit");
    expect_error("render a.rpb -o a.pfm --geometry-limit -5%", 2, "--geometry-limit");
    expect_error("render a.rpb -o a.pfm --spp -3", 2, "--spp");
    expect_error("render a.rpb -o a.pfm --policy best", 2, "--policy");
    expect_error("render a.rpb b.ply -o a.pfm", 2, "a.rpb");
    expect_error("bake a.ply -o a.exr", 2, "a.exr");
    expect_error("bake a.ply -o a.rpb --block-size 1K", 2, "--block-size");
    for (const char* error : {"0", "-1", "much", "1e-30", "1e20"})
        expect_error(fmt::format("bake a.ply -o a.rpb --position-error {}", error), 2, "--position-error");
    expect_error("bake a.rpb -o b.rpb", 2, "a.rpb");
    expect_error("make-scene castle -o out", 2, "'castle'");
    expect_error("make-scene cornell -o out --triangles 7", 2, "--triangles");
    expect_error("make-scene cornell -o out --heightmap a.tif", 2, "--heightmap");
    expect_error("make-scene cornell -o out --textures 100", 2, "--textures");
    expect_error("make-scene points -o out --texture-bytes 1G", 2, "--texture-bytes");
    expect_error("make-scene museum -o out --textures 3", 2, "--textures");
    expect_error("make-scene museum -o out --points 1000", 2, "--points");
    expect_error("make-scene island -o out --preset frozen", 2, "--preset");
    expect_error("make-scene forest -o out --preset moana", 2, "--preset");
    expect_error("make-scene cornell -o out --preset moana", 2, "--preset");
    expect_error("make-scene forest -o out --copies 2", 2, "--copies");
    expect_error("make-scene island -o out --copies 1001", 2, "--copies");
    expect_error("make-scene museum -o out --textures 100 --texture-bytes 1K", 2, "100 textures");
    expect_error("inspect", 2, "FILE.rpb");
    expect_error("compare one.pfm", 2, "picture");
    expect_error("devices stray", 2, "'stray'");
}

TEST_F(CliProgram, PositionErrorsThatLeaveNothing) {
    write_scene("scene.pbrt", 4);
    expect_error("bake scene.pbrt -o a.rpb --position-error 1000", 1, "--position-error");
    expect_error("bake scene.pbrt -o a.rpb --position-error 1e12", 1, "--position-error");
    EXPECT_FALSE(exists("a.rpb"));
    EXPECT_EQ(run("bake scene.pbrt -o a.rpb --position-error 1e-20").status, 0);
}

TEST_F(CliProgram, MissingInputs) {
    for (const char* name : {"absent.rpb", "absent.pbrt", "absent.ply"}) expect_error(fmt::format("render {} -o a.pfm", name), 1, name);
    expect_error("bake absent.pbrt -o a.rpb", 1, "absent.pbrt");
    expect_error("inspect absent.rpb", 1, "absent.rpb");
    expect_error("compare absent.pfm absent.pfm", 1, "absent.pfm");
    expect_error("make-scene terrain -o out --heightmap absent.tif", 1, "absent.tif");
    expect_error("render absent.rpb -o a.pfm --reference gone.pfm", 1, "gone.pfm");
    EXPECT_FALSE(exists("a.pfm"));
    EXPECT_FALSE(exists("a.rpb"));
}

TEST_F(CliProgram, InputsOfTheWrongKind) {
    write("text.rpb", "this is no block file\n");
    write("empty.rpb", "");
    write("text.ply", "neither is this a mesh\n");
    write("text.pfm", "nor this a picture\n");
    write("notes.docx", "nor this anything\n");
    std::filesystem::create_directory(folder_ / "folder.rpb");
    for (const char* name : {"text.rpb", "empty.rpb", "folder.rpb"}) {
        expect_error(fmt::format("inspect {}", name), 1, name);
        expect_error(fmt::format("render {} -o a.pfm", name), 1, name);
    }
    expect_error("render text.ply -o a.pfm", 1, "text.ply");
    expect_error("compare text.pfm text.pfm", 1, "text.pfm");
    const Outcome unknown = run("render notes.docx -o a.pfm");
    EXPECT_NE(unknown.status, 0);
    EXPECT_NE(unknown.errors.find("notes.docx"), std::string::npos) << unknown.errors;
}

TEST_F(CliProgram, OutputsWithoutAPlace) {
    write_scene("scene.pbrt", 2);
    std::filesystem::create_directory(folder_ / "folder.pfm");
    std::filesystem::create_directory(folder_ / "folder.rpb");
    expect_error("render scene.pbrt -o folder.pfm", 1, "folder.pfm");
    expect_error("render scene.pbrt -o nowhere/a.pfm", 1, "nowhere");
    expect_error("render scene.pbrt -o a.pfm --log nowhere/log.csv", 1, "nowhere");
    expect_error("render scene.pbrt -o a.pfm --report folder.rpb", 1, "folder.rpb");
    expect_error("render scene.pbrt -o a.pfm --cache-dir scene.pbrt/cache", 1, "--cache-dir");
    expect_error("bake scene.pbrt -o folder.rpb", 1, "folder.rpb");
    expect_error("bake scene.pbrt -o nowhere/a.rpb", 1, "nowhere");
    EXPECT_FALSE(exists("a.pfm"));
    const Outcome unknown = run("render scene.pbrt -o picture.txt");
    EXPECT_NE(unknown.status, 0);
    EXPECT_NE(unknown.errors.find("picture.txt"), std::string::npos) << unknown.errors;
    // A standard output that takes nothing is found out too.
    const Outcome full = run("--help >/dev/full");
    EXPECT_EQ(full.status, 1);
}

// The tests below use the default OpenCL device.
using CliProgramOnDevice = CliProgram;

TEST_F(CliProgramOnDevice, DevicesMarksOneDefault) {
    const Outcome outcome = run("devices");
    ASSERT_EQ(outcome.status, 0) << outcome.errors;
    size_t defaults = 0;
    std::istringstream lines(outcome.output);
    for (std::string line; std::getline(lines, line);) defaults += line.starts_with(" * ");
    EXPECT_EQ(defaults, 1u) << outcome.output;
}

TEST_F(CliProgramOnDevice, UnknownDeviceAndTooSmallLimits) {
    write_scene("scene.pbrt", 40);
    ASSERT_EQ(run("bake scene.pbrt -o scene.rpb --block-size 16K").status, 0);
    expect_error("render scene.rpb -o a.pfm --device no-such-device", 2, "no-such-device");
    // The message must say what would do: in bytes, so a number of at least four digits.
    for (const char* limit : {"--memory-limit 900", "--geometry-limit 100B"}) {
        const Outcome outcome = run(fmt::format("render scene.rpb -o a.pfm {}", limit));
        EXPECT_EQ(outcome.status, 1) << limit << ": " << outcome.errors;
        EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1) << outcome.errors;
        EXPECT_GE(longest_number(outcome.errors), 4u) << outcome.errors;
    }
    EXPECT_FALSE(exists("a.pfm"));
}

TEST_F(CliProgramOnDevice, FromSceneToComparedPictures) {
    program_ = RAYPAGER_WHOLE_PROGRAM;
    write_scene("scene.pbrt", 40);
    ASSERT_EQ(run("bake scene.pbrt -o scene.rpb --block-size 16K").status, 0);
    const Outcome inspected = run("inspect scene.rpb --json --verify");
    ASSERT_EQ(inspected.status, 0) << inspected.errors;
    const auto figures = nlohmann::json::parse(inspected.output, nullptr, false);
    ASSERT_TRUE(figures.is_object()) << inspected.output;
    EXPECT_EQ(figures["scene"]["triangles"], 3200);
    EXPECT_GT(figures["scene"]["blocks"], 2);
    double shares = 0;
    for (const auto& part : figures["parts"]) shares += part.get<double>();
    EXPECT_NEAR(shares, 1, 1e-9);

    const Outcome whole = run("render scene.rpb -o whole.pfm --report whole.json --log log.csv");
    ASSERT_EQ(whole.status, 0) << whole.errors;
    const Outcome paged = run("render scene.rpb -o paged.pfm --report paged.json --geometry-limit 1% --reference whole.pfm");
    ASSERT_EQ(paged.status, 0) << paged.errors;
    EXPECT_EQ(read_json("whole.json")["image"]["film_hash"], read_json("paged.json")["image"]["film_hash"]);
    EXPECT_EQ(read_json("whole.json")["image"]["spp"], 2);
    // What lies in memory depends on the device: the report has one form of the blocks, 'inspect' both.
    const auto settings = read_json("whole.json")["settings"];
    EXPECT_EQ(read_json("whole.json")["scene"], figures[settings["traversal"] == "stream" ? "scene_on_cpu" : "scene"]);
    const auto difference = nlohmann::json::parse(run("compare whole.pfm paged.pfm --json").output, nullptr, false);
    ASSERT_TRUE(difference.is_object());
    EXPECT_EQ(difference["max_difference"], 0);
    const std::string log = read_file(folder_ / "log.csv");
    EXPECT_TRUE(log.starts_with("seconds,spp,rmse,loads,bytes_loaded,rays\n")) << log;
    EXPECT_GE(std::count(log.begin(), log.end(), '\n'), 2) << log;
    expect_error("render scene.rpb -o other.pfm --size 8x8 --reference whole.pfm", 2, "--reference");
}

TEST_F(CliProgramOnDevice, UnbakedSceneIsBakedOnceAndAgainWhenItChanges) {
    write_scene("scene.pbrt", 3);
    const auto baked_files = [&] {
        size_t count = 0;
        for (const auto& entry : std::filesystem::directory_iterator(folder_ / "cache")) count += entry.path().extension() == ".rpb";
        return count;
    };
    const Outcome first = run("render scene.pbrt -o first.pfm --cache-dir cache");
    ASSERT_EQ(first.status, 0) << first.errors;
    EXPECT_EQ(baked_files(), 1u);
    const Outcome second = run("render scene.pbrt -o second.pfm --cache-dir cache");
    ASSERT_EQ(second.status, 0) << second.errors;
    EXPECT_EQ(baked_files(), 1u);
    EXPECT_NE(second.errors.find("baked already"), std::string::npos) << second.errors;
    EXPECT_EQ(read_file(folder_ / "first.pfm"), read_file(folder_ / "second.pfm"));
    write_scene("scene.pbrt", 4);
    ASSERT_EQ(run("render scene.pbrt -o third.pfm --cache-dir cache").status, 0);
    EXPECT_EQ(baked_files(), 1u) << "the block file of the old scene is of no use any more";
}

}  // namespace
}  // namespace raypager
