#include "bake/scene_size.hpp"

#include <algorithm>

#include "world/world.hpp"

namespace raypager {
namespace {

uint64_t estimated_bytes_of_shape(const Shape& shape) {
    if (shape.points) return shape.points->count() * sphere_weight;
    if (!shape.mesh) return sphere_weight;
    // A triangle takes about as many bytes in a block as in a binary file.
    const auto* in_memory = dynamic_cast<const MeshInMemory*>(shape.mesh.get());
    if (!in_memory) return shape.mesh->bytes_to_read();
    const TriangleMesh& mesh = in_memory->mesh();
    if (mesh.triangles.empty()) return 0;
    const float own = static_cast<float>(static_cast<double>(mesh.positions.size()) / static_cast<double>(mesh.triangles.size()));
    const VertexAttributes attributes = {!mesh.normals.empty(), !mesh.colors.empty(), !mesh.uvs.empty()};
    return mesh.triangles.size() * triangle_weight(std::clamp(own, 0.5f, 3.0f), attributes);
}

}  // namespace

uint64_t estimated_bytes(const Object& object) {
    uint64_t sum = 0;
    for (const Shape& shape : object.shapes) sum += estimated_bytes_of_shape(shape);
    return sum;
}

uint64_t estimated_bytes(const Scene& scene) {
    uint64_t sum = 0;
    for (const Shape& shape : scene.shapes) sum += estimated_bytes_of_shape(shape);
    for (const Object& object : scene.objects) sum += estimated_bytes(object);
    for (const auto& source : scene.instances) sum += source->count() * instance_weight;
    return sum;
}

}  // namespace raypager
