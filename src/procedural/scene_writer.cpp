#include "procedural/scene_writer.hpp"

#include <fmt/format.h>

namespace raypager {
namespace {

std::string numbers(const std::array<double, 3>& v) { return fmt::format("{} {} {}", v[0], v[1], v[2]); }

// Coordinates are written as floats, since that is what a reader keeps.
std::string point(const Vector& p) {
    const Float3 f = float3(p);
    return fmt::format("{} {} {}", f.x, f.y, f.z);
}

Status cannot_make(const std::filesystem::path& folder, const std::error_code& error) {
    return Status::failed(fmt::format("{}: the folder cannot be made: {}", folder.string(), error.message()));
}

// A number, or the name of a texture.
std::string roughness_of(std::string_view roughness) {
    const bool number = !roughness.empty() && roughness[0] >= '0' && roughness[0] <= '9';
    return number ? fmt::format("\"float roughness\" {}", roughness) : fmt::format("\"texture roughness\" \"{}\"", roughness);
}

std::string mesh_path(std::string_view name) { return fmt::format("meshes/{}.ply", name); }

}  // namespace

Result<SceneWriter> SceneWriter::create(const MakeSceneOptions& options) {
    SceneWriter writer;
    writer.options_ = options;
    std::error_code error;
    const std::filesystem::path folder = options.kind == "points" ? options.directory : options.directory / "meshes";
    std::filesystem::create_directories(folder, error);
    if (error) return cannot_make(folder, error);
    if (options.kind == "museum" || options.kind == "island") std::filesystem::create_directories(options.directory / "textures", error);
    if (error) return cannot_make(options.directory / "textures", error);
    if (options.kind == "forest" || options.kind == "island") std::filesystem::create_directories(options.directory / "instances", error);
    if (error) return cannot_make(options.directory / "instances", error);
    writer.made_.scene_file = options.directory / "scene.pbrt";
    std::filesystem::remove(writer.made_.scene_file, error);
    if (error) return Status::failed(fmt::format("{}: the old scene cannot be removed: {}", writer.made_.scene_file.string(), error.message()));
    return writer;
}

void SceneWriter::begin(std::string_view comment, const View& view) {
    text_ += fmt::format("# {}\n\n", comment);
    text_ += fmt::format("Film \"rgb\" \"integer xresolution\" {} \"integer yresolution\" {} \"string filename\" \"{}.exr\"\n", view.width,
                         view.height, options_.kind);
    text_ += "Sampler \"independent\" \"integer pixelsamples\" 64\nIntegrator \"path\" \"integer maxdepth\" 5\n";
    // pbrt's camera looks into a left-handed space: mirrored, so that the world is right-handed.
    text_ += fmt::format("Scale -1 1 1\nLookAt {}  {}  {}\nCamera \"perspective\" \"float fov\" {}\n\nWorldBegin\n", point(view.eye),
                         point(view.target), point(view.up), view.fov_degrees);
}

void SceneWriter::diffuse(std::string_view name, const Rgb& reflectance) {
    text_ += fmt::format("MakeNamedMaterial \"{}\" \"string type\" \"diffuse\" \"rgb reflectance\" [{}]\n", name, numbers(reflectance));
}

void SceneWriter::conductor(std::string_view name, const Rgb& eta, const Rgb& k, double roughness) {
    text_ += fmt::format(
        "MakeNamedMaterial \"{}\" \"string type\" \"conductor\" \"rgb eta\" [{}] \"rgb k\" [{}] \"float roughness\" {} \"bool remaproughness\" "
        "false\n",
        name, numbers(eta), numbers(k), roughness);
}

void SceneWriter::glass(std::string_view name, double ior) {
    text_ += fmt::format("MakeNamedMaterial \"{}\" \"string type\" \"dielectric\" \"float eta\" {}\n", name, ior);
}

void SceneWriter::diffuse_transmission(std::string_view name, const Rgb& reflectance, const Rgb& transmittance) {
    text_ += fmt::format("MakeNamedMaterial \"{}\" \"string type\" \"diffusetransmission\" \"rgb reflectance\" [{}] \"rgb transmittance\" [{}]\n",
                         name, numbers(reflectance), numbers(transmittance));
}

void SceneWriter::color_texture(std::string_view name, std::string_view file) {
    text_ += fmt::format("Texture \"{}\" \"spectrum\" \"imagemap\" \"string filename\" \"{}\"\n", name, file);
}

void SceneWriter::number_texture(std::string_view name, std::string_view file, double scale) {
    text_ += fmt::format("Texture \"{}\" \"float\" \"imagemap\" \"string filename\" \"{}\" \"string encoding\" \"linear\"", name, file);
    text_ += scale == 1 ? "\n" : fmt::format(" \"float scale\" {}\n", scale);
}

void SceneWriter::count_images(uint64_t count, uint64_t texture_bytes, uint64_t file_bytes) {
    made_.textures += count;
    made_.texture_bytes += texture_bytes;
    made_.bytes += file_bytes;
}

void SceneWriter::textured_diffuse(std::string_view name, std::string_view color) {
    text_ += fmt::format("MakeNamedMaterial \"{}\" \"string type\" \"diffuse\" \"texture reflectance\" \"{}\"\n", name, color);
}

void SceneWriter::textured_coat(std::string_view name, std::string_view color, std::string_view roughness) {
    text_ +=
        fmt::format("MakeNamedMaterial \"{}\" \"string type\" \"coateddiffuse\" \"texture reflectance\" \"{}\" {} \"bool remaproughness\" false\n",
                    name, color, roughness_of(roughness));
}

void SceneWriter::textured_conductor(std::string_view name, const Rgb& eta, const Rgb& k, std::string_view roughness) {
    text_ += fmt::format("MakeNamedMaterial \"{}\" \"string type\" \"conductor\" \"rgb eta\" [{}] \"rgb k\" [{}] {} \"bool remaproughness\" false\n",
                         name, numbers(eta), numbers(k), roughness_of(roughness));
}

void SceneWriter::image_sky(std::string_view file) {
    // The image's z is up.
    text_ += fmt::format("AttributeBegin\n  Rotate -90 1 0 0\n  LightSource \"infinite\" \"string filename\" \"{}\"\nAttributeEnd\n", file);
}

void SceneWriter::coat(std::string_view name, const Rgb& reflectance, double roughness) {
    text_ += fmt::format(
        "MakeNamedMaterial \"{}\" \"string type\" \"coateddiffuse\" \"rgb reflectance\" [{}] \"float roughness\" {} \"bool remaproughness\" "
        "false\n",
        name, numbers(reflectance), roughness);
}

void SceneWriter::sky(const Rgb& radiance) { text_ += fmt::format("LightSource \"infinite\" \"rgb L\" [{}]\n", numbers(radiance)); }

void SceneWriter::sun(const Vector& towards_sun, const Rgb& irradiance) {
    text_ +=
        fmt::format("LightSource \"distant\" \"rgb L\" [{}] \"point3 from\" [{}] \"point3 to\" [0 0 0]\n", numbers(irradiance), point(towards_sun));
}

void SceneWriter::shape_quad(const Vector& p, const Vector& a, const Vector& b) {
    text_ += fmt::format("  Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [{}  {}  {}  {}]\n", point(p), point(p + a),
                         point(p + a + b), point(p + b));
    made_.triangles += 2;
}

void SceneWriter::light(const Vector& p, const Vector& a, const Vector& b, const Rgb& radiance) {
    text_ += fmt::format("AttributeBegin\n  Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n  AreaLightSource \"diffuse\" \"rgb L\" [{}]\n",
                         numbers(radiance));
    shape_quad(p, a, b);
    text_ += "AttributeEnd\n";
}

void SceneWriter::sphere(std::string_view material, const Vector& center, double radius) {
    text_ += fmt::format("AttributeBegin\n  NamedMaterial \"{}\"\n  Translate {}\n  Shape \"sphere\" \"float radius\" {}\nAttributeEnd\n", material,
                         point(center), radius);
}

void SceneWriter::quad(std::string_view material, const Vector& p, const Vector& a, const Vector& b) {
    text_ += fmt::format("AttributeBegin\n  NamedMaterial \"{}\"\n", material);
    shape_quad(p, a, b);
    text_ += "AttributeEnd\n";
}

Result<PlyWriter> SceneWriter::begin_mesh(std::string_view name, uint64_t vertices, uint64_t triangles) const {
    return PlyWriter::create(options_.directory / mesh_path(name), vertices, triangles);
}

void SceneWriter::add_mesh_file(std::string_view name, std::string_view material, std::string_view alpha, const PlyWriter& writer) {
    const std::string cut_out = alpha.empty() ? "" : fmt::format(" \"texture alpha\" \"{}\"", alpha);
    text_ += fmt::format("AttributeBegin\n  NamedMaterial \"{}\"\n  Shape \"plymesh\" \"string filename\" \"{}\"{}\nAttributeEnd\n", material,
                         mesh_path(name), cut_out);
    made_.triangles += writer.triangle_count();
    made_.bytes += writer.bytes();
}

Status SceneWriter::finish_mesh(std::string_view name, std::string_view material, PlyWriter& writer) {
    RAYPAGER_TRY(writer.commit());
    add_mesh_file(name, material, {}, writer);
    return {};
}

Status SceneWriter::textured_mesh(std::string_view name, std::string_view material, const TriangleMesh& mesh, std::string_view alpha) {
    auto writer = PlyWriter::create(options_.directory / mesh_path(name), mesh.positions.size(), mesh.triangles.size(), true, !mesh.normals.empty());
    if (!writer) return writer.status();
    RAYPAGER_TRY(writer->add_vertices(mesh.positions, mesh.uvs, mesh.normals));
    RAYPAGER_TRY(writer->add_triangles(mesh.triangles));
    RAYPAGER_TRY(writer->commit());
    add_mesh_file(name, material, alpha, *writer);
    return {};
}

Status SceneWriter::mesh(std::string_view name, std::string_view material, std::span<const Float3> positions, std::span<const Triangle> triangles) {
    auto writer = begin_mesh(name, positions.size(), triangles.size());
    if (!writer) return writer.status();
    RAYPAGER_TRY(writer->add_vertices(positions));
    RAYPAGER_TRY(writer->add_triangles(triangles));
    return finish_mesh(name, material, *writer);
}

void SceneWriter::begin_moved(const Vector& by) { text_ += fmt::format("AttributeBegin\n  Translate {}\n", point(by)); }

void SceneWriter::end_moved() { text_ += "AttributeEnd\n"; }

void SceneWriter::begin_object(std::string_view name) { text_ += fmt::format("ObjectBegin \"{}\"\n", name); }

void SceneWriter::end_object() { text_ += "ObjectEnd\n"; }

Status SceneWriter::include(std::string_view file, std::string_view text) {
    RAYPAGER_TRY(write_text(options_.directory / file, text));
    text_ += fmt::format("AttributeBegin\n  Include \"{}\"\nAttributeEnd\n", file);
    made_.bytes += text.size();
    return {};
}

void SceneWriter::points(std::string_view file, std::string_view material, uint64_t count, uint64_t bytes) {
    text_ += fmt::format("AttributeBegin\n  NamedMaterial \"{}\"\n  Shape \"points\" \"string filename\" \"{}\"\nAttributeEnd\n", material, file);
    made_.points += count;
    made_.bytes += bytes;
}

Result<MadeScene> SceneWriter::finish() {
    RAYPAGER_TRY(write_text(made_.scene_file, text_));
    made_.bytes += text_.size();
    return made_;
}

}  // namespace raypager
