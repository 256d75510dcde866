// Shapes of pbrt scenes with an alpha of 0: rays pass them, and those that shine still do.
#include <gtest/gtest.h>

#include "raypager/import.hpp"
#include "support/temporary_folder.hpp"

namespace raypager {
namespace {

class ImportUnseen : public testing::Test {
protected:
    Scene scene(const std::string& text) {
        auto result = import_scene({folder.write("scene.pbrt", text)});
        EXPECT_TRUE(result.ok()) << result.status().message();
        return result.ok() ? std::move(*result) : Scene();
    }
    support::TemporaryFolder folder;
};

const std::string lit_world = "WorldBegin\nAreaLightSource \"diffuse\" \"rgb L\" [5 5 5]\n";
const std::string one_face = "\"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]\n";

TEST_F(ImportUnseen, AlphaZeroShinesUnseen) {
    const Scene s =
        scene(lit_world + "Translate 0 0 2\nShape \"sphere\" \"float radius\" .5 \"float alpha\" 0\nShape \"trianglemesh\" \"float alpha\" [0] " +
              one_face + "Shape \"sphere\" \"float alpha\" 1\n");
    ASSERT_EQ(s.shapes.size(), 3u);
    EXPECT_TRUE(s.shapes[0].unseen);
    EXPECT_TRUE(s.shapes[0].area_light);
    EXPECT_EQ(s.shapes[0].to_world.point(0, 0, 0)[2], 2);
    EXPECT_TRUE(s.shapes[1].unseen);
    EXPECT_FALSE(s.shapes[2].unseen);
    EXPECT_TRUE(s.warnings.empty()) << s.warnings[0];
}

TEST_F(ImportUnseen, InstancesAreLightsToo) {
    const Scene s = scene(
        "WorldBegin\nObjectBegin \"lamp\"\nAreaLightSource \"diffuse\"\nShape \"sphere\" \"float alpha\" 0\nObjectEnd\n"
        "ObjectInstance \"lamp\"\nTranslate 3 0 0\nObjectInstance \"lamp\"\n");
    ASSERT_EQ(s.shapes.size(), 2u);
    for (const Shape& shape : s.shapes) EXPECT_TRUE(shape.unseen);
    EXPECT_EQ(s.shapes[1].to_world.point(0, 0, 0)[0], 3);
}

TEST_F(ImportUnseen, WithoutLightThereIsNothing) {
    const Scene s = scene("WorldBegin\nShape \"sphere\" \"float alpha\" 0\nShape \"sphere\"\n");
    ASSERT_EQ(s.shapes.size(), 1u);
    EXPECT_FALSE(s.shapes[0].unseen);
}

TEST_F(ImportUnseen, HalfOfItIsSaidToBeOpaque) {
    const Scene s = scene(lit_world + "Shape \"sphere\" \"float alpha\" 0.5\n");
    ASSERT_EQ(s.shapes.size(), 1u);
    EXPECT_FALSE(s.shapes[0].unseen);
    ASSERT_FALSE(s.warnings.empty());
    EXPECT_NE(s.warnings[0].find("alpha"), std::string::npos) << s.warnings[0];
}

TEST_F(ImportUnseen, AlphaOfAConstantTextureIsANumber) {
    const std::string textures =
        "Texture \"none\" \"float\" \"constant\" \"float value\" 0\nTexture \"all\" \"float\" \"scale\" \"float tex\" 2 \"float scale\" .5\n";
    const Scene s = scene(lit_world + textures + "Shape \"sphere\" \"texture alpha\" \"none\"\nShape \"sphere\" \"texture alpha\" \"all\"\n");
    ASSERT_EQ(s.shapes.size(), 2u);
    EXPECT_TRUE(s.shapes[0].unseen);
    EXPECT_FALSE(s.shapes[1].unseen);
    EXPECT_TRUE(s.warnings.empty()) << s.warnings[0];
}

TEST_F(ImportUnseen, AlphaBeyondItsRangeIsThatOfTheNearerEnd) {
    const Scene s = scene("WorldBegin\nShape \"sphere\" \"float alpha\" -1\nShape \"sphere\" \"float alpha\" 2\n");
    EXPECT_EQ(s.shapes.size(), 1u);
}

}  // namespace
}  // namespace raypager
