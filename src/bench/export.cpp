#include "bench/export.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "base/files.hpp"
#include "bench/export_groups.hpp"
#include "block/point_code.hpp"
#include "scene/octahedral.hpp"
#include "scene/projection.hpp"

namespace raypager::bench {
namespace {

constexpr double degrees = 180 / 3.14159265358979323846;
constexpr uint64_t most_mesh_triangles = 1'400'000'000;  // three vertices each, numbered in 32 bits
// Each is an object of Mitsuba's own; it takes kilobytes for one.
constexpr uint64_t max_spheres = 200'000;
constexpr uint32_t roulette_depth = 2;  // as in kernels/shading/scatter.cl; for Mitsuba, too, the best of 2, 3 and 5

std::string rgb(const char* name, float r, float g, float b) { return fmt::format("<rgb name=\"{}\" value=\"{} {} {}\"/>", name, r, g, b); }
std::string rgb(const char* name, const float* c) { return rgb(name, c[0], c[1], c[2]); }

std::string diffuse_xml(const std::string& id, const float* color) {
    return fmt::format("<bsdf type=\"twosided\"{}><bsdf type=\"diffuse\">{}</bsdf></bsdf>", id, rgb("reflectance", color));
}

std::string material_xml(const rp_material& m, size_t index) {
    const auto named = [&](const std::string& open, const std::string& inside, const std::string& close) {
        return fmt::format("  <bsdf type=\"{}\" id=\"material{}\">{}{}\n", open, index, inside, close);
    };
    switch (m.kind) {
        case RP_MATERIAL_DIFFUSE:
            return fmt::format("  {}\n", diffuse_xml(fmt::format(" id=\"material{}\"", index), m.color));
        case RP_MATERIAL_CONDUCTOR: {
            const std::string metal = rgb("eta", m.eta) + rgb("k", m.k);
            const std::string rough = fmt::format("<string name=\"distribution\" value=\"ggx\"/><float name=\"alpha\" value=\"{}\"/>", m.alpha);
            return named("twosided",
                         m.alpha > 0 ? "<bsdf type=\"roughconductor\">" + rough + metal + "</bsdf>" : "<bsdf type=\"conductor\">" + metal + "</bsdf>",
                         "</bsdf>");
        }
        case RP_MATERIAL_DIELECTRIC:
            return named("dielectric", fmt::format("<float name=\"int_ior\" value=\"{}\"/><float name=\"ext_ior\" value=\"1\"/>", m.ior), "</bsdf>");
        case RP_MATERIAL_ABSORBING:
            return named("diffuse", rgb("reflectance", 0, 0, 0), "</bsdf>");
        default:  // refused before
            return {};
    }
}

std::string light_xml(const rp_light& light) {
    switch (light.kind) {
        case RP_LIGHT_INFINITE:
            return "  <emitter type=\"constant\">" + rgb("radiance", light.radiance) + "</emitter>\n";
        case RP_LIGHT_DISTANT:
            return fmt::format("  <emitter type=\"directional\"><vector name=\"direction\" x=\"{}\" y=\"{}\" z=\"{}\"/>{}</emitter>\n", -light.p[0],
                               -light.p[1], -light.p[2], rgb("irradiance", light.radiance));
        case RP_LIGHT_POINT:
            return fmt::format("  <emitter type=\"point\"><point name=\"position\" x=\"{}\" y=\"{}\" z=\"{}\"/>{}</emitter>\n", light.p[0],
                               light.p[1], light.p[2], rgb("intensity", light.radiance));
        default:
            return {};  // goes with its shape
    }
}

double length(const Float3& v) { return std::hypot(double{v.x}, double{v.y}, double{v.z}); }

// Mitsuba's camera looks along +z, with +x to the left of the picture.
std::string sensor_xml(const BakedScene& scene) {
    const Camera& c = scene.camera;
    const double right = length(c.right), up = length(c.up), forward = length(c.forward);
    const auto row = [&](float Float3::*axis) {
        return fmt::format("{} {} {} {} ", -(c.right.*axis) / right, c.up.*axis / up, c.forward.*axis / forward, c.eye.*axis);
    };
    const auto reach = [](float low, float high) { return double{high} - low; };
    const double diagonal =
        std::hypot(reach(scene.lower[0], scene.upper[0]), reach(scene.lower[1], scene.upper[1]), reach(scene.lower[2], scene.upper[2]));
    std::string xml = fmt::format("  <default name=\"width\" value=\"{}\"/><default name=\"height\" value=\"{}\"/>\n", scene.width, scene.height);
    // The same camera with each of the samplers that bench/mitsuba/compare.py tries.
    for (const char* sampler : {"independent", "multijitter", "stratified", "ldsampler"})
        xml += fmt::format(
            "  <sensor type=\"perspective\" id=\"{}\">\n    <string name=\"fov_axis\" value=\"smaller\"/><float name=\"fov\" value=\"{}\"/>\n"
            "    <float name=\"near_clip\" value=\"{}\"/><float name=\"far_clip\" value=\"{}\"/>\n"
            "    <transform name=\"to_world\"><matrix value=\"{}{}{}0 0 0 1\"/></transform>\n"
            "    <sampler type=\"{}\"><integer name=\"sample_count\" value=\"{}\"/></sampler>\n"
            "    <film type=\"hdrfilm\"><integer name=\"width\" value=\"$width\"/><integer name=\"height\" value=\"$height\"/>\n"
            "      <string name=\"pixel_format\" value=\"rgb\"/><string name=\"component_format\" value=\"float32\"/><rfilter type=\"box\"/></film>\n"
            "  </sensor>\n",
            sampler, 2 * std::atan(std::min(right, up) / forward) * degrees, 1e-6 * std::max(diagonal, 1e-3), 100 * std::max(diagonal, 1e-3),
            row(&Float3::x), row(&Float3::y), row(&Float3::z), sampler, scene.spp);
    return xml;
}

std::string shape_xml(const Group& group, const std::string& type, const std::string& inside, const std::string& material) {
    const std::string emitter =
        group.shines ? "<emitter type=\"area\">" + rgb("radiance", group.radiance.x, group.radiance.y, group.radiance.z) + "</emitter>" : "";
    return fmt::format("  <shape type=\"{}\">{}{}{}</shape>\n", type, inside, material, emitter);
}

std::string material_reference(const Group& group) { return fmt::format("<ref id=\"material{}\"/>", group.material); }

// A PLY file of triangles that do not share vertices: first all corners come, then commit() numbers them.
class MeshWriter {
public:
    static Result<MeshWriter> create(const std::filesystem::path& path, uint64_t triangles, bool normals) {
        auto file = OutputFile::create(path);
        if (!file) return file.status();
        MeshWriter writer;
        writer.file_ = std::move(*file);
        writer.triangles_ = triangles;
        writer.normals_ = normals;
        const char* const normal_properties = normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "";
        RAYPAGER_TRY(writer.file_.write(
            fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n{}"
                        "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
                        3 * triangles, normal_properties, triangles)));
        return writer;
    }

