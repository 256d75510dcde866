// Loading mesh files in tests.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "import/mesh_file.hpp"
#include "support/temporary_folder.hpp"

namespace raypager::test {

struct Loaded {
    Status status;
    TriangleMesh mesh;
    MeshIssues issues;
};

inline Loaded load(const std::filesystem::path& path) {
    Loaded result;
    const auto file = MeshFile::open(path);
    result.status = file ? (*file)->load(result.mesh, result.issues) : file.status();
    return result;
}

inline Loaded load_text(const std::string& name, const std::string& content) {
    const support::TemporaryFolder folder;
    return load(folder.write(name, content));
}

// The corners of all triangles, whatever the vertex numbers.
inline std::vector<std::array<Float3, 3>> corners(const TriangleMesh& mesh) {
    std::vector<std::array<Float3, 3>> result;
    for (const Triangle& t : mesh.triangles) result.push_back({mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]});
    return result;
}

inline void expect_error(const Loaded& loaded, const std::string& part) {
    ASSERT_FALSE(loaded.status.ok());
    EXPECT_NE(loaded.status.message().find(part), std::string::npos) << loaded.status.message();
}

// One warning, and that has this in it.
inline void expect_warning(const Loaded& loaded, const std::string& part) {
    ASSERT_TRUE(loaded.status.ok()) << loaded.status.message();
    ASSERT_EQ(loaded.issues.warnings.size(), 1u);
    EXPECT_NE(loaded.issues.warnings[0].text.find(part), std::string::npos) << loaded.issues.warnings[0].text;
}

}  // namespace raypager::test
