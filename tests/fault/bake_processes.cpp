// Bakes as processes: how much memory they take, and what is left when they are stopped or killed.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <sstream>
#include <thread>

#include "raypager/bake.hpp"
#include "store/block_file.hpp"
#include "support/child_process.hpp"
#include "support/device_scene.hpp"
#include "support/sanitizers.hpp"

namespace raypager {
namespace {

using support::ChildProcess;
using support::ChildResult;
using support::MiB;
using support::patience;

class BakeProcesses : public testing::Test {
protected:
    // With sanitizers, just enough for the smallest limit to send them over the disk.
    static constexpr uint32_t n = RAYPAGER_ADDRESS_SANITIZER || RAYPAGER_THREAD_SANITIZER ? 500 : 1000;

    // 2 n^2 triangles, one mesh in one file: so many that a bake in memory takes more than the limits that are tried.
    void SetUp() override {
        std::ostringstream text;
        text << "ply\nformat binary_little_endian 1.0\nelement vertex " << (n + 1) * (n + 1)
             << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << 2 * n * n
             << "\nproperty list uchar int vertex_indices\nend_header\n";
        const auto put = [&text](const auto& value) { text.write(reinterpret_cast<const char*>(&value), sizeof value); };
        for (uint32_t j = 0; j <= n; j++)
            for (uint32_t i = 0; i <= n; i++)
                for (const float x : {float(i), float((i * 7 + j * 13) % 5), float(j)}) put(x);
        first_face_ = static_cast<size_t>(text.tellp());
        for (uint32_t j = 0; j < n; j++)
            for (uint32_t i = 0; i < n; i++) {
                const uint32_t a = j * (n + 1) + i, c = a + n + 1;
                for (const Triangle& t : {Triangle{a, c, a + 1}, Triangle{a + 1, c, c + 1}}) {
                    put(uint8_t{3});
                    for (const uint32_t corner : t) put(corner);
                }
            }
        mesh_ = text.str();
        write("mesh.ply", mesh_);
        write("scene.pbrt",
              "LookAt 350 600 -500  350 0 350  0 1 0\nCamera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\n"
              "Shape \"plymesh\" \"string filename\" \"mesh.ply\"\n");
    }

    void write(const char* name, const std::string& text) const { std::ofstream(folder_.path() / name, std::ios::binary) << text; }
    std::string read(const char* name) const {
        std::ifstream file(folder_.path() / name);
        std::ostringstream text;
        text << file.rdbuf();
        return text.str();
    }

    static std::vector<std::string> command(uint64_t limit, const char* input = "scene.pbrt") {
        return {"bake", input, "-o", "a.rpb", "--block-size", "128K", "--host-limit", std::to_string(limit)};
    }

    uint64_t bake(const char* input, uint64_t limit, uint64_t primitives) const;
    void expect_within(const char* input, uint64_t primitives, uint64_t allowance) const;

    // Files in the folder besides the inputs and the child's output.
    std::vector<std::string> left() const {
        std::vector<std::string> names;
        for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
            const std::string name = entry.path().filename().string();
            if (name != "mesh.ply" && name != "scene.pbrt" && name != "tiny.pbrt" && name != "stdout" && name != "stderr") names.push_back(name);
        }
        return names;
    }

    // Starts a bake and signals it once it is at work; returns false if it was faster. One that was nearly done may get through: then two more are
    // tried.
    bool interrupt(int number, ChildResult& result) const {
        for (int i = 0; i < 2; i++) {
            if (!interrupt_once(number, result)) return false;
            const std::filesystem::path file = folder_.path() / "a.rpb";
            const bool through = result.exit_code == 0 || (result.signal == SIGKILL && BlockFile::open(file).ok());
            if (!through) return true;
            std::filesystem::remove(file);
        }
        return interrupt_once(number, result);
    }
    bool interrupt_once(int number, ChildResult& result) const {
        ChildProcess child(RAYPAGER_PROGRAM, command(smallest_bake_limit()), folder_.path());
        const auto begin = std::chrono::steady_clock::now();
        while (left().empty() && std::chrono::steady_clock::now() - begin < std::chrono::seconds(60))
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
        if (child.wait(0.2, result)) return false;
        child.signal(number);
        EXPECT_TRUE(child.wait(patience, result)) << "does not end";
        return true;
    }

