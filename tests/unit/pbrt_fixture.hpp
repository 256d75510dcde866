// Imports text as pbrt scene files.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "raypager/import.hpp"
#include "support/temporary_folder.hpp"

namespace raypager::test {

class PbrtTest : public testing::Test {
protected:
    // Imports text as a scene file; it must be sound.
    Scene scene(const std::string& text) {
        auto result = import_scene({folder.write("scene.pbrt", text)});
        EXPECT_TRUE(result.ok()) << result.status().message();
        return result.ok() ? std::move(*result) : Scene();
    }
    void expect_error(const std::string& text, const std::string& part) {
        const auto result = import_scene({folder.write("scene.pbrt", text)});
        ASSERT_FALSE(result.ok()) << "accepted: " << text.substr(0, 200);
        EXPECT_NE(result.status().message().find(part), std::string::npos) << result.status().message();
        EXPECT_EQ(result.status().message().find('\n'), std::string::npos);
        EXPECT_LT(result.status().message().size(), 500u);
    }
    Scene expect_warning(const std::string& text, const std::string& part) {
        Scene s = scene(text);
        for (const std::string& warning : s.warnings)
            if (warning.find(part) != std::string::npos) return s;
        ADD_FAILURE() << "no warning with \"" << part << "\" among " << s.warnings.size() << (s.warnings.empty() ? "" : ": " + s.warnings[0]);
        return s;
    }
    // No warning but that there is no light.
    Scene expect_silence(const std::string& text) {
        Scene s = scene(text);
        for (const std::string& warning : s.warnings) EXPECT_NE(warning.find("there is no light"), std::string::npos) << warning;
        return s;
    }
    support::TemporaryFolder folder;
};

inline const std::string one_triangle = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]\n";

}  // namespace raypager::test
