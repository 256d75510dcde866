// Ptex files: textures of the faces of meshes. What is looked up is an image on which all faces lie, at coordinates that the corners of faces get
// when the mesh is loaded.
#include <fmt/format.h>

#include "image/ptex_atlas.hpp"
#include "import/mesh_file.hpp"
#include "import/pbrt_reader.hpp"
#include "import/text.hpp"
#include "import/triangles_apart.hpp"

namespace raypager {
namespace {

struct PtexUse {
    std::shared_ptr<const PtexAtlas> faces;  // null: none
    bool alone = true;                       // of all that asks for coordinates
};

bool asks_for_uvs(const Scene& scene, const rp_texture_op& op) {
    switch (op.op & RP_TEXTURE_OPERATION_MASK) {
        case RP_TEXTURE_IMAGE:
        case RP_TEXTURE_CHECKS:
        case RP_TEXTURE_DOTS:
        case RP_TEXTURE_BILERP:
        case RP_TEXTURE_UV:
            return op.map == RP_NONE || scene.texture_maps[op.map].kind == RP_MAP_UV;
        default:
            return false;
    }
}

void find_ptex(const Scene& scene, uint32_t material, PtexUse& use) {
    const rp_material& m = scene.materials[material];
    if (m.kind == RP_MATERIAL_MIX) {
        find_ptex(scene, m.second, use);
        if (m.first != RP_NONE) find_ptex(scene, m.first, use);
    }
    const uint32_t program = m.flags >> RP_MATERIAL_PROGRAM_SHIFT;
    for (size_t i = program - 1; program > 0; ++i) {
        const rp_texture_op& op = scene.texture_ops[i];
        const bool is_image = (op.op & RP_TEXTURE_OPERATION_MASK) == RP_TEXTURE_IMAGE;
        const auto faces = is_image ? std::dynamic_pointer_cast<const PtexAtlas>(scene.images[op.image]) : nullptr;
        if (faces) {
            use.alone = use.alone && (!use.faces || use.faces->lies_like(*faces));
            if (!use.faces) use.faces = faces;
        } else if (asks_for_uvs(scene, op)) {
            use.alone = false;
        }
        if (op.op & RP_TEXTURE_LAST) break;
    }
}

// A copy with the mid values of its textures. All materials that it mixes are there.
uint32_t without_textures(Scene& scene, uint32_t material) {
    rp_material m = scene.materials[material];
    if (m.kind == RP_MATERIAL_MIX) {
        m.second = without_textures(scene, m.second);
        if (m.first != RP_NONE) m.first = without_textures(scene, m.first);
    }
    m.flags &= (1u << RP_MATERIAL_PROGRAM_SHIFT) - 1;
    scene.materials.push_back(m);
    return static_cast<uint32_t>(scene.materials.size() - 1);
}

// The same mesh, each corner where it lies on its face: at its own u and v if it has them, else as pbrt places them.
TriangleMesh on_faces(const TriangleMesh& mesh, std::span<const double> numbers, const PtexAtlas& atlas) {
    return triangles_apart(mesh, [&](size_t i, size_t k) {
        const Float2 uv = mesh.uvs.empty() ? uvs_of_bare_triangle[k] : mesh.uvs[mesh.triangles[i][k]];
        return atlas.place(numbers[i] >= 0 ? static_cast<uint64_t>(numbers[i]) : 0, uv.x, uv.y);
    });
}

}  // namespace

Status PbrtReader::ptex_texture(const Directive& directive, const PbrtParameters& parameters, bool is_float, PbrtTexture& made) {
    const PbrtParameter* file = parameters.find("filename");
    if (!file || file->strings.size() != 1) return error(directive, "expected \"string filename\" of the Ptex file");
    ImageEncoding encoding = {ImageEncoding::Kind::gamma, 2.2f};
    if (parameters.find("gamma")) {
        seems_version(3);
        encoding.gamma = static_cast<float>(parameters.number("gamma", 2.2));
        if (!(encoding.gamma > 0 && encoding.gamma <= 100)) return error(directive, "its gamma must be more than 0, and at most 100");
    } else {
        RAYPAGER_TRY(image_encoding(directive, parameters, encoding));
    }
    if (encoding.kind == ImageEncoding::Kind::gamma && encoding.gamma == 1) encoding.kind = ImageEncoding::Kind::linear;
    const auto scale = static_cast<float>(parameters.number("scale", 1));
    rp_texture_op op = texture_op(RP_TEXTURE_IMAGE, {scale, scale, scale});
    if (is_float) op.op |= 1u << RP_TEXTURE_CHANNEL_SHIFT;
    op.op |= (RP_WRAP_CLAMP | RP_WRAP_CLAMP << 2) << RP_TEXTURE_WRAP_SHIFT;
    RAYPAGER_TRY(parameters.status());
    std::filesystem::path path;
    bool exists = false;
    if (const Status found = find_file(file->strings[0], path, exists); !found.ok()) return parameter_error(*file, found.message());
    auto& known = ptex_files_[{path.lexically_normal(), static_cast<int>(encoding.kind), encoding.gamma}];
    if (!known && !exists) {
        made.fault = parameter_error(*file, fmt::format("there is no file {}", clipped(path.string())));
    } else if (!known) {
        auto opened = PtexFile::open(path);
        auto atlas = opened ? PtexAtlas::create(std::move(*opened), encoding) : opened.status();
        if (atlas)
            known = std::move(*atlas);
        else
            made.fault = error(directive, atlas.status().message());
        if (listed_files_.insert(path.string()).second) scene_.files.push_back(path.string());
    }
    if (known) made.value = Texture::image(known, op, std::nullopt);
    return {};
}

// Where the material of a shape reads a Ptex file, its mesh gets the coordinates for it.
void PbrtReader::give_faces(const Directive& directive, const std::string& type, const PbrtParameters& parameters, Shape& shape) {
    PtexUse use;
    find_ptex(scene_, shape.material, use);
    if (!use.faces) return;
    const auto mesh = std::dynamic_pointer_cast<const MeshFile>(shape.mesh);
    if (mesh && use.alone && mesh_format(mesh->name()) == MeshFormat::ply) {
        auto& known = meshes_with_faces_[{mesh.get(), use.faces.get()}];
        if (!known) known = mesh->with_faces(use.faces);
        shape.mesh = known;
        return;
    }
    const auto triangles = type == "trianglemesh" ? std::dynamic_pointer_cast<const MeshInMemory>(shape.mesh) : nullptr;
    const PbrtParameter* const numbers = parameters.find("faceIndices");
    if (triangles && use.alone && numbers && numbers->numbers.size() >= triangles->mesh().triangles.size()) {
        shape.mesh = std::make_shared<MeshInMemory>(triangles->name(), on_faces(triangles->mesh(), numbers->numbers, *use.faces));
        return;
    }
    warn(directive.location, use.alone
                                 ? "Ptex textures are supported on PLY meshes and on triangle meshes with \"faceIndices\"; their mid values are used"
                                 : "other textures by u and v, or Ptex files of other faces, beside a Ptex texture are not supported; "
                                   "the mid values of all are used");
    auto& known = without_textures_[shape.material];
    if (!known) known = without_textures(scene_, shape.material);
    shape.material = *known;
}

}  // namespace raypager
