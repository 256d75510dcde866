// Materials of glTF files, and what becomes of them in a scene.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "raypager/import.hpp"
#include "support/temporary_folder.hpp"
#include "unit/gltf_files.hpp"

namespace raypager {
namespace {

using support::TemporaryFolder;
using test::GltfSquare;

// Two by one texels, red and half green, of 8 bits.
const std::string picture = std::string("P6 2 1 255\n") + std::string("\xff\0\0\0\x80\0", 6);

struct Imported {
    TemporaryFolder folder;
    Result<Scene> scene = Status::failed("");
    // material: its JSON; rest: more members of the file.
    Imported(const std::string& material, const std::string& rest = "") {
        folder.write("a.ppm", picture);
        const GltfSquare square;
        scene = import_scene({folder.write(
            "a.glb", square.file.glb(square.scene(",\"material\":0", "",
                                                  ",\"materials\":[" + material +
                                                      "],\"textures\":[{\"source\":0},{\"source\":0,\"sampler\":0}],\"images\":[{\"uri\":\"a.ppm\"}],"
                                                      "\"samplers\":[{\"wrapS\":33071,\"wrapT\":33648}]" +
                                                      rest)))});
        EXPECT_TRUE(scene.ok()) << scene.status().message();
    }
    const rp_material& material() const { return scene->materials[scene->shapes[0].material]; }
    std::string warnings() const {
        std::string text;
        for (const auto& line : scene->warnings) text += line + "\n";
        return text;
    }
    // Operations of the program of a material.
    std::vector<rp_texture_op> program(const rp_material& m) const {
        std::vector<rp_texture_op> ops;
        for (size_t i = (m.flags >> RP_MATERIAL_PROGRAM_SHIFT); i > 0 && i <= scene->texture_ops.size(); ++i) {
            ops.push_back(scene->texture_ops[i - 1]);
            if (ops.back().op & RP_TEXTURE_LAST) break;
        }
        return ops;
    }
    const rp_texture_op* find(const rp_material& m, uint32_t kind) const {
        for (size_t i = (m.flags >> RP_MATERIAL_PROGRAM_SHIFT); i > 0 && i <= scene->texture_ops.size(); ++i) {
            if ((scene->texture_ops[i - 1].op & RP_TEXTURE_OPERATION_MASK) == kind) return &scene->texture_ops[i - 1];
            if (scene->texture_ops[i - 1].op & RP_TEXTURE_LAST) break;
        }
        return nullptr;
    }
};

TEST(ImportGltfMaterials, MetalAndMattAreOneGlossySurface) {
    const Imported matt(R"({"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.125,1],"metallicFactor":0,"roughnessFactor":0.5}})");
    EXPECT_EQ(matt.material().kind, RP_MATERIAL_LAYERED);
    EXPECT_TRUE(matt.material().flags & RP_MATERIAL_SCHLICK);
    EXPECT_EQ(matt.material().color[1], 0.25f);
    EXPECT_NEAR(matt.material().specular[0], 0.04, 1e-6);
    EXPECT_NEAR(matt.material().alpha, 0.25, 1e-6);
    const Imported metal(R"({"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.125,1],"metallicFactor":1,"roughnessFactor":0.5}})");
    EXPECT_EQ(metal.material().color[0], 0.0f);
    EXPECT_EQ(metal.material().specular[1], 0.25f);
    const Imported mirror(R"({"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.5,0.5,1],"roughnessFactor":0}})");
    EXPECT_EQ(mirror.material().kind, RP_MATERIAL_CONDUCTOR);
    EXPECT_EQ(mirror.material().alpha, 0.0f);
    EXPECT_EQ(matt.warnings() + metal.warnings() + mirror.warnings(), "");
}

