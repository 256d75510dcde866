// glTF files: geometry, nodes, instances, lights, cameras, and files that make no sense.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "raypager/import.hpp"
#include "support/temporary_folder.hpp"
#include "unit/gltf_files.hpp"
#include "unit/import_load.hpp"

namespace raypager {
namespace {

using support::TemporaryFolder;
using test::GltfSquare;
using test::GltfWriter;

const std::string camera_rest =
    ",\"cameras\":[{\"type\":\"perspective\",\"perspective\":{\"yfov\":1.0,\"znear\":0.1,\"aspectRatio\":1.5}}],"
    "\"extensions\":{\"KHR_lights_punctual\":{\"lights\":[{\"type\":\"point\",\"color\":[1,0.5,0.25],\"intensity\":8}]}}";

Result<Scene> import_text(const TemporaryFolder& folder, const std::string& content, const std::string& name = "a.glb") {
    return import_scene({folder.write(name, content)});
}

std::string all_lines(const std::vector<std::string>& lines) {
    std::string text;
    for (const auto& line : lines) text += line + "\n";
    return text;
}

TriangleMesh mesh_of(const Shape& shape) {
    TriangleMesh mesh;
    MeshIssues issues;
    const Status status = shape.mesh->load(mesh, issues);
    EXPECT_TRUE(status.ok()) << status.message();
    return mesh;
}

// The area vector of all triangles in the world, as a scene has them: outside is where they are seen counter-clockwise, unless they are turned round.
std::array<double, 3> area_in_world(const Shape& shape) {
    const TriangleMesh mesh = mesh_of(shape);
    std::array<double, 3> sum = {};
    for (const Triangle& t : mesh.triangles) {
        std::array<double, 3> p[3];
        for (size_t i = 0; i < 3; ++i) p[i] = shape.to_world.point(mesh.positions[t[i]].x, mesh.positions[t[i]].y, mesh.positions[t[i]].z);
        const double sign = shape.reverse_orientation != shape.to_world.swaps_handedness() ? -0.5 : 0.5;
        for (size_t a = 0; a < 3; ++a) {
            const size_t b = (a + 1) % 3, c = (a + 2) % 3;
            sum[a] += sign * ((p[1][b] - p[0][b]) * (p[2][c] - p[0][c]) - (p[1][c] - p[0][c]) * (p[2][b] - p[0][b]));
        }
    }
    return sum;
}

void expect_failure(const Result<Scene>& scene, const std::string& part) {
    ASSERT_FALSE(scene.ok());
    EXPECT_NE(scene.status().message().find(part), std::string::npos) << scene.status().message();
    EXPECT_EQ(scene.status().message().find('\n'), std::string::npos);
}

TEST(ImportGltf, ReadsTextBinaryAndBuffersBesideThem) {
    const TemporaryFolder folder;
    const GltfSquare square;
    folder.write("b c.bin", square.file.bytes());
    for (const auto& [name, content] :
         {std::pair("a.glb", square.file.glb(square.scene())), std::pair("a.gltf", square.file.json(square.scene(), "b%20c.bin"))}) {
        const auto scene = import_text(folder, content, name);
        ASSERT_TRUE(scene.ok()) << scene.status().message();
        ASSERT_EQ(scene->shapes.size(), 2u) << name;  // with the ground
        const TriangleMesh mesh = mesh_of(scene->shapes[0]);
        EXPECT_EQ(mesh.positions.size(), 4u);
        EXPECT_EQ(mesh.normals.size(), 4u);
        EXPECT_EQ(mesh.uvs.size(), 4u);
        EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
        EXPECT_TRUE(scene->shapes[1].backdrop);
        EXPECT_EQ(scene->files.size(), name == std::string("a.glb") ? 1u : 2u);
    }
}

TEST(ImportGltf, StripsAndFansHaveOneSide) {
    const TemporaryFolder folder;
    for (const auto& [mode, positions] : {std::pair(5, std::vector<Float3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 2, 0}}),
                                          std::pair(6, std::vector<Float3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {-1, 1, 0}})}) {
        GltfWriter file;
        const int p = file.vectors(positions);
        const auto scene = import_text(folder, file.glb(test::gltf_scene_of(p, "", ",\"mode\":" + std::to_string(mode))));
        ASSERT_TRUE(scene.ok()) << scene.status().message();
        EXPECT_EQ(mesh_of(scene->shapes[0]).triangles.size(), 3u);
        EXPECT_NEAR(area_in_world(scene->shapes[0])[2], 1.5, 1e-6) << mode;
    }
}

