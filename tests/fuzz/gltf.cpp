// glTF files, text and binary, with a buffer and a picture beside them.
#include "base/check.hpp"
#include "fuzz/fuzz.hpp"
#include "raypager/import.hpp"
#include "unit/gltf_files.hpp"

namespace raypager::fuzz {
namespace {

// Nodes, cameras, lights, instances, and materials of all extensions.
std::string everything(const test::GltfSquare& square, int instances) {
    return R"("scene":0,"scenes":[{"nodes":[0,3]}],"nodes":[{"children":[1,2],"rotation":[0,0.6,0,0.8]},{"mesh":0,"weights":[0.5]},)"
           R"({"mesh":0,"scale":[1,-1,1],"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":)" +
           std::to_string(instances) +
           R"(}}}},{"camera":0,"skin":0,"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,5,1],"extensions":{"KHR_lights_punctual":{"light":0}}}],)"
           R"("cameras":[{"type":"perspective","perspective":{"yfov":0.7,"znear":0.1,"aspectRatio":1.5}}],"skins":[{"joints":[1]}],)"
           R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"spot","spot":{"outerConeAngle":0.5},"intensity":3,"color":[1,1,0]}]}},)"
           R"("extensionsUsed":["KHR_materials_sheen"],"images":[{"uri":"a.ppm"},{"uri":"data:image/png;base64,iVBORw0KGgo="}],)"
           R"("samplers":[{"wrapS":33071}],"textures":[{"source":0,"sampler":0},{"source":1}],"materials":[)"
           R"({"alphaMode":"MASK","normalTexture":{"index":0},)"
           R"("pbrMetallicRoughness":{"baseColorTexture":{"index":0,"extensions":{"KHR_texture_transform":{"rotation":1,"scale":[2,2]}}},)"
           R"("metallicRoughnessTexture":{"index":0}},"emissiveFactor":[1,0,0],"emissiveTexture":{"index":1},)"
           R"("extensions":{"KHR_materials_ior":{"ior":1.3},)"
           R"("KHR_materials_transmission":{"transmissionFactor":0.5},"KHR_materials_volume":{"thicknessFactor":1,"attenuationDistance":2},)"
           R"("KHR_materials_clearcoat":{"clearcoatFactor":1,"clearcoatRoughnessTexture":{"index":0}},)"
           R"("KHR_materials_specular":{"specularFactor":0.5}}}],)"
           R"("animations":[{}],"meshes":[{"primitives":[{"mode":5,"material":0,"attributes":{"POSITION":)" +
           std::to_string(square.positions) + ",\"TEXCOORD_0\":" + std::to_string(square.uvs) + ",\"COLOR_0\":" + std::to_string(square.normals) +
           R"(},"targets":[{"POSITION":)" + std::to_string(square.normals) + R"(}]},{"mode":0,"attributes":{"POSITION":)" +
           std::to_string(square.positions) + "}}]}]";
}

std::string from_hex(std::string_view digits) {
    std::string bytes;
    for (size_t i = 0; i + 1 < digits.size(); i += 2) bytes += static_cast<char>(std::stoi(std::string(digits.substr(i, 2)), nullptr, 16));
    return bytes;
}

// A box, as Draco and meshoptimizer pack it.
const char* const draco_boxes[] = {
    "445241434f0202010000000c080100010200020304050604060700030500050401070601060200040700070103020603060501010009030000020001010102ad01"
    "ad2aad02ffff9b550555055505ad020796c7c056a4c54100000000ff0000000000000000000000000000000000404008",
    "445241434f02020101000000080c000b0000035f4b1501011001ff0000010009030000020101010009030118010813012004008a5382545d05480500484d15402a"
    "ab004000000000ff0000000000000000000000000000000000404008"};
const char* const meshopt_vertices =
    "a00000013fff0000ffffffffffffff013fff00007e7d7e7d7e7d7e000000010ccc0000807f8000000100c00000800100c000008000000000000000000000000000"
    "00000000000000000000000000000000000000";
const char* const meshopt_indices = "e0fe00ff0f520356154f075513ff0402ff0202040100007687566778a9866589689801690000";

std::string packed_by_draco(const char* digits) {
    test::GltfWriter file;
    const int view = file.view(from_hex(digits));
    const int p = file.accessor(R"("componentType":5126,"type":"VEC3","count":8)"),
              i = file.accessor(R"("componentType":5123,"type":"SCALAR","count":36)");
    return file.glb(test::gltf_scene_of(p, "",
                                        ",\"indices\":" + std::to_string(i) + R"(,"extensions":{"KHR_draco_mesh_compression":{"bufferView":)" +
                                            std::to_string(view) + R"(,"attributes":{"POSITION":0}}})"));
}

std::string packed_by_meshopt() {
    test::GltfWriter file;
    const auto view = [&](const char* digits, const char* how) {
        const std::string bytes = from_hex(digits);
        const size_t begin = (file.bytes().size() + 3) / 4 * 4;
        return std::to_string(file.view(bytes, R"(,"extensions":{"EXT_meshopt_compression":{"buffer":0,"byteOffset":)" + std::to_string(begin) +
                                                   ",\"byteLength\":" + std::to_string(bytes.size()) + how + "}}"));
    };
    const std::string v = view(meshopt_vertices, R"(,"count":8,"byteStride":12,"mode":"ATTRIBUTES")");
    const std::string n = view(meshopt_indices, R"(,"count":36,"byteStride":2,"mode":"TRIANGLES")");
    const int p = file.accessor("\"bufferView\":" + v + R"(,"componentType":5126,"type":"VEC3","count":8)");
    const int i = file.accessor("\"bufferView\":" + n + R"(,"componentType":5123,"type":"SCALAR","count":36)");
    file.add_buffer(R"({"byteLength":1000,"extensions":{"EXT_meshopt_compression":{"fallback":true}}})");
    return file.glb(test::gltf_scene_of(p, "", ",\"indices\":" + std::to_string(i)));
}

}  // namespace

std::vector<std::string> seeds() {
    test::GltfSquare square;
    const std::string plain = square.file.glb(square.scene()), text = square.file.json(square.scene(), "a.bin");
    const int instances = square.file.vectors({{0, 0, 0}, {2, 0, 0}});
    const int sparse =
        square.file.accessor(R"("componentType":5126,"type":"VEC3","count":4,"sparse":{"count":1,"indices":{"bufferView":3,"componentType":5123},)"
                             R"("values":{"bufferView":0}})");
    return {plain,
            text,
            square.file.glb(everything(square, instances)),
            square.file.glb(test::gltf_scene_of(sparse)),
            packed_by_draco(draco_boxes[0]),
            packed_by_draco(draco_boxes[1]),
            packed_by_meshopt()};
}

void run(std::string_view input) {
    write_input("a.ppm", "P6 2 1 255\n\1\2\3\4\5\6");
    write_input("a.bin", std::string(400, '\1'));
    const auto scene = import_scene({write_input("input.glb", input)});
    if (!scene) return;
    uint64_t bytes = 0, meshes = 0;
    for (const Shape& shape : scene->shapes) {
        bytes += sizeof shape;
        if (!shape.mesh || meshes++ >= 4) continue;
        TriangleMesh mesh;
        MeshIssues issues;
        if (!shape.mesh->load(mesh, issues)) continue;
        for (const Triangle& t : mesh.triangles)
            for (const uint32_t v : t) RAYPAGER_CHECK(v < mesh.positions.size());
    }
    check_proportion(bytes, input, uint64_t{1} << 12);
}

}  // namespace raypager::fuzz
