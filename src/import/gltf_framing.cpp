#include "import/gltf_framing.hpp"

#include "import/scene_framing.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

Status add_mesh(const MeshSource& source, const std::vector<Transform>& places, SceneFraming& framing) {
    TriangleMesh mesh;
    MeshIssues ignored;
    RAYPAGER_TRY(source.load(mesh, ignored));
    std::vector<bool> used(mesh.positions.size(), false);
    for (const Triangle& t : mesh.triangles)
        for (const uint32_t v : t) used[v] = true;
    std::vector<Vector> points;
    for (size_t i = 0; i < used.size(); ++i)
        if (used[i]) points.push_back(vector(mesh.positions[i]));
    framing.add(std::move(points), places);
    return {};
}

Status add_cloud(const Shape& shape, SceneFraming& framing) {
    std::vector<Vector> points;
    MeshIssues ignored;
    RAYPAGER_TRY(shape.points->stream(
        [&](std::span<const CloudPoint> some) {
            for (const CloudPoint& p : some) points.push_back(vector(p.position));
            return Status();
        },
        ignored));
    framing.add(std::move(points), {shape.to_world});
    return {};
}

}  // namespace

Status frame_gltf(const GltfModel& model, const BareLook& look, bool has_camera, bool has_light, const std::vector<GltfPlaced>& placed,
                  Scene& scene) {
    SceneFraming framing(y_up, look, has_camera, scene);
    for (const GltfPlaced& some : placed)
        for (const auto& mesh : some.meshes) RAYPAGER_TRY(add_mesh(*mesh, some.places, framing));
    for (const Shape& shape : scene.shapes)
        if (shape.points) RAYPAGER_TRY(add_cloud(shape, framing));
    constexpr uint32_t ground_material = 0;
    const Status framed = framing.finish(has_light, ground_material);
    return framed.ok() ? framed : model.failed(framed.message());
}

}  // namespace raypager