TEST(ImportGltf, SparseAccessorsReplaceElements) {
    const TemporaryFolder folder;
    GltfWriter file;
    const int values = file.view(test::bytes_of(5.0f) + test::bytes_of(0.0f) + test::bytes_of(0.0f)), numbers = file.view(std::string("\1", 1));
    const int base = file.view([] {
        std::string bytes;
        for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) bytes += test::bytes_of(x);
        return bytes;
    }());
    const int p = file.accessor("\"bufferView\":" + std::to_string(base) +
                                ",\"componentType\":5126,\"type\":\"VEC3\",\"count\":3,\"sparse\":{\"count\":1,\"indices\":{\"bufferView\":" +
                                std::to_string(numbers) + ",\"componentType\":5121},\"values\":{\"bufferView\":" + std::to_string(values) + "}}");
    const auto scene = import_text(folder, file.glb(test::gltf_scene_of(p)));
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    EXPECT_EQ(mesh_of(scene->shapes[0]).positions[1], (Float3{5, 0, 0}));
}

TEST(ImportGltf, IntegersAreFractionsWhereTheFileSaysSo) {
    const TemporaryFolder folder;
    GltfWriter file;
    std::string bytes;
    for (const int16_t x : {0, 0, 0, 0, 32767, 0, 0, 0, 0, -32767, 0, 0}) bytes += test::bytes_of(x);  // 8 bytes apart
    const int view = file.view(bytes, ",\"byteStride\":8");
    for (const bool normalized : {true, false}) {
        GltfWriter one = file;
        const int p = one.accessor("\"bufferView\":" + std::to_string(view) + ",\"componentType\":5122,\"type\":\"VEC3\",\"count\":3" +
                                   (normalized ? ",\"normalized\":true" : ""));
        const auto scene = import_text(folder, one.glb(test::gltf_scene_of(p, "", "", "", ",\"extensionsRequired\":[\"KHR_mesh_quantization\"]")));
        ASSERT_TRUE(scene.ok()) << scene.status().message();
        const TriangleMesh mesh = mesh_of(scene->shapes[0]);
        EXPECT_EQ(mesh.positions[1].x, normalized ? 1.0f : 32767.0f);
        EXPECT_EQ(mesh.positions[2].y, normalized ? -1.0f : -32767.0f);
    }
}

TEST(ImportGltf, MirroredNodesKeepTheirOutside) {
    const TemporaryFolder folder;
    const GltfSquare square;
    for (const char* node : {"", ",\"scale\":[-1,1,1]", ",\"scale\":[2,-3,1]", ",\"rotation\":[0,0,0.70710678,0.70710678],\"scale\":[1,-1,1]"}) {
        const auto scene = import_text(folder, square.file.glb(square.scene("", node)));
        ASSERT_TRUE(scene.ok()) << scene.status().message();
        EXPECT_GT(area_in_world(scene->shapes[0])[2], 0.9) << node;
    }
}

TEST(ImportGltf, NodesMultiply) {
    const TemporaryFolder folder;
    const GltfSquare square;
    const std::string rest =
        "\"nodes\":[{\"children\":[1],\"translation\":[10,0,0],\"rotation\":[0,0,0.70710678118,0.70710678118]},"
        "{\"mesh\":0,\"matrix\":[2,0,0,0, 0,2,0,0, 0,0,2,0, 1,0,0,1]}],\"scenes\":[{\"nodes\":[0]}],";
    const std::string scene_text = square.scene();
    const auto scene = import_text(folder, square.file.glb(rest + scene_text.substr(scene_text.find("\"meshes\""))));
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    const auto corner = scene->shapes[0].to_world.point(1, 0, 0);  // 2 + 1 along x, turned to y, moved by 10
    EXPECT_NEAR(corner[0], 10, 1e-6);
    EXPECT_NEAR(corner[1], 3, 1e-6);
}

