// Scene and mesh files that are truncated, flipped, empty, absent or something else. Each ends in one line that names the file, or in a
// mesh whose every index and vertex is sound; never in a crash, and never with memory out of proportion to the file. Run under
// AddressSanitizer and UndefinedBehaviorSanitizer, this says more than it does alone.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <functional>
#include <random>

#include "base/files.hpp"
#include "raypager/import.hpp"
#include "raypager/picture.hpp"
#include "support/temporary_folder.hpp"
#include "unit/cloud_files.hpp"
#include "unit/gltf_files.hpp"
#include "unit/import_files.hpp"

namespace raypager {
namespace {

using support::TemporaryFolder;

struct Input {
    std::string file, content;
    bool checks_length = true;  // any truncation is refused or warned of: the format says how much there must be
};

std::string pbrt_scene() {
    return R"(# a scene of everything
Film "rgb" "integer xresolution" [64] "integer yresolution" [48]
LookAt 0 1 -5  0 0 0  0 1 0
Camera "perspective" "float fov" [ 40 ]
Sampler "independent" "integer pixelsamples" 4
Integrator "path" "integer maxdepth" 3
WorldBegin
MakeNamedMaterial "m" "string type" "dielectric" "float eta" 1.5
LightSource "infinite" "rgb L" [ .1 .2 .3 ]
AttributeBegin
    AreaLightSource "diffuse" "rgb L" [ 5 5 5 ] "bool twosided" true
    Translate 0 3 0  Rotate 30 1 0 0  Scale 1 2 1
    Shape "disk" "float radius" 2
AttributeEnd
ObjectBegin "o"
    NamedMaterial "m"
    Shape "sphere" "float radius" .5
ObjectEnd
TransformBegin
    ConcatTransform [ 1 0 0 0 0 1 0 0 0 0 1 0 2 0 0 1 ]
    ObjectInstance "o"
TransformEnd
Material "conductor" "spectrum eta" "metal-Cu-eta" "float roughness" .1
Shape "trianglemesh" "point3 P" [ 0 0 0 1 0 0 0 1 0 1 1 0 ] "integer indices" [ 0 1 2 1 3 2 ] "normal N" [ 0 0 1 0 0 1 0 0 1 0 0 1 ]
)";
}

std::string glb_scene() {
    const test::GltfSquare square;
    return square.file.glb(square.scene(",\"material\":0", ",\"scale\":[1,-2,1]", ",\"materials\":[{\"emissiveFactor\":[1,1,1]}]"));
}

// With its buffer in the text.
std::string gltf_scene() {
    const test::GltfSquare square;
    return square.file.json(square.scene(), test::to_data_uri(square.file.bytes()));
}

test::LasFile las_with_other_records() {
    test::LasFile file = test::make_las(4, 7);
    file.variable_records = test::las_variable_record("LASF_Projection", 2112, "somewhere") + test::las_variable_record("me", 1, "");
    file.variable_record_count = 2;
    file.extended_records = std::string(100, 'e');
    return file;
}

std::string lines_of_points(size_t columns) {
    std::string text;
    for (const Float3& p : test::some_points()) {
        text += test::to_text(p);
        for (size_t i = 3; i < columns; ++i) text += " " + std::to_string(40 * i);
        text += '\n';
    }
    return text;
}

std::vector<Input> inputs() {
    const TriangleMesh box = test::make_box();
    return {
        {"scene.pbrt", pbrt_scene(), false},
        {"little.ply", test::to_ply_binary(box), true},
        {"big.ply", test::to_ply_binary(box, true), true},
        {"text.ply", test::to_ply_text(box), true},
        {"scene.gltf", gltf_scene(), false},  // an end that is missing may be blanks
        {"scene.glb", glb_scene(), true},
        {"mesh.obj", test::to_obj(box), false},
        {"mesh.off", test::to_off(box), true},
        {"text.stl", test::to_stl_text(box), true},
        {"binary.stl", test::to_stl_binary(box), true},
        {"old.las", test::to_las(test::make_las(2, 3)), true},
        {"new.las", test::to_las(las_with_other_records()), false},  // what is behind the points is not needed
        {"points_little.ply", test::to_point_ply(test::some_points(), "binary_little_endian"), true},
        {"points_big.ply", test::to_point_ply(test::some_points(), "binary_big_endian"), true},
        {"points_text.ply", test::to_point_ply(test::some_points(), "ascii"), true},
        {"points.xyz", lines_of_points(7), false},  // nothing says how many there must be
        {"points.pts", "40\n" + lines_of_points(6), true},
    };
}

Status stream_points(const PointSource& source) {
    uint64_t count = 0;
    MeshIssues issues;
    RAYPAGER_TRY(source.stream(
        [&](std::span<const CloudPoint> points) {
            count += points.size();
            for (const CloudPoint& p : points) {
                if (!std::isfinite(p.position.x) || !std::isfinite(p.position.y) || !std::isfinite(p.position.z)) ADD_FAILURE() << "not finite";
                if (!(p.radius >= 0) || !std::isfinite(p.radius)) ADD_FAILURE() << "radius " << p.radius;
            }
            return Status();
        },
        issues));
    if (count + issues.not_finite > source.count()) ADD_FAILURE() << count << " of " << source.count() << " points";
    return {};
}

// Imports the file, and loads every mesh and every point of the scene. Whatever comes of it must be sound. warnings: how many there are of meshes.
Status import_and_load(const std::filesystem::path& path, size_t* warnings = nullptr) {
    auto scene = import_scene({path});
    if (!scene) return scene.status();
    for (const Shape& shape : scene->shapes) {
        if (shape.points) RAYPAGER_TRY(stream_points(*shape.points));
        if (!shape.mesh) continue;
        TriangleMesh mesh;
        MeshIssues issues;
        RAYPAGER_TRY(shape.mesh->load(mesh, issues));
        if (warnings) *warnings += issues.warnings.size();
        for (const Triangle& t : mesh.triangles)
            for (const uint32_t i : t) {
                if (i >= mesh.positions.size())
                    ADD_FAILURE() << "vertex " << i << " of " << mesh.positions.size();
                else if (const Float3& p = mesh.positions[i]; !std::isfinite(p.x + p.y + p.z) && std::abs(p.x) < 1e38f)
                    ADD_FAILURE() << "not finite";
            }
    }
    return {};
}

void expect_one_line_naming(const std::filesystem::path& path, const Status& status) {
    ASSERT_FALSE(status.ok());
    EXPECT_NE(status.message().find(path.string()), std::string::npos) << status.message();
    // Names in files may be UTF-8.
    for (const char c : status.message()) EXPECT_TRUE((c >= ' ' && c <= '~') || (c & 0x80)) << "unprintable: " << status.message();
    EXPECT_LT(status.message().size(), 600u);
    EXPECT_EQ(status.exit_code(), 1);
}

class DamagedInputs : public testing::TestWithParam<size_t> {
protected:
    DamagedInputs() : input_(inputs()[GetParam()]) {}
    void expect_error(const std::string& content) {
        const auto path = folder_.write(input_.file, content);
        expect_one_line_naming(path, import_and_load(path));
    }
    void expect_error_or_warning(const std::string& content) {
        const auto path = folder_.write(input_.file, content);
        size_t warnings = 0;
        const Status status = import_and_load(path, &warnings);
        if (warnings == 0) expect_one_line_naming(path, status);
    }
    void expect_error_or_sound(const std::string& content) {
        const auto path = folder_.write(input_.file, content);
        const Status status = import_and_load(path);
        if (!status.ok()) expect_one_line_naming(path, status);
    }
    Input input_;
    TemporaryFolder folder_;
};

TEST_P(DamagedInputs, TheSoundFileIsRead) {
    const Status status = import_and_load(folder_.write(input_.file, input_.content));
    EXPECT_TRUE(status.ok()) << status.message();
}

TEST_P(DamagedInputs, Truncated) {
    // A number or a line end that is cut off at the very end of a text cannot be missed.
    const size_t spare = input_.content.find('\0') != std::string::npos ? 0 : 8;
    for (size_t size = 0; size < input_.content.size(); size += 1 + size / 97) {
        SCOPED_TRACE("cut to " + std::to_string(size) + " of " + std::to_string(input_.content.size()) + " bytes");
        if (input_.checks_length && size + spare < input_.content.size())
            expect_error_or_warning(input_.content.substr(0, size));
        else
            expect_error_or_sound(input_.content.substr(0, size));
    }
}

TEST_P(DamagedInputs, BitsFlipped) {
    const unsigned seed = 20240517 + static_cast<unsigned>(GetParam());
    std::mt19937 random(seed);
    for (int trial = 0; trial < 1500; ++trial) {
        SCOPED_TRACE("seed " + std::to_string(seed) + " trial " + std::to_string(trial));
        std::string content = input_.content;
        const int flips = 1 << (trial % 6);
        for (int i = 0; i < flips; ++i) content[random() % content.size()] ^= static_cast<char>(1u << random() % 8);
        expect_error_or_sound(content);
    }
}

TEST_P(DamagedInputs, PiecesMovedAndRepeated) {
    const unsigned seed = 77 + static_cast<unsigned>(GetParam());
    std::mt19937 random(seed);
    for (int trial = 0; trial < 500; ++trial) {
        SCOPED_TRACE("seed " + std::to_string(seed) + " trial " + std::to_string(trial));
        std::string content = input_.content;
        const size_t from = random() % content.size(), count = 1 + random() % 60, to = random() % content.size();
        const std::string piece = content.substr(from, count);
        if (trial % 2) content.erase(from, count);
        content.insert(std::min(to, content.size()), piece);
        expect_error_or_sound(content);
    }
}

TEST_P(DamagedInputs, EmptyAbsentOrAFolder) {
    expect_error("");
    const auto absent = folder_ / ("absent-" + input_.file);
    expect_one_line_naming(absent, import_and_load(absent));
    const auto directory = folder_ / ("folder-" + input_.file);
    std::filesystem::create_directory(directory);
    expect_one_line_naming(directory, import_and_load(directory));
}

TEST_P(DamagedInputs, OfAnotherKind) {
    std::mt19937 random(5);
    std::string noise(5000, '\0'), zeros(5000, '\0');
    for (char& c : noise) c = static_cast<char>(random());
    expect_error("\x89PNG\r\n\x1a\n" + noise);
    expect_error(noise);
    expect_error(zeros);
    expect_error("solid as a rock, and about as readable\n");
    expect_error("<html><body>404 Not Found</body></html>\n");
    for (const Input& other : inputs()) {
        SCOPED_TRACE(other.file);
        const auto ending = [](const std::string& file) { return std::filesystem::path(file).extension(); };
        // Both are lines of numbers; the one that starts with a count passes for the other.
        const bool both_lines = ending(input_.file) == ".xyz" && ending(other.file) == ".pts";
        const bool lines_for_pts = ending(input_.file) == ".pts" && ending(other.file) == ".xyz";
        const auto is_gltf = [&](const std::string& file) { return ending(file) == ".gltf" || ending(file) == ".glb"; };
        const bool both_gltf = is_gltf(input_.file) && is_gltf(other.file);  // which of the two it is says the file itself
        if (ending(other.file) != ending(input_.file) && !both_lines && !lines_for_pts && !both_gltf) expect_error(other.content);
    }
}

std::string parameter_name(const testing::TestParamInfo<size_t>& info) {
    std::string name = inputs()[info.param].file;
    name[name.find('.')] = '_';
    return name;
}
INSTANTIATE_TEST_SUITE_P(Formats, DamagedInputs, testing::Range<size_t>(0, inputs().size()), parameter_name);

// Bytes of memory that this process has asked for at most so far.
uint64_t peak_memory() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return static_cast<uint64_t>(usage.ru_maxrss) * 1024;
}