TEST(ImportGltfMaterials, IorAndSpecularSayWhatIsReflectedStraight) {
    const Imported diamond(R"({"pbrMetallicRoughness":{"metallicFactor":0},"extensions":{"KHR_materials_ior":{"ior":2.42}}})");
    EXPECT_NEAR(diamond.material().specular[0], std::pow(1.42 / 3.42, 2), 1e-5);
    const Imported dull(R"({"pbrMetallicRoughness":{"metallicFactor":0},"extensions":{"KHR_materials_specular":{"specularFactor":0}}})");
    EXPECT_EQ(dull.material().kind, RP_MATERIAL_DIFFUSE);
}

TEST(ImportGltfMaterials, TexturesRepeatAndAreTransformed) {
    const Imported plain(R"({"pbrMetallicRoughness":{"metallicFactor":0,"baseColorFactor":[1,0.5,1,1],"baseColorTexture":{"index":1}}})");
    const rp_texture_op* image = plain.find(plain.material(), RP_TEXTURE_IMAGE);
    ASSERT_NE(image, nullptr);
    EXPECT_EQ(image->a[1], 0.5f);
    EXPECT_EQ(image->op >> RP_TEXTURE_WRAP_SHIFT & 15u, RP_WRAP_CLAMP | RP_WRAP_MIRROR << 2);
    EXPECT_EQ(image->map, RP_NONE);  // rows of images begin at the top, and v does, too
    const auto shape = plain.scene->images[image->image]->shape();
    ASSERT_TRUE(shape.ok()) << shape.status().message();
    EXPECT_TRUE(shape->srgb);

    const Imported moved(R"({"pbrMetallicRoughness":{"metallicFactor":0,"baseColorTexture":{"index":0,"extensions":{"KHR_texture_transform":)"
                         R"({"offset":[0.25,0.5],"rotation":1.5707963267948966,"scale":[2,3]}}}}})");
    image = moved.find(moved.material(), RP_TEXTURE_IMAGE);
    ASSERT_NE(image, nullptr);
    ASSERT_NE(image->map, RP_NONE);
    const rp_texture_map& map = moved.scene->texture_maps[image->map];
    const float expected[8] = {0, 3, 0.25f, 0, -2, 0, 0.5f, 0};  // a quarter turn against the clock as it is seen: u goes upwards
    for (size_t i = 0; i < 8; ++i) EXPECT_NEAR(map.m[i], expected[i], 1e-6) << i;
}

TEST(ImportGltfMaterials, RoughnessIsGreenAndMetalBlueOfOneTexel) {
    const Imported scene(R"({"pbrMetallicRoughness":{"metallicRoughnessTexture":{"index":0}}})");
    std::vector<uint32_t> channels;
    for (const rp_texture_op& op : scene.program(scene.material()))
        if ((op.op & RP_TEXTURE_OPERATION_MASK) == RP_TEXTURE_IMAGE) {
            channels.push_back(op.op >> RP_TEXTURE_CHANNEL_SHIFT & RP_TEXTURE_CHANNEL_MASK);
            EXPECT_EQ(op.lookup, 0u);  // all of the same
            EXPECT_FALSE(scene.scene->images[op.image]->shape()->srgb);
        }
    EXPECT_EQ(std::set<uint32_t>(channels.begin(), channels.end()), (std::set<uint32_t>{4, 5}));
}

TEST(ImportGltfMaterials, MasksAndBlendsAreMixesWithNothing) {
    const Imported blend(R"({"alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.25]}})");
    EXPECT_EQ(blend.material().kind, RP_MATERIAL_MIX);
    EXPECT_EQ(blend.material().first, RP_NONE);
    EXPECT_EQ(blend.material().amount, 0.25f);
    const Imported opaque(R"({"pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.25]}})");
    EXPECT_NE(opaque.material().kind, RP_MATERIAL_MIX);
    const Imported kept(R"({"alphaMode":"MASK","alphaCutoff":0.2,"pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.25]}})");
    EXPECT_NE(kept.material().kind, RP_MATERIAL_MIX);
}

