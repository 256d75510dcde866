// Meshes of glTF files that Draco or meshoptimizer has packed, by the libraries themselves; and such data damaged.
#include <gtest/gtest.h>

#include <random>

#include "raypager/import.hpp"
#include "support/temporary_folder.hpp"
#include "unit/gltf_files.hpp"

#ifdef RAYPAGER_DRACO
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#endif
#ifdef RAYPAGER_MESHOPT
#include <meshoptimizer.h>
#endif

namespace raypager {
namespace {

using support::TemporaryFolder;
using test::GltfWriter;

[[maybe_unused]] Status load_all(const std::string& content, std::vector<TriangleMesh>& meshes) {
    const TemporaryFolder folder;
    const auto scene = import_scene({folder.write("a.glb", content)});
    if (!scene) return scene.status();
    for (const Shape& shape : scene->shapes) {
        MeshIssues issues;
        RAYPAGER_TRY(shape.mesh->load(meshes.emplace_back(), issues));
    }
    return {};
}

// Any few bytes changed in what is packed: an error of one line, or some mesh.
[[maybe_unused]] void damage(const std::string& good, size_t begin, size_t bytes) {
    const uint32_t seed = std::random_device()();
    std::mt19937 random(seed);
    for (int i = 0; i < 200; ++i) {
        std::string bad = good;
        for (uint32_t n = 1 + random() % 4; n > 0; --n) bad[begin + random() % bytes] = static_cast<char>(random());
        std::vector<TriangleMesh> meshes;
        const Status status = load_all(bad, meshes);
        EXPECT_EQ(status.message().find('\n'), std::string::npos) << "seed " << seed << ": " << status.message();
    }
}

#ifdef RAYPAGER_DRACO
std::string packed_by_draco(const TriangleMesh& mesh, int method) {
    draco::TriangleSoupMeshBuilder builder;
    builder.Start(static_cast<int>(mesh.triangles.size()));
    const int positions = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
    const int uvs = builder.AddAttribute(draco::GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32);
    for (uint32_t f = 0; f < mesh.triangles.size(); ++f) {
        const auto& [a, b, c] = mesh.triangles[f];
        const draco::FaceIndex face(f);
        builder.SetAttributeValuesForFace(positions, face, &mesh.positions[a], &mesh.positions[b], &mesh.positions[c]);
        builder.SetAttributeValuesForFace(uvs, face, &mesh.uvs[a], &mesh.uvs[b], &mesh.uvs[c]);
    }
    const auto built = builder.Finalize();
    draco::Encoder encoder;
    encoder.SetEncodingMethod(method);
    draco::EncoderBuffer buffer;
    if (!encoder.EncodeMeshToBuffer(*built, &buffer).ok()) return {};
    return {buffer.data(), buffer.size()};
}

TEST(ImportGltfPacked, Draco) {
    TriangleMesh box = test::make_box();
    for (const Float3& p : box.positions) box.uvs.push_back({p.x, p.y});
    for (const int method : {draco::MESH_EDGEBREAKER_ENCODING, draco::MESH_SEQUENTIAL_ENCODING}) {
        const std::string packed = packed_by_draco(box, method);
        ASSERT_FALSE(packed.empty());
        GltfWriter file;
        const int view = file.view(packed);
        // As the extension has it: accessors say of what type things are, and have no bytes.
        const int p = file.accessor("\"componentType\":5126,\"type\":\"VEC3\",\"count\":8"),
                  t = file.accessor("\"componentType\":5126,\"type\":\"VEC2\",\"count\":8"),
                  i = file.accessor("\"componentType\":5123,\"type\":\"SCALAR\",\"count\":36");
        const std::string content =
            file.glb(test::gltf_scene_of(p, ",\"TEXCOORD_0\":" + std::to_string(t),
                                         ",\"indices\":" + std::to_string(i) + ",\"extensions\":{\"KHR_draco_mesh_compression\":{\"bufferView\":" +
                                             std::to_string(view) + ",\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1}}}",
                                         "", ",\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]"));
        std::vector<TriangleMesh> meshes;
        const Status status = load_all(content, meshes);
        ASSERT_TRUE(status.ok()) << status.message();
        EXPECT_EQ(meshes[0].triangles.size(), 12u);
        Float3 upper{0, 0, 0};
        for (size_t v = 0; v < meshes[0].positions.size(); ++v) {
            const Float3& at = meshes[0].positions[v];
            upper = {std::max(upper.x, at.x), std::max(upper.y, at.y), std::max(upper.z, at.z)};
            EXPECT_NEAR(meshes[0].uvs[v].x, at.x, 1e-5);
            EXPECT_NEAR(meshes[0].uvs[v].y, at.y, 1e-5);
        }
        EXPECT_EQ(upper, (Float3{1, 2, 3}));
        damage(content, content.find("DRACO"), packed.size());
    }
}
#endif

#ifdef RAYPAGER_MESHOPT
std::string packed_vertices(const std::vector<float>& values, size_t bytes_each) {
    const size_t count = values.size() * 4 / bytes_each;
    std::string out(meshopt_encodeVertexBufferBound(count, bytes_each), '\0');
    out.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(out.data()), out.size(), values.data(), count, bytes_each));
    return out;
}