// Small files that claim to be huge are refused for what they are, not believed.
TEST(DamagedInputs, HugeClaimsTakeNoMemory) {
    const std::string face = "\nproperty list uchar int vertex_indices\nend_header\n";
    const std::string vertex = "\nproperty float x\nproperty float y\nproperty float z\nelement face ";
    std::vector<Input> claims;
    for (const char* encoding : {"ascii", "binary_little_endian", "binary_big_endian"}) {
        const std::string start = std::string("ply\nformat ") + encoding + " 1.0\nelement vertex ";
        const std::string name = std::string(encoding) + ".ply";
        claims.push_back({name, start + "4000000000" + vertex + "1" + face});
        claims.push_back({name, start + "3" + vertex + "4000000000" + face + std::string(36, '\0')});
        claims.push_back({name, start + "18446744073709551615" + vertex + "1" + face});
        // A list of 2^32 - 1 values.
        const std::string list = "\nproperty list uint int vertex_indices\nend_header\n";
        claims.push_back({name, start + "3" + vertex + "1" + list +
                                    (encoding[0] == 'a' ? "0 0 0\n1 0 0\n0 1 0\n4294967295 0 1 2\n"
                                                        : std::string(36, '\0') + std::string(4, '\xff') + std::string(12, '\0'))});
        // An element without properties costs nothing to repeat.
        claims.push_back({name, std::string("ply\nformat ") + encoding + " 1.0\nelement nothing 4000000000\nelement vertex 3" + vertex + "1" + face});
    }
    claims.push_back({"a.off", "OFF\n2000000000 2000000000 0\n0 0 0\n"});
    claims.push_back({"b.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4294967295 0 1 2\n"});
    claims.push_back({"a.stl", std::string(80, ' ') + "\xff\xff\xff\xff" + std::string(50, '\0')});
    test::LasFile las = test::make_las(4, 7);
    las.legacy_count = las.wide_count = false;
    std::string huge = test::to_las(las);
    claims.push_back({"a.las", huge.replace(247, 8, test::bytes_of(uint64_t{1} << 60))});
    claims.push_back({"b.las", huge.replace(247, 8, std::string(8, '\xff'))});
    claims.push_back({"c.las", test::to_las(test::make_las(2, 3)).replace(107, 4, std::string(4, '\xff'))});
    claims.push_back({"d.las", test::to_las(test::make_las(2, 3)).replace(100, 4, std::string(4, '\xff'))});
    claims.push_back({"a.pts", "18446744073709551615\n1 2 3\n"});
    claims.push_back({"b.ply", "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000" + vertex + "0" + face});
    claims.push_back({"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 999999999999999999999 2 x\n"});
    claims.push_back({"b.obj", "mtllib /dev/zero\n" + std::string(100, 'v')});
    test::GltfWriter zeros;
    claims.push_back({"a.gltf", zeros.json(test::gltf_scene_of(zeros.accessor("\"componentType\":5126,\"type\":\"VEC3\",\"count\":4000000000")))});
    claims.push_back({"b.gltf", R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":4000000000000}]})"});
    claims.push_back({"c.gltf", R"({"asset":{"version":"2.0"},"buffers":[{"uri":"/dev/zero","byteLength":4000000000000}]})"});
    claims.push_back({"d.gltf", R"({"asset":{"version":"2.0"},"a":)" + std::string(1000000, '[')});
    claims.push_back({"e.glb", "glTF" + test::bytes_of(uint32_t{2}) + std::string(8, '\xff') + "JSON{}"});
    claims.push_back({"a.pbrt", "Film \"rgb\" \"integer xresolution\" 4294967296"});
    claims.push_back({"b.pbrt", "WorldBegin Shape \"trianglemesh\" \"point3 P\" [0 0 0] \"integer indices\" [4294967296 1e300 -5"});

    const TemporaryFolder folder;
    const uint64_t before = peak_memory();
    for (const Input& claim : claims) {
        SCOPED_TRACE(claim.file + ": " + claim.content.substr(0, 100));
        const auto path = folder.write(claim.file, claim.content);
        // What the size of a LAS file bears out is believed.
        if (claim.file == "b.las" || claim.file == "c.las" || claim.file == "d.las")
            EXPECT_TRUE(import_and_load(path).ok());
        else
            expect_one_line_naming(path, import_and_load(path));
    }
    // Room for read buffers and the C++ library, far from the gigabytes that are claimed.
    EXPECT_LT(peak_memory() - before, uint64_t{128} << 20);
}