    support::TemporaryFolder folder_;
    std::string mesh_;
    size_t first_face_ = 0;
};

// Bakes the input within the smallest limit, and within one that holds it all, and looks at what the process took.
void BakeProcesses::expect_within(const char* input, uint64_t primitives, uint64_t allowance) const {
    if (RAYPAGER_ADDRESS_SANITIZER || RAYPAGER_THREAD_SANITIZER) GTEST_SKIP() << "sanitizers need memory of their own";
    // What the program takes before it begins: libraries, more than anything else.
    write("tiny.pbrt", "LookAt 0 0 -4  0 0 0  0 1 0\nCamera \"perspective\"\nWorldBegin\nShape \"sphere\"\n");
    // So short a process may be over before it is looked at: then what was seen of it is less.
    uint64_t own = 0;
    for (int i = 0; i < 4; i++) own = std::max(own, bake("tiny.pbrt", smallest_bake_limit(), 1));
    const uint64_t peak = bake(input, smallest_bake_limit(), primitives);
    EXPECT_NE(read("stderr").find("over the disk"), std::string::npos) << read("stderr");
    EXPECT_LE(peak, own + smallest_bake_limit() + allowance);
    const uint64_t in_memory = bake(input, 1024 * MiB, primitives);
    EXPECT_EQ(read("stderr").find("over the disk"), std::string::npos) << read("stderr");
    EXPECT_GT(in_memory, own + smallest_bake_limit() + allowance) << "a scene so small that this test sees nothing";
}

// The bytes that the process had in memory at most.
uint64_t BakeProcesses::bake(const char* input, uint64_t limit, uint64_t primitives) const {
    ChildProcess child(RAYPAGER_PROGRAM, command(limit, input), folder_.path());
    ChildResult result;
    EXPECT_TRUE(child.wait(patience, result));
    EXPECT_EQ(result.exit_code, 0) << read("stderr");
    const auto file = BlockFile::open(folder_.path() / "a.rpb");
    EXPECT_TRUE(file.ok()) << file.status().message();
    if (!file) return 0;
    EXPECT_EQ((*file)->scene().triangles + (*file)->scene().spheres, primitives);
    return result.peak_bytes;
}

// Threads, buffers of libraries, what the allocator keeps.
constexpr uint64_t slack = 16 * MiB;

TEST_F(BakeProcesses, stay_within_the_limit) { expect_within("scene.pbrt", 2 * n * n, slack); }

// Its radii follow from the spacing, so it is sorted on disk. Two thirds lie on hills, the others in the air.
TEST_F(BakeProcesses, of_clouds_stay_within_the_limit) {
    constexpr uint32_t count = 700000;
    std::ostringstream text;
    text << "ply\nformat binary_little_endian 1.0\nelement vertex " << count
         << "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
    const auto put = [&text](const auto& value) { text.write(reinterpret_cast<const char*>(&value), sizeof value); };
    uint32_t seed = 1;
    const auto random = [&seed] { return static_cast<float>((seed = seed * 1664525u + 1013904223u) >> 8) * (100.0f / (1 << 24)); };
    for (uint32_t i = 0; i < count; i++) {
        const float x = random(), y = random(), z = random();
        for (const float c : {x, y, i % 3 ? 5 * std::sin(0.2f * x) * std::sin(0.3f * y) : z}) put(c);
        for (const int shift : {0, 8, 16}) put(static_cast<uint8_t>(i >> shift));
    }
    write("mesh.ply", text.str());
    write("scene.pbrt",
          "LookAt 50 -80 60  50 50 0  0 0 1\nCamera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\n"
          "Shape \"points\" \"string filename\" \"mesh.ply\"\n");
    expect_within("scene.pbrt", count, slack);
}

// Their text comes in several files, since each is read as a whole. What is read of them goes over the disk as well.
TEST_F(BakeProcesses, of_instances_stay_within_the_limit) {
    constexpr uint32_t files = 40, lines = 20000;
    std::ostringstream scene;
    scene << "LookAt 50 60 -50  50 0 50  0 1 0\nCamera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\nObjectBegin \"o\"\n"
             "Shape \"trianglemesh\" \"point3 P\" [";
    for (int i = 0; i < 16; i++) scene << i % 4 * 0.1 << ' ' << i * i % 7 * 0.1 << ' ' << i / 4 * 0.1 << ' ';
    scene << "] \"integer indices\" [";
    for (int i = 0; i + 2 < 16; i++) scene << i << ' ' << i + 1 << ' ' << i + 2 << ' ';
    scene << "]\nObjectEnd\n";
    for (uint32_t f = 0; f < files; f++) {
        const std::string name = "places" + std::to_string(f) + ".pbrt";
        std::ostringstream text;
        for (uint32_t i = 0; i < lines; i++) {
            const uint32_t n = f * lines + i;
            text << "Transform [ 1 0 0 0  0 " << 1 + n % 3 << " 0 0  0 0 1 0  " << n % 997 * 0.1 << ' ' << n % 5 << ' ' << n / 997 * 0.1
                 << " 1 ]\nObjectInstance \"o\"\n";
        }
        write(name.c_str(), text.str());
        scene << "Include \"" << name << "\"\n";
    }
    write("scene.pbrt", scene.str());
    expect_within("scene.pbrt", 14, slack);
    if (IsSkipped()) return;
    const auto file = BlockFile::open(folder_.path() / "a.rpb");
    ASSERT_TRUE(file.ok());
    EXPECT_EQ((*file)->scene().instances, files * lines);
}

// Framed by a sample of its triangles (64 MiB at most), and read in pieces.
TEST_F(BakeProcesses, of_bare_meshes_stay_within_the_limit) { expect_within("mesh.ply", 2 * n * n + 96, 64 * MiB); }  // with the ground

TEST_F(BakeProcesses, leave_nothing_when_stopped) {
    for (const int number : {SIGINT, SIGTERM}) {
        ChildResult result;
        if (!interrupt(number, result)) continue;  // a fast machine
        EXPECT_EQ(result.signal, 0) << "ended by the signal itself";
        EXPECT_EQ(result.exit_code, 3);
        EXPECT_NE(read("stderr").find("stopped by a signal"), std::string::npos) << read("stderr");
        EXPECT_EQ(left(), std::vector<std::string>());
    }
}

// Nobody can clean up then; but what is left must not pass for a block file, and the next bake must not mind it.
TEST_F(BakeProcesses, killed_leave_nothing_that_looks_whole) {
    ChildResult result;
    if (!interrupt(SIGKILL, result)) GTEST_SKIP() << "too fast to be killed";
    EXPECT_EQ(result.signal, SIGKILL);
    for (const std::string& name : left()) {
        EXPECT_NE(name, "a.rpb");
        EXPECT_FALSE(BlockFile::open(folder_.path() / name).ok()) << name;
    }
    ChildProcess again(RAYPAGER_PROGRAM, command(1024 * MiB), folder_.path());
    ASSERT_TRUE(again.wait(patience, result));
    EXPECT_EQ(result.exit_code, 0) << read("stderr");
    EXPECT_TRUE(BlockFile::open(folder_.path() / "a.rpb").ok());
}

// Found long after the first triangles went to disk.
TEST_F(BakeProcesses, damage_in_mid_stream_is_one_clear_error) {
    std::string damaged = mesh_;
    damaged[first_face_ + 13 * (2 * n * n - 1000)] = static_cast<char>(0xc8);  // a face of 200 corners, and after it nothing makes sense
    write("mesh.ply", damaged);
    std::string cut = mesh_;
    cut.resize(cut.size() - 5);
    for (const std::string& text : {damaged, cut}) {
        write("mesh.ply", text);
        ChildProcess child(RAYPAGER_PROGRAM, command(smallest_bake_limit()), folder_.path());
        ChildResult result;
        ASSERT_TRUE(child.wait(patience, result));
        EXPECT_EQ(result.exit_code, 1);
        const std::string errors = read("stderr");
        EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 1) << errors;
        EXPECT_NE(errors.find("mesh.ply"), std::string::npos) << errors;
        EXPECT_EQ(left(), std::vector<std::string>());
    }
}

}  // namespace
}  // namespace raypager
