// A primitive of a mesh of a glTF file, which is read when it is asked for.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "import/gltf_model.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// Of a primitive, which triangles a mesh has: of those whose v grows to the other side of u than usual, normal maps have another green.
enum class GltfPart { whole, usual, mirrored };

struct GltfReading {
    int64_t mesh = 0, primitive = 0;
    int64_t uv_set = 0;
    GltfPart part = GltfPart::whole;
    // Which triangles: those of this group, of the groups by triangle (GltfGlow); null: all.
    std::shared_ptr<const std::vector<uint8_t>> groups = nullptr;
    uint8_t group = 0;
    bool colors = false;                 // of vertices are wanted, times:
    Float3 color_factor{1, 1, 1};        // linear
    std::vector<double> weights = {};    // of morph targets
    std::vector<Transform> joints = {};  // of a skin: from the space of the mesh at rest into the world; none: it has none
};

class GltfMesh final : public MeshSource {
public:
    // REQUIRES: the mesh and the primitive exist.
    GltfMesh(std::shared_ptr<const GltfModel> model, GltfReading reading);
    Status load(TriangleMesh& mesh, MeshIssues& issues) const override;
    std::string name() const override { return name_; }
    std::vector<std::string> files() const override { return model_->files(); }
    uint64_t bytes_to_read() const override;
    // Two corners of a box around it, as the file says; none where that is not known before it is read.
    std::vector<std::array<double, 3>> corners() const;

private:
    std::shared_ptr<const GltfModel> model_;
    GltfReading reading_;
    std::string name_;
};

// "mesh 3 "wheel", primitive 1".
std::string gltf_primitive_name(const GltfModel& model, int64_t mesh, int64_t primitive);

// What is known of a primitive before it is read.
struct GltfColors {
    bool any = false, uniform = true, alpha = false;  // alpha: some is below 1
    Float3 mean{1, 1, 1};                             // linear; if uniform, of all
};
Result<GltfColors> look_at_gltf_colors(const GltfModel& model, const tinygltf::Primitive& primitive);
// Whether some triangles are mirrored, and others not, in their coordinates of textures.
Result<bool> has_mirrored_uvs(const std::shared_ptr<const GltfModel>& model, const GltfReading& reading);
// Points as a cloud.
Result<std::shared_ptr<const PointSource>> read_gltf_points(const std::shared_ptr<const GltfModel>& model, const GltfReading& reading);

}  // namespace raypager
