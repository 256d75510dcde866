// Meshes, clouds, instances and images that numpy arrays hold: what the engine reads from them while it bakes, it reads where it lies.
#pragma once

#include <nanobind/nanobind.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "python/arrays.hpp"
#include "raypager/scene.hpp"

namespace raypager::python {

// As many normals, coordinates of textures and colours as positions, or none.
struct MeshRows {
    Rows<Float3> positions;
    Rows<Triangle> triangles;
    Rows<Float3> normals;
    Rows<Float2> uvs;
    Rows<uint32_t> colors;  // as TriangleMesh has them
};

class ArrayMesh final : public MeshSource {
public:
    // files: where the arrays came from.
    ArrayMesh(std::string name, MeshRows rows, std::vector<std::string> files)
        : name_(std::move(name)), rows_(std::move(rows)), files_(std::move(files)) {}
    Status load(TriangleMesh& mesh, MeshIssues& issues) const override;
    Status stream(MeshSink& sink, MeshIssues& issues) const override;
    std::string name() const override { return name_; }
    std::vector<std::string> files() const override { return files_; }
    uint64_t bytes_to_read() const override;

private:
    const std::string name_;
    const MeshRows rows_;
    const std::vector<std::string> files_;
};

// As many radii and colours as positions, or none.
struct PointRows {
    Rows<Float3> positions;
    Rows<float> radii;      // 0: from the spacing around it
    Rows<uint32_t> colors;  // as CloudPoint has them
};

class ArrayPoints final : public PointSource {
public:
    ArrayPoints(std::string name, PointRows rows, std::vector<std::string> files)
        : name_(std::move(name)), rows_(std::move(rows)), files_(std::move(files)) {}
    Status stream(const std::function<Status(std::span<const CloudPoint>)>& take, MeshIssues& issues) const override;
    uint64_t count() const override { return rows_.positions.values.size(); }
    bool has_color() const override { return !rows_.colors.values.empty(); }
    std::string name() const override { return name_; }
    std::vector<std::string> files() const override { return files_; }

private:
    const std::string name_;
    const PointRows rows_;
    const std::vector<std::string> files_;
};

// Points that a function of Python's hands out chunk by chunk: each call returns an iterator over (positions, radii or None, colors or None). The GIL
// is taken for as long as it takes to get the next chunk.
class ChunkedPoints final : public PointSource {
public:
    ChunkedPoints(std::string name, nb::object chunks, uint64_t count, bool has_color)
        : name_(std::move(name)), chunks_(keep(std::move(chunks))), count_(count), has_color_(has_color) {}
    Status stream(const std::function<Status(std::span<const CloudPoint>)>& take, MeshIssues& issues) const override;
    uint64_t count() const override { return count_; }
    bool has_color() const override { return has_color_; }
    std::string name() const override { return name_; }

private:
    const std::string name_;
    const std::shared_ptr<const nb::object> chunks_;
    const uint64_t count_;
    const bool has_color_;
};

struct InstanceRows {
    uint32_t object = 0;
    Rows<std::array<std::array<double, 4>, 3>> transforms;
    Rows<uint32_t> materials;  // one each, one for all, or none; RP_NONE: they keep theirs
    Rows<Float3> colors;       // one each, or none
};

class ArrayInstances final : public InstanceSource {
public:
    ArrayInstances(std::string name, InstanceRows rows);
    Status stream(const std::function<Status(std::span<const Placement>)>& take) const override;
    uint64_t count() const override { return rows_.transforms.values.size(); }
    std::string name() const override { return name_; }
    uint64_t fingerprint() const override;
    std::vector<ObjectMaterial> materials() const override { return materials_; }

private:
    const std::string name_;
    const InstanceRows rows_;
    std::vector<ObjectMaterial> materials_;
};

class ArrayImage final : public ImageSource {
public:
    // texels: as many bytes as the shape has.
    ArrayImage(std::string name, const ImageShape& shape, Rows<std::byte> texels)
        : name_(std::move(name)), shape_(shape), texels_(std::move(texels)) {}
    std::string name() const override { return name_; }
    Result<ImageShape> shape() const override { return shape_; }
    Status read(const std::function<Status(std::span<const std::byte> rows)>& take) const override { return take(texels_.values); }
    Result<uint64_t> fingerprint() const override;

private:
    const std::string name_;
    const ImageShape shape_;
    const Rows<std::byte> texels_;
};

}  // namespace raypager::python