TEST(ImportGltf, MeshesOfSeveralNodesAreInstances) {
    const TemporaryFolder folder;
    const GltfSquare square;
    const std::string text = square.scene();
    const auto scene =
        import_text(folder, square.file.glb("\"scenes\":[{\"nodes\":[0,1,2]}],\"nodes\":[{\"mesh\":0},{\"mesh\":0,\"translation\":[5,0,0]},"
                                            "{\"mesh\":0,\"scale\":[0,0,0]}]," +
                                            text.substr(text.find("\"meshes\""))));
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    ASSERT_EQ(scene->objects.size(), 1u);
    EXPECT_EQ(scene->objects[0].shapes.size(), 1u);
    ASSERT_EQ(scene->instances.size(), 1u);
    EXPECT_EQ(scene->instances[0]->count(), 2u);
    EXPECT_NE(all_lines(scene->warnings).find("cannot be inverted"), std::string::npos) << all_lines(scene->warnings);
}

TEST(ImportGltf, GpuInstancing) {
    const TemporaryFolder folder;
    GltfSquare square;
    const int translations = square.file.vectors({{0, 0, 0}, {3, 0, 0}, {0, 4, 0}}), scales = square.file.vectors({{1, 1, 1}, {2, 2, 2}, {1, 1, -1}});
    std::string quaternions;
    for (const int16_t x : {0, 0, 0, 32767, 0, 0, 32767, 0, 0, 0, 0, 32767}) quaternions += test::bytes_of(x);
    const int rotations = square.file.accessor(quaternions, 5122, "VEC4", 3, ",\"normalized\":true");
    const auto scene = import_text(
        folder,
        square.file.glb(square.scene("", ",\"translation\":[100,0,0],\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"TRANSLATION\":" +
                                             std::to_string(translations) + ",\"ROTATION\":" + std::to_string(rotations) +
                                             ",\"SCALE\":" + std::to_string(scales) + "}}}")));
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    ASSERT_EQ(scene->instances.size(), 1u);
    std::vector<Placement> placements;
    ASSERT_TRUE(scene->instances[0]
                    ->stream([&](std::span<const Placement> some) {
                        placements.insert(placements.end(), some.begin(), some.end());
                        return Status();
                    })
                    .ok());
    ASSERT_EQ(placements.size(), 3u);
    EXPECT_NEAR(placements[1].to_world[0][0], -2, 1e-6);  // half a turn about z, twice as large
    EXPECT_NEAR(placements[1].to_world[0][3], 103, 1e-6);
    EXPECT_NEAR(placements[2].to_world[1][3], 4, 1e-6);
    EXPECT_NEAR(placements[2].to_world[2][2], -1, 1e-6);
}

TEST(ImportGltf, LightsAndCameras) {
    const TemporaryFolder folder;
    const GltfSquare square;
    const std::string text = square.scene();
    const auto scene = import_text(
        folder,
        square.file.glb("\"scenes\":[{\"nodes\":[0,1,2,3]}],\"nodes\":[{\"mesh\":0},{\"camera\":0,\"translation\":[0,0,5],\"scale\":[-7,7,7]},"
                        "{\"translation\":[1,2,3],\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}},{\"camera\":0}]," +
                        text.substr(text.find("\"meshes\"")) + camera_rest));
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    EXPECT_EQ(scene->width, 1080u);
    EXPECT_EQ(scene->height, 720u);
    EXPECT_EQ(scene->camera.eye, (Float3{0, 0, 5}));
    EXPECT_NEAR(scene->camera.forward.z, -1, 1e-6);
    EXPECT_NEAR(scene->camera.right.x, 1.5 * std::tan(0.5), 1e-6);  // what lies to its right is at the right of the picture
    EXPECT_NEAR(scene->camera.up.y, std::tan(0.5), 1e-6);
    ASSERT_EQ(scene->lights.size(), 1u);
    EXPECT_EQ(scene->lights[0].kind, RP_LIGHT_POINT);
    EXPECT_EQ(scene->lights[0].p[1], 2.0f);
    EXPECT_EQ(scene->lights[0].radiance[1], 4.0f);
    EXPECT_EQ(scene->shapes.size(), 1u);  // no ground
    EXPECT_NE(all_lines(scene->warnings).find("of 2 cameras"), std::string::npos) << all_lines(scene->warnings);
}