TEST(ImportGltfMaterials, WhatAMaskTakesAwayAsAWholeIsNotThere) {
    const TemporaryFolder folder;
    const GltfSquare square;
    const auto scene = import_scene({folder.write(
        "a.glb",
        square.file.glb(square.scene(",\"material\":0", "",
                                     ",\"materials\":[{\"alphaMode\":\"MASK\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[1,1,1,0.25]}}]")))});
    ASSERT_FALSE(scene.ok());
    EXPECT_NE(scene.status().message().find("no surface"), std::string::npos) << scene.status().message();
}

TEST(ImportGltfMaterials, TransmissionIsASheetOrASolid) {
    const Imported sheet(R"({"pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0,"baseColorFactor":[1,0.5,1,1]},)"
                         R"("extensions":{"KHR_materials_transmission":{"transmissionFactor":0.75}}})");
    EXPECT_TRUE(sheet.material().flags & RP_MATERIAL_THIN);
    EXPECT_NEAR(sheet.material().refracted[1], 0.375, 1e-6);
    EXPECT_NEAR(sheet.material().color[0], 0.25, 1e-6);
    const Imported solid(
        R"({"pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0},"extensions":{"KHR_materials_transmission":{"transmissionFactor":1},)"
        R"("KHR_materials_volume":{"thicknessFactor":2},"KHR_materials_ior":{"ior":1.3}}})");
    EXPECT_EQ(solid.material().kind, RP_MATERIAL_DIELECTRIC);
    EXPECT_NEAR(solid.material().ior, 1.3, 1e-6);
}

TEST(ImportGltfMaterials, ClearCoats) {
    const Imported coated(R"({"pbrMetallicRoughness":{"metallicFactor":0},"extensions":{"KHR_materials_clearcoat":{"clearcoatFactor":1}}})");
    EXPECT_TRUE(coated.material().flags & RP_MATERIAL_COAT);
    EXPECT_FALSE(coated.material().flags & RP_MATERIAL_METAL_BASE);
    const Imported half(R"({"extensions":{"KHR_materials_clearcoat":{"clearcoatFactor":0.5,"clearcoatRoughnessFactor":0.5}}})");
    ASSERT_EQ(half.material().kind, RP_MATERIAL_MIX);
    const rp_material& coat = half.scene->materials[half.material().second];
    EXPECT_TRUE(coat.flags & RP_MATERIAL_METAL_BASE);
    EXPECT_NEAR(coat.alpha, 0.25, 1e-6);
}

TEST(ImportGltfMaterials, WhatShinesIsAnAreaLight) {
    const Imported lamp(R"({"emissiveFactor":[1,0.5,0],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":6}}})");
    ASSERT_TRUE(lamp.scene->shapes[0].area_light);
    EXPECT_EQ(lamp.scene->area_lights[*lamp.scene->shapes[0].area_light].radiance, (Float3{6, 3, 0}));
    EXPECT_EQ(lamp.scene->lights.size(), 0u);  // it is light enough
    const Imported dull(R"({"emissiveFactor":[1,1,1],"doubleSided":true})");
    EXPECT_TRUE(dull.scene->area_lights[*dull.scene->shapes[0].area_light].two_sided);
    EXPECT_FALSE(dull.scene->lights.empty());  // lit as bare meshes are
}