TEST(ImportGltfPacked, Meshopt) {
    const TriangleMesh box = test::make_box();
    std::vector<float> values;
    for (const Float3& p : box.positions) values.insert(values.end(), {p.x, p.y, p.z});
    std::vector<unsigned> corners;
    for (const Triangle& t : box.triangles) corners.insert(corners.end(), t.begin(), t.end());
    const std::string vertices = packed_vertices(values, 12);
    std::string indices(meshopt_encodeIndexBufferBound(corners.size(), box.positions.size()), '\0');
    indices.resize(meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(indices.data()), indices.size(), corners.data(), corners.size()));
    GltfWriter file;
    const auto packed_view = [&](const std::string& bytes, size_t count, size_t stride, const char* mode) {
        return file.view(
            bytes, ",\"extensions\":{\"EXT_meshopt_compression\":{\"buffer\":0,\"byteOffset\":" + std::to_string((file.bytes().size() + 3) / 4 * 4) +
                       ",\"byteLength\":" + std::to_string(bytes.size()) + ",\"count\":" + std::to_string(count) +
                       ",\"byteStride\":" + std::to_string(stride) + ",\"mode\":\"" + mode + "\"}}");
    };
    const int v = packed_view(vertices, 8, 12, "ATTRIBUTES"), n = packed_view(indices, 36, 2, "TRIANGLES");
    const int p = file.accessor("\"bufferView\":" + std::to_string(v) + ",\"componentType\":5126,\"type\":\"VEC3\",\"count\":8"),
              i = file.accessor("\"bufferView\":" + std::to_string(n) + ",\"componentType\":5123,\"type\":\"SCALAR\",\"count\":36");
    // A second buffer as such files have it, which is there for those who cannot unpack.
    file.add_buffer(R"({"byteLength":1000000,"extensions":{"EXT_meshopt_compression":{"fallback":true}}})");
    const std::string content =
        file.glb(test::gltf_scene_of(p, "", ",\"indices\":" + std::to_string(i), "", ",\"extensionsRequired\":[\"EXT_meshopt_compression\"]"));
    std::vector<TriangleMesh> meshes;
    const Status status = load_all(content, meshes);
    ASSERT_TRUE(status.ok()) << status.message();
    EXPECT_EQ(meshes[0].positions, box.positions);
    EXPECT_EQ(meshes[0].triangles.size(), 12u);
    damage(content, content.size() - file.bytes().size(), file.bytes().size());
    // More than there can be.
    std::string huge = content;
    huge.replace(huge.find("\"count\":8,\"byteStride\":12"), 10, "\"count\":80000000");
    meshes.clear();
    EXPECT_FALSE(load_all(huge, meshes).ok());
}
#endif

}  // namespace
}  // namespace raypager