TEST(ImportGltf, DirectionsOfLightsAndUnitsOfBlender) {
    const TemporaryFolder folder;
    const GltfSquare square;
    const std::string text = square.scene();
    // Turned by a quarter about x, -z of a node is -y of the world.
    std::string content = square.file.json(
        R"("scenes":[{"nodes":[0,1,2]}],"nodes":[{"mesh":0},{"rotation":[-0.70710678,0,0,0.70710678],"translation":[0,9,0],"scale":[3,3,3],)"
        R"("extensions":{"KHR_lights_punctual":{"light":0}}},)"
        R"({"rotation":[-0.70710678,0,0,0.70710678],"extensions":{"KHR_lights_punctual":{"light":1}}}],)" +
            text.substr(text.find("\"meshes\"")) +
            R"(,"extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","intensity":683,"spot":{"innerConeAngle":0.1,"outerConeAngle":0.3}},)"
            R"({"type":"directional","intensity":1366}]}})",
        test::to_data_uri(square.file.bytes()));
    for (const double unit : {1.0, 683.0}) {
        if (unit > 1) content.replace(content.find("\"2.0\""), 5, R"("2.0","generator":"Khronos glTF Blender I/O v4.0")");
        const auto scene = import_text(folder, content, "a.gltf");
        ASSERT_TRUE(scene.ok()) << scene.status().message();
        ASSERT_EQ(scene->lights.size(), 2u);
        const rp_light &spot = scene->lights[0], &sun = scene->lights[1];
        EXPECT_EQ(spot.kind, RP_LIGHT_SPOT);
        EXPECT_NEAR(spot.e1[1], -1, 1e-6);
        EXPECT_EQ(spot.p[1], 9.0f);
        EXPECT_NEAR(spot.e2[0], std::cos(0.3), 1e-6);
        EXPECT_NEAR(spot.e2[1], std::cos(0.1), 1e-6);
        EXPECT_NEAR(spot.radiance[0], 683 / unit, 1e-3);
        EXPECT_EQ(sun.kind, RP_LIGHT_DISTANT);
        EXPECT_NEAR(sun.p[1], 1, 1e-6);  // towards the light
        EXPECT_NEAR(sun.radiance[2], 1366 / unit, 1e-3);
    }
}