    Status add(const DecodedTriangle& triangle) {
        // Corners without a normal of their own get the face's.
        const Float3 flat = normals_ ? face_normal(triangle) : Float3();
        for (size_t i = 0; i < 3; ++i) {
            RAYPAGER_TRY(file_.write(std::as_bytes(std::span(&triangle.vertices[i], 1))));
            if (!normals_) continue;
            const Float3 normal = triangle.normals[i] == RP_NONE ? flat : decode_octahedral(triangle.normals[i]);
            RAYPAGER_TRY(file_.write(std::as_bytes(std::span(&normal, 1))));
        }
        return {};
    }

    Status commit() {
        struct [[gnu::packed]] Face {
            uint8_t corners;
            uint32_t vertices[3];
        };
        for (uint64_t i = 0; i < triangles_; ++i) {
            const auto first = static_cast<uint32_t>(3 * i);
            const Face face = {3, {first, first + 1, first + 2}};
            RAYPAGER_TRY(file_.write(std::as_bytes(std::span(&face, 1))));
        }
        return file_.commit();
    }
    uint64_t bytes() const { return file_.position(); }

private:
    static Float3 face_normal(const DecodedTriangle& t) {
        const auto edge = [&](int i) {
            return std::array{double{t.vertices[i].x} - t.vertices[0].x, double{t.vertices[i].y} - t.vertices[0].y,
                              double{t.vertices[i].z} - t.vertices[0].z};
        };
        const auto a = edge(1), b = edge(2);
        return decode_octahedral(encode_octahedral(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]));
    }

    OutputFile file_;
    uint64_t triangles_ = 0;
    bool normals_ = false;
};

class Exporter {
public:
    Exporter(const BlockFile& file, const std::filesystem::path& directory, const std::function<void(double)>& progress)
        : file_(file), directory_(directory), progress_(progress), groups_(file.scene()) {}

    Result<ExportSummary> run() {
        if (groups_.two_sided()) return bad("has triangles that shine to both sides, which Mitsuba has not; make two lights of each");
        for (const rp_light& light : file_.scene().lights)
            if (light.flags & RP_LIGHT_UNSEEN) return bad("has lights that shine unseen, which Mitsuba has not; give them a surface");
        for (const rp_light& light : file_.scene().lights)
            if (light.flags >> RP_LIGHT_IMAGE_SHIFT || light.kind > RP_LIGHT_POINT)
                return bad("has lights with images or cones, which are not written for Mitsuba; leave them out");
        std::error_code error;
        std::filesystem::create_directories(directory_, error);
        if (error) return Status::failed(fmt::format("{}: the folder cannot be made: {}", directory_.string(), error.message()));
        RAYPAGER_TRY(count());
        RAYPAGER_TRY(write_meshes());
        RAYPAGER_TRY(write_scene());
        return summary_;
    }

private:
    Status bad(const std::string& what) const { return Status::failed(file_.path().string() + ": " + what); }
    std::filesystem::path mesh_path(size_t group) const { return fmt::format("mesh{}.ply", group); }

