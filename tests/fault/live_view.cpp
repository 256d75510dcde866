// The live view as a process: its address, its end, and what it cannot do, without a browser.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <sstream>
#include <thread>

#include "support/child_process.hpp"
#include "support/small_scene_file.hpp"

namespace raypager {
namespace {

using support::ChildProcess;
using support::ChildResult;
using support::patience;

class LiveViews : public support::SmallSceneFile {
protected:
    std::string text(const char* name) const {
        std::ifstream file(folder_.path() / name);
        std::ostringstream all;
        all << file.rdbuf();
        return all.str();
    }
    // Of the program. Drivers speak there, too, when a signal comes while they compile.
    static std::string own_lines(const std::string& said) {
        std::istringstream lines(said);
        std::string own;
        for (std::string line; std::getline(lines, line);)
            if (line.starts_with("raypager: ")) own += line + "\n";
        return own;
    }
    // Of a view that has been started; empty if it says none in time.
    std::string address() const {
        const auto begin = std::chrono::steady_clock::now();
        std::string line;
        while (!line.ends_with("/\n") && std::chrono::steady_clock::now() - begin < std::chrono::duration<double>(patience)) {
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
            line = text("stdout");
        }
        return line;
    }
    ChildResult result(const std::vector<std::string>& arguments) {
        ChildProcess child(RAYPAGER_PROGRAM, arguments, folder_.path());
        ChildResult result;
        EXPECT_TRUE(child.wait(patience, result)) << "does not end";
        return result;
    }
};

TEST_F(LiveViews, end_with_a_signal_at_any_time) {
    for (const double seconds : {0.0, 0.1, 1.0}) {
        ChildProcess view(RAYPAGER_PROGRAM, {"view", "scene.rpb", "--size", "64x48"}, folder_.path());
        const std::string line = address();
        ASSERT_TRUE(line.starts_with("http://127.0.0.1:")) << line << text("stderr");
        std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
        view.signal(SIGINT);
        ChildResult ended;
        ASSERT_TRUE(view.wait(patience, ended)) << seconds;
        EXPECT_EQ(ended.exit_code, 0) << seconds << " " << text("stderr");
        EXPECT_EQ(own_lines(text("stderr")), "raypager: stopping; Ctrl-C again kills the program\n");
        EXPECT_EQ(text("stdout"), line);
    }
}

TEST_F(LiveViews, of_a_port_that_is_taken_say_so) {
    ChildProcess first(RAYPAGER_PROGRAM, {"view", "scene.rpb", "--size", "64x48"}, folder_.path());
    const std::string line = address();
    const std::string port = line.substr(17, line.find('/', 17) - 17);
    const ChildResult second = result({"view", "scene.rpb", "--port", port});
    EXPECT_EQ(second.exit_code, 1);
    EXPECT_TRUE(text("stderr").starts_with(fmt::format("raypager: view: port {} of 127.0.0.1: ", port))) << text("stderr");
}

TEST_F(LiveViews, refuse_what_cannot_be) {
    const std::vector<std::string> wrong[] = {{"view"},
                                              {"view", "scene.rpb", "--port", "0"},
                                              {"view", "scene.rpb", "--port", "65536"},
                                              {"view", "scene.rpb", "-o", "a.png"},
                                              {"view", "scene.rpb", "other.ply"},
                                              {"view", "scene.rpb", "--camera", "1,2,3"},
                                              {"view", "scene.rpb", "--material", "gold"},
                                              {"render", "scene.rpb", "-o", "a.pfm", "--view", "--turntable", "4"}};
    for (const auto& arguments : wrong) {
        EXPECT_EQ(result(arguments).exit_code, 2) << arguments.back();
        const std::string said = text("stderr");
        EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
    }
    EXPECT_EQ(result({"view", "no.rpb"}).exit_code, 1);
    EXPECT_EQ(result({"view", "scene.rpb", "--memory-limit", "1"}).exit_code, 1);
}

}  // namespace
}  // namespace raypager
