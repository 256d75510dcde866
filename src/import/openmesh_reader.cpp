// Mesh formats that OpenMesh reads, streamed into flat arrays: no half-edge mesh is built, so that non-manifold input stays as it is
// and memory holds the triangles once.
#include <fmt/format.h>

#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <OpenMesh/Core/IO/reader/OBJReader.hh>
#include <OpenMesh/Core/IO/reader/OFFReader.hh>
#include <OpenMesh/Core/IO/reader/PLYReader.hh>
#include <OpenMesh/Core/IO/reader/STLReader.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <istream>
#include <limits>
#include <mutex>

#include "import/checked_input.hpp"
#include "import/mesh_readers.hpp"

namespace raypager {
namespace {

using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;

// Everything about a mesh that the tracer has no use for.
class FlatImporterBase : public OpenMesh::IO::BaseImporter {
public:
    using EdgeHandle = OpenMesh::EdgeHandle;
    using StatusInfo = OpenMesh::Attributes::StatusInfo;
    HalfedgeHandle add_edge(VertexHandle, VertexHandle) override { return HalfedgeHandle(); }
    FaceHandle add_face(HalfedgeHandle) override { return FaceHandle(); }
    void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec2f>&) override {}
    void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec3f>&) override {}
    void set_face_texindex(FaceHandle, int) override {}
    void set_halfedge(VertexHandle, HalfedgeHandle) override {}
    void set_color(VertexHandle, const OpenMesh::Vec3uc&) override {}
    void set_color(VertexHandle, const OpenMesh::Vec4uc&) override {}
    void set_color(VertexHandle, const OpenMesh::Vec3f&) override {}
    void set_color(VertexHandle, const OpenMesh::Vec4f&) override {}
    void set_color(EdgeHandle, const OpenMesh::Vec3uc&) override {}
    void set_color(EdgeHandle, const OpenMesh::Vec4uc&) override {}
    void set_color(EdgeHandle, const OpenMesh::Vec3f&) override {}
    void set_color(EdgeHandle, const OpenMesh::Vec4f&) override {}
    void set_color(FaceHandle, const OpenMesh::Vec3uc&) override {}
    void set_color(FaceHandle, const OpenMesh::Vec4uc&) override {}
    void set_color(FaceHandle, const OpenMesh::Vec3f&) override {}
    void set_color(FaceHandle, const OpenMesh::Vec4f&) override {}
    void set_texcoord(VertexHandle, const OpenMesh::Vec2f&) override {}
    void set_texcoord(VertexHandle, const OpenMesh::Vec3f&) override {}
    void set_texcoord(HalfedgeHandle, const OpenMesh::Vec2f&) override {}
    void set_texcoord(HalfedgeHandle, const OpenMesh::Vec3f&) override {}
    void set_status(VertexHandle, const StatusInfo&) override {}
    void set_status(HalfedgeHandle, const StatusInfo&) override {}
    void set_status(EdgeHandle, const StatusInfo&) override {}
    void set_status(FaceHandle, const StatusInfo&) override {}
    void set_next(HalfedgeHandle, HalfedgeHandle) override {}
    void set_face(HalfedgeHandle, FaceHandle) override {}
    void request_face_texcoords2D() override {}
    void set_normal(FaceHandle, const OpenMesh::Vec3f&) override {}
    void set_normal(FaceHandle, const OpenMesh::Vec3d&) override {}
    void add_texture_information(int, std::string) override {}
};

// Takes vertices, normals and faces as they come.
class FlatImporter final : public FlatImporterBase {
public:
    using FlatImporterBase::add_face;
    using FlatImporterBase::set_normal;
    FlatImporter(TriangleMesh& mesh, MeshIssues& issues) : mesh_(mesh), fan_(mesh, issues) {}

    VertexHandle add_vertex(const OpenMesh::Vec3f& p) override {
        mesh_.positions.push_back(position(p));
        return VertexHandle(static_cast<int>(mesh_.positions.size() - 1));
    }
    VertexHandle add_vertex() override { return add_vertex(OpenMesh::Vec3f(0, 0, 0)); }
    void set_point(VertexHandle vertex, const OpenMesh::Vec3f& p) override {
        if (exists(vertex)) mesh_.positions[static_cast<size_t>(vertex.idx())] = position(p);
    }

    // PLY gives every vertex its normal once. OBJ names a normal at each corner of a face, just before the face: where a vertex gets
    // several, as at the edges of a box, it is split into one vertex a normal, all in the same place.
    void set_normal(VertexHandle vertex, const OpenMesh::Vec3f& n) override {
        if (!exists(vertex)) return;
        mesh_.normals.resize(mesh_.positions.size());
        const Float3 normal{n[0], n[1], n[2]};
        Float3& present = mesh_.normals[static_cast<size_t>(vertex.idx())];
        if (present == Float3{}) present = normal;
        if (present != normal) corners_.push_back({static_cast<uint32_t>(vertex.idx()), normal});
    }
    void set_normal(VertexHandle vertex, const OpenMesh::Vec3d& n) override { set_normal(vertex, OpenMesh::Vec3f(n)); }

    FaceHandle add_face(const VHandles& vertices) override {
        fan_.begin();
        for (const VertexHandle v : vertices) fan_.corner(corner_vertex(static_cast<uint32_t>(v.idx())));
        fan_.end();
        corners_.clear();
        return FaceHandle(static_cast<int>(faces_++ & 0x7fffffff));
    }

