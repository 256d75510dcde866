// Scenes that others read: by their ending they go to a reader that was named, and they can be given what they lack.
#include <gtest/gtest.h>

#include <vector>

#include "raypager/import.hpp"
#include "raypager/materials.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

std::vector<std::array<double, 3>> corners_of_a_box(double x, double y, double z) {
    std::vector<std::array<double, 3>> corners;
    for (int i = 0; i < 8; ++i) corners.push_back({i & 1 ? x : -x, i & 2 ? y : -y, i & 4 ? z : -z});
    return corners;
}

// A ball of radius 1.
Scene small_scene() {
    Scene scene;
    scene.materials.push_back(clay_material());
    scene.shapes.emplace_back();
    return scene;
}

TEST(ImportReaders, AreAskedForTheirEndingAlone) {
    const support::TemporaryFolder folder;
    const auto path = folder.write("a.USDA", "");
    const auto before = import_scene({path});
    ASSERT_FALSE(before);
    EXPECT_NE(before.status().message().find("a.USDA: USD cannot be read here; Python reads it: python -m raypager"), std::string::npos);
    int asked = 0;
    BareLook look;
    look.width = 123;
    use_scene_reader(".usda", [&](const std::filesystem::path& name, const ImportOptions& options) -> Result<Scene> {
        ++asked;
        EXPECT_EQ(name, path);
        EXPECT_EQ(options.look.width, 123u);
        return small_scene();
    });
    ImportOptions options;
    options.look = look;
    const auto scene = import_scene({path}, options);
    ASSERT_TRUE(scene) << scene.status().message();
    EXPECT_EQ(scene->shapes.size(), 1u);
    const auto two = import_scene({path, path}, options);
    ASSERT_FALSE(two);
    EXPECT_EQ(two.status().kind(), ErrorKind::usage);
    EXPECT_FALSE(import_scene({folder.write("a.usdz", "")}, options));
    use_scene_reader(".usda", nullptr);
    EXPECT_FALSE(import_scene({path}, options));
    EXPECT_EQ(asked, 1);
}

TEST(ImportReaders, CompletedScenesHaveWhatTheyLacked) {
    const auto points = corners_of_a_box(1, 1, 1);
    for (const bool z_up : {false, true}) {
        Scene scene = small_scene();
        BareLook look;
        look.width = 400;
        look.height = 300;
        ASSERT_TRUE(complete_scene(look, {false, false, z_up}, points, scene));
        EXPECT_EQ(scene.width, 400u);
        EXPECT_FALSE(scene.lights.empty());
        ASSERT_EQ(scene.shapes.size(), 2u);
        EXPECT_TRUE(scene.shapes.back().backdrop);
        EXPECT_EQ(scene.shapes.back().material, 1u);
        // It looks down from above, whichever way that is.
        EXPECT_GT(z_up ? scene.camera.eye.z : scene.camera.eye.y, 1);
        EXPECT_TRUE(validate(scene));
    }
}

TEST(ImportReaders, CompletedScenesKeepWhatTheyHave) {
    const auto points = corners_of_a_box(1, 2, 3);
    Scene scene = small_scene();
    scene.camera = *make_camera({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, 45, scene.width, scene.height);
    const Camera camera = scene.camera;
    BareLook look;
    look.width = 400;
    look.height = 300;
    ASSERT_TRUE(complete_scene(look, {true, false, false}, points, scene));
    EXPECT_EQ(scene.camera, camera);
    EXPECT_EQ(scene.width, 1280u);
    EXPECT_FALSE(scene.lights.empty());
    EXPECT_EQ(scene.shapes.size(), 1u);  // no ground under what was framed by somebody
    const size_t lights = scene.lights.size();
    ASSERT_TRUE(complete_scene(look, {false, true, false}, points, scene));
    EXPECT_EQ(scene.lights.size(), lights);
    EXPECT_FALSE(scene.camera == camera);
}

TEST(ImportReaders, NothingCannotBeFramed) {
    Scene scene = small_scene();
    EXPECT_FALSE(complete_scene({}, {}, {}, scene));
    const std::vector<std::array<double, 3>> far_away = {{1e300, 0, 0}, {-1e300, 1e300, 0}};
    EXPECT_FALSE(complete_scene({}, {}, far_away, scene));
}

}  // namespace
}  // namespace raypager