    void advance(const DecodedLeaf& part) {
        done_ += part.triangles.size() + part.spheres.size();
        const uint64_t all = 2 * (file_.scene().triangles + file_.scene().spheres);  // each comes twice
        if (progress_ && all > 0) progress_(static_cast<double>(done_) / static_cast<double>(all));
    }

    Status count() {
        const auto count_part = [&](const DecodedLeaf& part) {
            for (const DecodedTriangle& t : part.triangles) {
                Group& group = groups_.all()[groups_.of_primitive(t.id)];
                ++group.triangles;
                for (const uint32_t normal : t.normals) group.normals = group.normals || normal != RP_NONE;
            }
            for (const DecodedSphere& s : part.spheres) ++groups_.all()[groups_.of_primitive(s.id)].spheres;
            advance(part);
            return Status();
        };
        RAYPAGER_TRY(for_each_part(file_, count_part));
        for (const Group& group : groups_.all()) {
            if (group.triangles > most_mesh_triangles)
                return bad(fmt::format("has {} triangles of one material; at most {} can be exported", group.triangles, most_mesh_triangles));
            summary_.triangles += group.triangles;
            summary_.spheres += group.spheres;
        }
        if (std::ranges::any_of(file_.scene().materials, [](const rp_material& m) { return m.kind > RP_MATERIAL_ABSORBING; }))
            return bad("has layered or mixed materials; Mitsuba has others, and what differs there would not be the speed alone");
        if (summary_.spheres > max_spheres) return bad(fmt::format("has {} spheres; at most {} can be exported", summary_.spheres, max_spheres));
        return {};
    }

    Status write_meshes() {
        std::vector<std::optional<MeshWriter>> writers(groups_.all().size());
        for (size_t g = 0; g < writers.size(); ++g) {
            const Group& group = groups_.all()[g];
            if (group.triangles == 0) continue;
            auto writer = MeshWriter::create(directory_ / mesh_path(g), group.triangles, group.normals);
            if (!writer) return writer.status();
            writers[g] = std::move(*writer);
            // Without normals, those of the faces; else Mitsuba would smooth over.
            shapes_ += shape_xml(group, "ply",
                                 fmt::format("<string name=\"filename\" value=\"{}\"/><boolean name=\"face_normals\" value=\"{}\"/>",
                                             mesh_path(g).string(), !group.normals),
                                 material_reference(group));
        }
        const auto write_part = [&](const DecodedLeaf& part) -> Status {
            for (const DecodedTriangle& t : part.triangles) RAYPAGER_TRY(writers[groups_.of_primitive(t.id)]->add(t));
            for (const DecodedSphere& s : part.spheres) add_sphere(s);
            advance(part);
            return {};
        };
        RAYPAGER_TRY(for_each_part(file_, write_part));
        for (auto& writer : writers) {
            if (!writer) continue;
            RAYPAGER_TRY(writer->commit());
            summary_.bytes += writer->bytes();
        }
        return {};
    }

    void add_sphere(const DecodedSphere& s) {
        const Group& group = groups_.all()[groups_.of_primitive(s.id)];
        const bool own_color = group.colored && file_.scene().materials[group.material].kind == RP_MATERIAL_DIFFUSE;
        shapes_ += shape_xml(group, "sphere",
                             fmt::format("<point name=\"center\" x=\"{}\" y=\"{}\" z=\"{}\"/><float name=\"radius\" value=\"{}\"/>", s.center.x,
                                         s.center.y, s.center.z, s.radius),
                             own_color ? diffuse_xml("", point_reflectance(s.point_word >> 8).data()) : material_reference(group));
    }

    Status write_scene() {
        const BakedScene& scene = file_.scene();
        // A depth of 1 is what shines itself there.
        std::string text = fmt::format(
            "<scene version=\"3.0.0\">\n  <integrator type=\"path\"><integer name=\"max_depth\" value=\"{}\"/>"
            "<integer name=\"rr_depth\" value=\"{}\"/></integrator>\n",
            scene.max_depth + 1, roulette_depth);
        text += sensor_xml(scene);
        for (size_t i = 0; i < scene.materials.size(); ++i) text += material_xml(scene.materials[i], i);
        for (const rp_light& light : scene.lights) text += light_xml(light);
        text += shapes_ + "</scene>\n";
        summary_.bytes += text.size();
        return write_text(directory_ / "scene.xml", text);
    }

    const BlockFile& file_;
    const std::filesystem::path& directory_;
    const std::function<void(double)>& progress_;
    Groups groups_;
    ExportSummary summary_;
    std::string shapes_;
    uint64_t done_ = 0;
};

}  // namespace

Result<ExportSummary> export_to_mitsuba(const BlockFile& file, const std::filesystem::path& directory, const std::function<void(double)>& progress) {
    const BakedScene& scene = file.scene();
    if (!is_centered_perspective(scene.camera) || scene.camera.lens_radius > 0 || !scene.filter.is_the_pixel())
        return Status::failed(file.path().string() + ": only scenes with a pinhole camera and without a pixel filter can be compared");
    return Exporter(file, directory, progress).run();
}

}  // namespace raypager::bench
