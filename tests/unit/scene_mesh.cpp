#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "scene/clean_mesh.hpp"
#include "unit/import_files.hpp"

namespace raypager {
namespace {

TEST(SceneCleanMesh, LeavesASoundMeshAlone) {
    TriangleMesh mesh = test::make_box();
    const auto before = mesh.triangles;
    MeshIssues issues;
    clean_mesh(mesh, issues);
    EXPECT_FALSE(issues.any()) << issues.describe();
    EXPECT_EQ(mesh.triangles, before);
    EXPECT_EQ(issues.describe(), "");
}

TEST(SceneCleanMesh, DropsWhatNoRayCanHit) {
    TriangleMesh mesh = test::make_box();
    mesh.positions.push_back({NAN, 0, 0});       // 8
    mesh.positions.push_back({0, INFINITY, 0});  // 9
    mesh.positions.push_back({2, 0, 0});         // 10: in line with 0 and 1
    const auto sound = mesh.triangles;
    mesh.triangles.insert(mesh.triangles.begin(), {{0, 1, 8}, {9, 1, 2}, {0, 1, 11}, {RP_NONE, 1, 2}, {4, 4, 5}, {0, 1, 10}});
    MeshIssues issues;
    clean_mesh(mesh, issues);
    EXPECT_EQ(issues.not_finite, 2u);
    EXPECT_EQ(issues.bad_index, 2u);
    EXPECT_EQ(issues.degenerate, 2u);
    EXPECT_EQ(issues.duplicate, 0u);
    EXPECT_EQ(mesh.triangles, sound);
    EXPECT_NE(issues.describe().find("2 degenerate triangles dropped"), std::string::npos) << issues.describe();
}

TEST(SceneCleanMesh, KeepsSlivers) {
    TriangleMesh mesh;
    const float e = std::nextafter(1.0f, 2.0f);
    mesh.positions = {{0, 0, 0}, {1, 1, 0}, {2, 2 * e, 0}};  // one unit in the last place off a line
    mesh.triangles = {{0, 1, 2}};
    MeshIssues issues;
    clean_mesh(mesh, issues);
    EXPECT_EQ(issues.degenerate, 0u);
    EXPECT_EQ(mesh.triangles.size(), 1u);
}

TEST(SceneCleanMesh, MendsNormals) {
    TriangleMesh mesh = test::make_box();
    mesh.normals.assign(8, {0, NAN, 1});
    MeshIssues issues;
    clean_mesh(mesh, issues);
    EXPECT_EQ(mesh.normals, std::vector<Float3>(8));
    mesh.normals.resize(5);
    clean_mesh(mesh, issues);
    EXPECT_TRUE(mesh.normals.empty());
}

// Against sets and maps.
void expect_as_by_a_plain_model(TriangleMesh mesh) {
    std::set<Triangle> seen;
    std::map<std::pair<uint32_t, uint32_t>, int> edges;
    uint64_t degenerate = 0, duplicate = 0, non_manifold = 0;
    std::vector<Triangle> kept;
    for (Triangle t : mesh.triangles) {
        const Triangle as_it_was = t;
        std::sort(t.begin(), t.end());
        if (t[0] == t[1] || t[1] == t[2]) {
            ++degenerate;
            continue;
        }
        kept.push_back(as_it_was);
        if (!seen.insert(t).second) ++duplicate;
        ++edges[{t[0], t[1]}], ++edges[{t[1], t[2]}], ++edges[{t[0], t[2]}];
    }
    for (const auto& [edge, count] : edges) non_manifold += count > 2;

    MeshIssues issues;
    clean_mesh(mesh, issues);
    EXPECT_EQ(issues.degenerate, degenerate);
    EXPECT_EQ(issues.duplicate, duplicate);
    EXPECT_EQ(issues.non_manifold_edges, non_manifold);
    EXPECT_TRUE(mesh.triangles == kept);
}

TriangleMesh random_soup(std::mt19937& random, uint32_t vertices) {
    TriangleMesh mesh;
    std::uniform_real_distribution<float> coordinate(-1, 1);
    for (uint32_t i = 0; i < vertices; ++i) mesh.positions.push_back({coordinate(random), coordinate(random), coordinate(random)});
    return mesh;
}

TEST(SceneCleanMesh, CountsLikeAPlainModel) {
    for (unsigned seed = 1; seed <= 40; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        const auto vertices = static_cast<uint32_t>(3 + random() % 12);  // few, so that repeats are common
        TriangleMesh mesh = random_soup(random, vertices);
        const auto any_vertex = [&] { return static_cast<uint32_t>(random() % vertices); };
        for (int i = 0; i < 60; ++i) mesh.triangles.push_back({any_vertex(), any_vertex(), any_vertex()});
        expect_as_by_a_plain_model(std::move(mesh));
    }
}

// So many triangles and vertices that they are looked at in several pieces and shares.
TEST(SceneCleanMesh, CountsLikeAPlainModelByAllCores) {
    for (const bool ordered : {true, false}) {
        const unsigned seed = std::random_device{}();
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        constexpr uint32_t vertices = 300000, triangles = 250000;
        TriangleMesh mesh = random_soup(random, vertices);
        for (uint32_t i = 0; i < triangles; ++i) {
            const auto first = static_cast<uint32_t>(ordered ? uint64_t{i} * (vertices - 8) / triangles : random() % (vertices - 8));
            const auto near = [&] { return first + static_cast<uint32_t>(random() % 4); };
            mesh.triangles.push_back({near(), near(), random() % 50 ? near() : static_cast<uint32_t>(random() % vertices)});
        }
        expect_as_by_a_plain_model(std::move(mesh));
    }
}

TEST(SceneMesh, InMemoryLoadsACleanCopy) {
    TriangleMesh box = test::make_box();
    box.triangles.push_back({0, 0, 1});
    const MeshInMemory source("here:1", box);
    TriangleMesh mesh;
    MeshIssues issues;
    for (int i = 1; i <= 2; ++i) {
        ASSERT_TRUE(source.load(mesh, issues).ok());
        EXPECT_EQ(mesh.triangles.size(), 12u);
        EXPECT_EQ(issues.degenerate, static_cast<uint64_t>(i));
    }
    EXPECT_EQ(source.mesh().triangles.size(), 13u);
}

class SceneValidate : public testing::Test {
protected:
    SceneValidate() {
        scene.materials.resize(1);  // diffuse black
        Shape shape;
        shape.name = "ball";
        scene.shapes.push_back(shape);
    }
    void expect_error(const std::string& part) {
        const Status status = validate(scene);
        ASSERT_FALSE(status.ok());
        EXPECT_NE(status.message().find(part), std::string::npos) << status.message();
        EXPECT_EQ(status.message().find('\n'), std::string::npos);
    }
    Scene scene;
};

TEST_F(SceneValidate, AcceptsASoundScene) {
    const Status status = validate(scene);
    EXPECT_TRUE(status.ok()) << status.message();
}

TEST_F(SceneValidate, FindsBadShapes) {
    scene.shapes[0].material = 1;
    expect_error("ball: material 1 does not exist");
    scene.shapes[0].material = 0;
    scene.shapes[0].area_light = 0;
    expect_error("ball: area light 0 does not exist");
    scene.shapes[0].area_light.reset();
    scene.shapes[0].sphere.radius = -1;
    expect_error("radius");
    scene.shapes[0].sphere.radius = 1;
    scene.shapes[0].to_world.m[1][2] = NAN;
    expect_error("not finite");
    scene.shapes[0].to_world = Transform();
    scene.shapes[0].to_world.m[3][0] = 1;
    expect_error("projective");
}

TEST_F(SceneValidate, FindsBadCamerasLightsAndMaterials) {
    scene.camera.up = scene.camera.right;
    expect_error("camera");
    scene.camera = Camera();
    scene.width = 0;
    expect_error("picture");
    scene.width = 10;
    scene.materials[0].color[1] = 1.5f;
    expect_error("reflectance");
    scene.materials[0].color[1] = 0;
    rp_light light{};
    light.kind = RP_LIGHT_INFINITE;
    scene.lights = {light, light};
    expect_error("more than one infinite light");
    scene.lights.pop_back();
    scene.lights[0].radiance[2] = -1;
    expect_error("light 0");
    scene.lights[0] = rp_light{};
    scene.lights[0].kind = RP_LIGHT_DISTANT;
    expect_error("unit vector");
    scene.lights.clear();
    scene.area_lights = {AreaLight{{1, INFINITY, 1}, false}};
    expect_error("area light 0");
}

}  // namespace
}  // namespace raypager