TEST(ImportGltf, VertexColorsAreLinear) {
    const TemporaryFolder folder;
    GltfWriter file;
    const int p = file.vectors({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), c = file.vectors({{1, 0.5f, 0}, {0, 0, 0}, {1, 1, 1}});
    const auto scene = import_text(folder, file.glb(test::gltf_scene_of(p, ",\"COLOR_0\":" + std::to_string(c), ",\"material\":0", "",
                                                                        ",\"materials\":[{\"pbrMetallicRoughness\":{\"metallicFactor\":0,"
                                                                        "\"baseColorFactor\":[1,1,0.25,1]}}]")));
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    EXPECT_TRUE(scene->shapes[0].vertex_colors);
    EXPECT_EQ(scene->materials[scene->shapes[0].material].kind, RP_MATERIAL_DIFFUSE);
    const TriangleMesh mesh = mesh_of(scene->shapes[0]);
    EXPECT_EQ(mesh.colors, (std::vector<uint32_t>{255 | 188 << 8, 0, 255 | 255 << 8 | 137 << 16}));
}

TEST(ImportGltf, MorphTargetsAndSkins) {
    const TemporaryFolder folder;
    GltfWriter file;
    const int p = file.vectors({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), moved = file.vectors({{0, 0, 0}, {2, 0, 0}, {0, 0, 0}});
    const auto morphed = import_text(
        folder, file.glb(test::gltf_scene_of(p, "", ",\"targets\":[{\"POSITION\":" + std::to_string(moved) + "}]", ",\"weights\":[0.5]")));
    ASSERT_TRUE(morphed.ok()) << morphed.status().message();
    EXPECT_EQ(mesh_of(morphed->shapes[0]).positions[1], (Float3{2, 0, 0}));

    std::string joints, weights;
    for (int i = 0; i < 3; ++i) joints += std::string("\0\1\0\0", 4);
    for (int i = 0; i < 3; ++i)
        for (const float w : {0.25f, 0.75f, 0.f, 0.f}) weights += test::bytes_of(w);
    const int j = file.accessor(joints, 5121, "VEC4", 3), w = file.accessor(weights, 5126, "VEC4", 3);
    const auto skinned = import_text(
        folder, file.glb("\"scenes\":[{\"nodes\":[0,1,2]}],\"nodes\":[{\"mesh\":0,\"skin\":0,\"translation\":[9,9,9]},"
                         "{\"translation\":[4,0,0]},{\"translation\":[0,0,8]}],\"skins\":[{\"joints\":[1,2]}],\"meshes\":[{\"primitives\":"
                         "[{\"attributes\":{\"POSITION\":" +
                         std::to_string(p) + ",\"JOINTS_0\":" + std::to_string(j) + ",\"WEIGHTS_0\":" + std::to_string(w) + "}}]}]"));
    ASSERT_TRUE(skinned.ok()) << skinned.status().message();
    EXPECT_EQ(mesh_of(skinned->shapes[0]).positions[0], (Float3{1, 0, 6}));
}

TEST(ImportGltf, WhatMakesNoSenseIsOneLine) {
    const TemporaryFolder folder;
    const GltfSquare square;
    const std::string good = square.scene();
    const auto glb = [&](const std::string& rest) { return import_text(folder, square.file.glb(rest)); };
    const std::string meshes = good.substr(good.find("\"meshes\""));
    expect_failure(glb(good + ",\"extensionsRequired\":[\"EXT_of_somebody\"]"), "EXT_of_somebody");
    expect_failure(glb("\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"children\":[1]},{\"children\":[0]}]," + meshes), "met twice");
    expect_failure(glb("\"scenes\":[{\"nodes\":[7]}],\"nodes\":[{\"mesh\":0}]," + meshes), "no node 7");
    expect_failure(glb("\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":3}]," + meshes), "no mesh 3");
    expect_failure(glb("\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"name\":\"empty\"}]," + meshes), "no surface");
    expect_failure(glb(good + ",\"materials\":[{\"extras\":" + std::string(3000, '[') + std::string(3000, ']') + "}]"), "nested");
    expect_failure(import_text(folder, square.file.json(good, "../secret.bin"), "a.gltf"), "secret.bin");
    expect_failure(import_text(folder, square.file.json(good, "/etc/passwd"), "a.gltf"), "/etc/passwd");
    expect_failure(import_text(folder, square.file.json(good, "https://example.org/a.bin"), "a.gltf"), "example.org");
    expect_failure(import_text(folder, square.file.json(good, "absent.bin"), "a.gltf"), "absent.bin");
    expect_failure(import_text(folder, square.file.json(good, "data:application/octet-stream;base64,AAAA"), "a.gltf"), "a.gltf");
    expect_failure(import_text(folder, "{\"asset\":{\"version\":\"1.0\"}}", "a.gltf"), "version \"1.0\"");
    expect_failure(import_text(folder, "{\"asset\":{\"version\":\"2.0\"}", "a.gltf"), "byte");
    expect_failure(import_text(folder, "", "a.gltf"), "is empty");
}

TEST(ImportGltf, AccessorsAreInsideOfTheirBytes) {
    const TemporaryFolder folder;
    for (const char* members :
         {",\"componentType\":5126,\"type\":\"VEC3\",\"count\":4", ",\"componentType\":5126,\"type\":\"VEC3\",\"count\":4294967297",
          ",\"componentType\":5126,\"type\":\"VEC3\",\"count\":3,\"byteOffset\":4",
          ",\"componentType\":5126,\"type\":\"VEC3\",\"count\":3,\"byteOffset\":18446744073709551600",
          ",\"componentType\":5126,\"type\":\"VEC2\",\"count\":3", ",\"componentType\":5124,\"type\":\"VEC3\",\"count\":3"}) {
        GltfWriter file;
        const int view = file.view(std::string(36, '\0'));
        const int p = file.accessor("\"bufferView\":" + std::to_string(view) + members);
        const auto scene = import_text(folder, file.glb(test::gltf_scene_of(p)));
        if (scene.ok()) {  // found when it is read
            TriangleMesh mesh;
            MeshIssues issues;
            EXPECT_FALSE(scene->shapes[0].mesh->load(mesh, issues).ok()) << members;
        } else {
            EXPECT_NE(scene.status().message().find("accessor 0"), std::string::npos) << scene.status().message();
        }
    }
    GltfWriter file;
    const int p = file.accessor("\"componentType\":5126,\"type\":\"VEC3\",\"count\":4000000000");
    expect_failure(import_text(folder, file.glb(test::gltf_scene_of(p))), "no bytes");
}

}  // namespace
}  // namespace raypager