// The left half of the picture is red, the right one green.
TEST(ImportGltfMaterials, WhatShinesByAnImageIsALightForEachColor) {
    const TemporaryFolder folder;
    folder.write("a.ppm", picture);
    test::GltfWriter file;
    const int p = file.vectors({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}, {3, 0, 0}, {2, 1, 0}, {4, 0, 0}, {5, 0, 0}, {4, 1, 0}});
    const int uvs =
        file.pairs({{0.1f, 0.9f}, {0.4f, 0.9f}, {0.1f, 0.1f}, {0.6f, 0.9f}, {0.9f, 0.9f}, {0.6f, 0.1f}, {0.1f, 0.9f}, {0.4f, 0.9f}, {0.1f, 0.1f}});
    const auto import = [&](const char* factor) {
        return import_scene(
            {folder.write("a.glb", file.glb(test::gltf_scene_of(
                                       p, ",\"TEXCOORD_0\":" + std::to_string(uvs), ",\"material\":0", "",
                                       std::string(",\"materials\":[{\"emissiveFactor\":") + factor +
                                           ",\"emissiveTexture\":{\"index\":0}}],\"textures\":[{\"source\":0}],\"images\":[{\"uri\":\"a.ppm\"}]")))});
    };
    const auto scene = import("[1,1,1]");
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    ASSERT_EQ(scene->shapes.size(), 3u);  // with the ground
    for (size_t i = 0; i < 2; ++i) {
        ASSERT_TRUE(scene->shapes[i].area_light);
        TriangleMesh mesh;
        MeshIssues issues;
        ASSERT_TRUE(scene->shapes[i].mesh->load(mesh, issues).ok());
        const Float3& radiance = scene->area_lights[*scene->shapes[i].area_light].radiance;
        EXPECT_EQ(mesh.triangles.size(), radiance.x > 0 ? 2u : 1u);
        EXPECT_NEAR(radiance.x > 0 ? radiance.x : radiance.y, radiance.x > 0 ? 1 : 0.2158605, 1e-4);
    }
    EXPECT_NE(scene->shapes[0].mesh->name(), scene->shapes[1].mesh->name());
    EXPECT_EQ(scene->warnings.size(), 1u);
}

TEST(ImportGltfMaterials, NormalMapsFollowTheirCoordinates) {
    const Imported scene(R"({"normalTexture":{"index":0,"scale":0.5}})");
    const auto ops = scene.program(scene.material());
    ASSERT_FALSE(ops.empty());
    bool sets = false;
    for (const rp_texture_op& op : ops) sets = sets || ((op.op & RP_TEXTURE_OPERATION_MASK) == RP_TEXTURE_SET && op.image == RP_PARAMETER_NORMAL);
    EXPECT_TRUE(sets);
    // One of two triangles has its coordinates mirrored: green is turned there.
    const TemporaryFolder folder;
    folder.write("a.ppm", picture);
    GltfSquare square;
    const int uvs = square.file.pairs({{0, 1}, {1, 1}, {1, 0}, {1, 1}});
    const auto split = import_scene(
        {folder.write("a.glb", square.file.glb(test::gltf_scene_of(square.positions, ",\"TEXCOORD_0\":" + std::to_string(uvs),
                                                                   ",\"material\":0,\"indices\":" + std::to_string(square.corners), "",
                                                                   ",\"materials\":[{\"normalTexture\":{\"index\":0}}],\"textures\":[{\"source\":0}],"
                                                                   "\"images\":[{\"uri\":\"a.ppm\"}]")))});
    ASSERT_TRUE(split.ok()) << split.status().message();
    ASSERT_EQ(split->shapes.size(), 3u);  // with the ground
    EXPECT_NE(split->shapes[0].material, split->shapes[1].material);
}

TEST(ImportGltfMaterials, WhatCannotBeHadIsSaid) {
    const Imported unlit(R"({"extensions":{"KHR_materials_unlit":{}}})", R"(,"extensionsUsed":["KHR_materials_sheen","KHR_materials_unlit"])");
    EXPECT_NE(unlit.warnings().find("KHR_materials_sheen"), std::string::npos) << unlit.warnings();
    EXPECT_NE(unlit.warnings().find("KHR_materials_unlit"), std::string::npos) << unlit.warnings();
    EXPECT_EQ(unlit.material().kind, RP_MATERIAL_DIFFUSE);
    const Imported absent(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":9}}})");
    EXPECT_NE(absent.warnings().find("texture 9"), std::string::npos) << absent.warnings();
}

}  // namespace
}  // namespace raypager
