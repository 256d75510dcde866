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
           R"("samplers":[{"wrapS":33071}],"textures":[{"source":0,"sampler":0},{"source":1}],"materials":[{"alphaMode":"MASK","normalTexture":{"index":0},)"
           R"("pbrMetallicRoughness":{"baseColorTexture":{"index":0,"extensions":{"KHR_texture_transform":{"rotation":1,"scale":[2,2]}}},)"
           R"("metallicRoughnessTexture":{"index":0}},"emissiveFactor":[1,0,0],"emissiveTexture":{"index":1},"extensions":{"KHR_materials_ior":{"ior":1.3},)"
           R"("KHR_materials_transmission":{"transmissionFactor":0.5},"KHR_materials_volume":{"thicknessFactor":1,"attenuationDistance":2},)"
           R"("KHR_materials_clearcoat":{"clearcoatFactor":1,"clearcoatRoughnessTexture":{"index":0}},"KHR_materials_specular":{"specularFactor":0.5}}}],)"
           R"("animations":[{}],"meshes":[{"primitives":[{"mode":5,"material":0,"attributes":{"POSITION":)" +
           std::to_string(square.positions) + ",\"TEXCOORD_0\":" + std::to_string(square.uvs) + ",\"COLOR_0\":" + std::to_string(square.normals) +
           R"(},"targets":[{"POSITION":)" + std::to_string(square.normals) + R"(}]},{"mode":0,"attributes":{"POSITION":)" +
           std::to_string(square.positions) + "}}]}]";
}

}  // namespace

std::vector<std::string> seeds() {
    test::GltfSquare square;
    const std::string plain = square.file.glb(square.scene()), text = square.file.json(square.scene(), "a.bin");
    const int instances = square.file.vectors({{0, 0, 0}, {2, 0, 0}});
    const int sparse =
        square.file.accessor(R"("componentType":5126,"type":"VEC3","count":4,"sparse":{"count":1,"indices":{"bufferView":3,"componentType":5123},)"
                             R"("values":{"bufferView":0}})");
    return {plain, text, square.file.glb(everything(square, instances)), square.file.glb(test::gltf_scene_of(sparse))};
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