    // Counts were checked against the file's size before OpenMesh saw them.
    void reserve(unsigned int vertices, unsigned int, unsigned int faces) override {
        mesh_.positions.reserve(vertices);
        mesh_.triangles.reserve(faces);
    }
    size_t n_vertices() const override { return mesh_.positions.size(); }
    size_t n_faces() const override { return static_cast<size_t>(faces_); }
    size_t n_edges() const override { return 0; }
    void finish() override {
        if (!mesh_.normals.empty()) mesh_.normals.resize(mesh_.positions.size());
    }

private:
    struct CornerNormal {
        uint32_t vertex;
        Float3 normal;
    };

    bool exists(VertexHandle vertex) const { return vertex.is_valid() && static_cast<size_t>(vertex.idx()) < mesh_.positions.size(); }

    static Float3 position(const OpenMesh::Vec3f& p) {
        const auto coordinate = [](float x) { return x == not_finite_coordinate ? std::numeric_limits<float>::infinity() : x; };
        return {coordinate(p[0]), coordinate(p[1]), coordinate(p[2])};
    }

    uint32_t corner_vertex(uint32_t vertex) {
        for (const CornerNormal& corner : corners_)
            if (corner.vertex == vertex) return split(vertex, corner.normal);
        return vertex;
    }

    // The copy of vertex that has this normal: found in the chain of its copies, or added to it.
    uint32_t split(uint32_t vertex, const Float3& normal) {
        next_copy_.resize(mesh_.positions.size(), RP_NONE);
        uint32_t last = vertex;
        while (next_copy_[last] != RP_NONE) {
            last = next_copy_[last];
            if (mesh_.normals[last] == normal) return last;
        }
        const auto copy = static_cast<uint32_t>(mesh_.positions.size());
        mesh_.positions.push_back(Float3(mesh_.positions[vertex]));
        mesh_.normals.resize(mesh_.positions.size());
        mesh_.normals[copy] = normal;
        next_copy_[last] = copy;
        next_copy_.push_back(RP_NONE);
        return copy;
    }

    TriangleMesh& mesh_;
    FanBuilder fan_;
    uint64_t faces_ = 0;
    std::vector<CornerNormal> corners_;  // of the coming face, where they differ from the vertex's
    std::vector<uint32_t> next_copy_;
};

// OpenMesh's readers are global and keep state between calls, and so do its log streams.
std::mutex& openmesh_mutex() {
    static std::mutex mutex;
    return mutex;
}

// Keeps OpenMesh from writing to the terminal: what went wrong is said in our own words.
class Silence {
public:
    Silence() : log_(omlog().is_enabled()), out_(omout().is_enabled()), err_(omerr().is_enabled()) {
        omlog().disable();
        omout().disable();
        omerr().disable();
    }
    ~Silence() {
        if (log_) omlog().enable();
        if (out_) omout().enable();
        if (err_) omerr().enable();
    }
    Silence(const Silence&) = delete;
    Silence& operator=(const Silence&) = delete;

private:
    bool log_, out_, err_;
};

// counted: the format states how many items follow, so that any failed extraction is an error at once rather than a loop to the end.
Status run(OpenMesh::IO::BaseReader& reader, CheckedInput& input, const std::string& name, OpenMesh::IO::Options options, bool counted,
           TriangleMesh& mesh, MeshIssues& issues) {
    const std::lock_guard lock(openmesh_mutex());
    const Silence silence;
    FlatImporter importer(mesh, issues);
    try {
        std::istream stream(&input);
        stream.exceptions(counted ? std::ios::badbit | std::ios::failbit : std::ios::badbit);
        const bool read = reader.read(stream, importer, options);
        importer.finish();
        if (!input.status().ok()) return input.status();
        if (!read) return Status::failed(name + ": OpenMesh cannot read it");
    } catch (const CheckedInput::InputError&) {
        return input.status();
    } catch (const std::bad_alloc&) {
        return Status::failed(name + ": not enough memory for its mesh");
    } catch (const std::exception& error) {
        return Status::failed(fmt::format("{}: OpenMesh cannot read it: {}", name, error.what()));
    }
    if (importer.n_faces() < input.faces()) issues.degenerate += input.faces() - importer.n_faces();
    return {};
}

}  // namespace

Status read_with_openmesh(const InputFile& file, MeshFormat format, TriangleMesh& mesh, MeshIssues& issues) {
    using OpenMesh::IO::Options;
    const std::string name = file.path().string();
    switch (format) {
        case MeshFormat::obj:
            return run(OpenMesh::IO::OBJReader(), *check_obj_text(file), name, Options::VertexNormal, false, mesh, issues);
        case MeshFormat::off:
            return run(OpenMesh::IO::OFFReader(), *check_off_text(file), name, Options(), true, mesh, issues);
        case MeshFormat::stl: {
            const auto kind = find_stl_kind(file);
            if (!kind) return kind.status();
            const bool binary = *kind == StlKind::binary;
            const auto input = binary ? check_stl_binary(file) : check_stl_text(file);
            OpenMesh::IO::STLReader().set_epsilon(0);  // equal corners become one vertex, close ones do not
            return run(OpenMesh::IO::STLReader(), *input, name, binary ? Options::Binary : Options::Default, binary, mesh, issues);
        }
        case MeshFormat::ply: {
            const auto header = read_ply_header(file);
            if (!header) return header.status();
            const auto layout = find_ply_layout(*header, name);
            if (!layout) return layout.status();
            if (layout->faces < layout->vertices) return Status::failed(name + ": lists faces before vertices; convert it to binary PLY");
            return run(OpenMesh::IO::PLYReader(), *check_ply_text(file, *header, *layout), name, Options::VertexNormal, true, mesh, issues);
        }
    }
    return {};
}

}  // namespace raypager
