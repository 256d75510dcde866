// Pictures inside of glTF files, in buffers and in the text.
#include <gtest/gtest.h>

#include "raypager/import.hpp"
#include "raypager/picture.hpp"
#include "support/temporary_folder.hpp"
#include "unit/gltf_files.hpp"

namespace raypager {
namespace {

using support::TemporaryFolder;

class GltfImages : public testing::Test {
protected:
    GltfImages() {
        use_openimageio();
        // Four texels: black, white, red, and grey of half the light.
        const Image image{2, 2, 3, {0, 0, 0, 1, 1, 1, 1, 0, 0, 0.5f, 0.5f, 0.5f}};
        EXPECT_TRUE(write_image(folder_ / "a.png", image).ok());
        png_ = support::read_file(folder_ / "a.png");
    }
    // The image of the base colour, and its bytes.
    Result<std::vector<std::byte>> texels(const std::string& image, test::GltfSquare square) {
        const auto scene = import_scene({folder_.write(
            "a.glb", square.file.glb(square.scene(
                         ",\"material\":0", "",
                         ",\"materials\":[{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}}],\"textures\":[{\"source\":0}],"
                         "\"images\":[" +
                             image + "]")))});
        if (!scene) return scene.status();
        if (scene->images.size() != 1) return Status::failed(scene->warnings.empty() ? "no image, and no warning" : scene->warnings[0]);
        const auto shape = scene->images[0]->shape();
        if (!shape) return shape.status();
        EXPECT_EQ(shape->width, 2u);
        EXPECT_TRUE(shape->srgb);
        std::vector<std::byte> bytes;
        const Status status = scene->images[0]->read([&](std::span<const std::byte> rows) {
            bytes.insert(bytes.end(), rows.begin(), rows.end());
            return Status();
        });
        const auto fingerprint = scene->images[0]->fingerprint();
        EXPECT_TRUE(fingerprint.ok());
        fingerprint_ = fingerprint ? *fingerprint : 0;
        return status.ok() ? Result<std::vector<std::byte>>(bytes) : status;
    }
    static std::vector<int> reds_of(const std::vector<std::byte>& bytes) {
        std::vector<int> reds;
        for (size_t i = 0; i < bytes.size(); i += 4) reds.push_back(std::to_integer<int>(bytes[i]));
        return reds;
    }
    TemporaryFolder folder_;
    std::string png_;
    uint64_t fingerprint_ = 0;
};

TEST_F(GltfImages, AreReadFromBuffersTextAndFiles) {
    test::GltfSquare square;
    const int view = square.file.view(png_);
    const std::vector<int> expected = {0, 255, 255, 188};
    std::vector<uint64_t> fingerprints;
    for (const std::string& image : {"{\"bufferView\":" + std::to_string(view) + ",\"mimeType\":\"image/jpeg\"}",  // what it is not
                                     "{\"uri\":\"" + test::to_data_uri(png_) + "\"}", std::string("{\"uri\":\"a.png\"}")}) {
        const auto bytes = texels(image, square);
        ASSERT_TRUE(bytes.ok()) << bytes.status().message();
        EXPECT_EQ(reds_of(*bytes), expected) << image.substr(0, 40);
        fingerprints.push_back(fingerprint_);
    }
    EXPECT_EQ(fingerprints[0], fingerprints[1]);
}

TEST_F(GltfImages, ThatAreDamagedAreLeftOutWithAWarning) {
    test::GltfSquare square;
    const int view = square.file.view(png_.substr(0, 20)), noise = square.file.view("no picture at all");
    for (const int bad : {view, noise}) {
        const auto bytes = texels("{\"bufferView\":" + std::to_string(bad) + "}", square);
        ASSERT_FALSE(bytes.ok());
        EXPECT_NE(bytes.status().message().find("the image is left out"), std::string::npos) << bytes.status().message();
    }
}

}  // namespace
}  // namespace raypager