// A few words in a pbrt file that ask for meshes of thousands of triangles, a million times over.
TEST(DamagedInputs, EllipsoidsWithoutEndTakeNoMemory) {
    std::string text = "WorldBegin\nObjectBegin \"o\" AreaLightSource \"diffuse\"\n";
    for (int i = 1; i <= 500; i++) text += "Shape \"sphere\" \"float radius\" " + std::to_string(i) + "\n";
    text += "ObjectEnd Scale 1 2 1\n";  // spheres that shine, and that instances stretch, are copied
    for (int i = 0; i < 100; i++) text += "Scale 1 1.5 1 ObjectInstance \"o\"\n";
    const TemporaryFolder folder;
    const uint64_t before = peak_memory();
    const auto scene = import_scene({folder.write("a.pbrt", text)});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    EXPECT_EQ(scene->shapes.size(), 50000u);
    // Some three hundred bytes a shape; a mesh of its own would be two megabytes.
    EXPECT_LT(peak_memory() - before, uint64_t{64} << 20);
}

// Half a million instances, in a few lines.
TEST(DamagedInputs, InstancesWithoutEndTakeLittleMemory) {
    std::string lines;
    for (int i = 0; i < 1000; i++) lines += "Translate 1 0 0 ObjectInstance \"o\"\n";
    std::string text = "WorldBegin\nObjectBegin \"o\" Shape \"sphere\" Shape \"sphere\" ObjectEnd\n";
    for (int i = 0; i < 500; i++) text += "Include \"lines.pbrt\"\n";
    const TemporaryFolder folder;
    folder.write("lines.pbrt", lines);
    const uint64_t before = peak_memory();
    const auto scene = import_scene({folder.write("a.pbrt", text)});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    ASSERT_EQ(scene->instances.size(), 1u);
    EXPECT_EQ(scene->instances[0]->count(), 500'000u);
    // About a hundred bytes each, and half as much again while their list grows; a shape has some three hundred.
    EXPECT_LT(peak_memory() - before, uint64_t{100} << 20);
}

// Files that include each other: in a circle, deeper than any scene, and twice each, which doubles with every file.
TEST(DamagedInputs, IncludesWithoutEnd) {
    const TemporaryFolder folder;
    folder.write("a.pbrt", "Include \"b.pbrt\"");
    folder.write("b.pbrt", "Import \"a.pbrt\"");
    std::filesystem::create_symlink("a.pbrt", folder / "link.pbrt");
    folder.write("c.pbrt", "Include \"link.pbrt\"");
    for (int i = 0; i < 40; i++) {
        folder.write("deep" + std::to_string(i) + ".pbrt", "Include \"deep" + std::to_string(i + 1) + ".pbrt\"");
        const std::string next = i < 25 ? "Include \"twice" + std::to_string(i + 1) + ".pbrt\"\n" : "WorldBegin\n";
        folder.write("twice" + std::to_string(i) + ".pbrt", next + next);
    }
    std::string last;
    for (const char* name : {"a.pbrt", "c.pbrt", "deep0.pbrt", "twice0.pbrt"}) {
        const Status status = import_scene({folder / name}).status();
        EXPECT_FALSE(status.ok()) << name;
        EXPECT_EQ(status.message().find('\n'), std::string::npos);
        EXPECT_LT(status.message().size(), 1000u) << status.message();
        last = status.message();
    }
    EXPECT_NE(last.find("files are included"), std::string::npos) << last;
}

// A polygon of very many corners is cut into as many triangles, in time that grows no faster.
TEST(DamagedInputs, HugePolygonsTakeLinearTime) {
    const TemporaryFolder folder;
    constexpr uint32_t corners = 200000;
    std::string points, obj, face;
    for (uint32_t i = 0; i < corners; ++i) points += std::to_string(std::cos(i * 1e-5)) + " " + std::to_string(i) + " 0\n";
    for (uint32_t i = 0; i < corners; ++i) {
        obj += "v 0 " + std::to_string(i % 1000) + " " + std::to_string(i * i % 77) + "\n";
        face += " " + std::to_string(i);
    }
    obj += "f" + face.substr(2) + "\n";
    EXPECT_TRUE(import_and_load(folder.write("a.obj", obj)).ok());
    const std::string off = "OFF\n" + std::to_string(corners) + " 1 0\n" + points + std::to_string(corners) + face + "\n";
    EXPECT_TRUE(import_and_load(folder.write("a.off", off)).ok());
}

// Images of skies: cut off they are refused, by the line that names them; with flipped bits there is a sound scene or one clear line.
TEST(DamagedInputs, ImagesOfSkies) {
    const TemporaryFolder folder;
    ASSERT_TRUE(write_image(folder / "sky.pfm", {8, 8, 3, std::vector<float>(192, 0.5f)}).ok());
    const std::string whole = *read_text(folder / "sky.pfm");
    const auto scene = folder.write("scene.pbrt", "WorldBegin\nLightSource \"infinite\" \"string filename\" \"sky.pfm\"\nShape \"sphere\"\n");
    const auto import_damaged = [&](const std::string& bytes) {
        folder.write("sky.pfm", bytes);
        auto imported = import_scene({scene});
        if (!imported.ok()) {
            const std::string& message = imported.status().message();
            EXPECT_NE(message.find("scene.pbrt:2"), std::string::npos) << message;
            EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        }
        return imported.ok();
    };
    EXPECT_TRUE(import_damaged(whole));
    for (size_t length = 0; length < whole.size(); length += 13) EXPECT_FALSE(import_damaged(whole.substr(0, length))) << length;
    std::mt19937 random(11);
    for (int i = 0; i < 200; i++) {
        std::string damaged = whole;
        damaged[random() % (i % 2 ? damaged.size() : 16)] ^= static_cast<char>(1 << random() % 8);
        import_damaged(damaged);
    }
    EXPECT_FALSE(import_damaged("PF\n60000 60000\n-1\n...."));
    EXPECT_FALSE(import_damaged("PF\n16000 16000\n-1\n...."));
}

}  // namespace
}  // namespace raypager
