// A scene as importers and generators hand it over: light-weight, with meshes that are loaded one at a time when they are baked.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "raypager/abi/light_image.h"
#include "raypager/abi/scene.h"
#include "raypager/abi/texture.h"
#include "raypager/status.hpp"

namespace raypager {

struct Float3 {
    float x = 0, y = 0, z = 0;
    bool operator==(const Float3&) const = default;
};

struct Float2 {
    float x = 0, y = 0;
    bool operator==(const Float2&) const = default;
};

using Triangle = std::array<uint32_t, 3>;

struct TriangleMesh {
    std::vector<Float3> positions;
    std::vector<Triangle> triangles;    // indices into positions; counter-clockwise seen from outside
    std::vector<Float3> normals;        // one per position, or none
    std::vector<uint32_t> colors = {};  // one per position, or none: sRGB, red | green << 8 | blue << 16
    std::vector<Float2> uvs = {};       // one per position, or none: coordinates of textures, u and v
};

// Vertices on their way from a source to a sink.
struct MeshVertices {
    std::span<const Float3> positions, normals;  // as many normals as positions, or none
    std::span<const uint32_t> colors = {};       // likewise; as in TriangleMesh
    std::span<const Float2> uvs = {};            // likewise
};
MeshVertices vertices_of(const TriangleMesh& mesh);  // attributes that do not match the positions in number are left out

// Row-major affine or projective transform on column vectors, in double precision.
struct Transform {
    std::array<std::array<double, 4>, 4> m = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};

    static Transform translate(double x, double y, double z);
    static Transform scale(double x, double y, double z);
    static Transform rotate(double degrees, double x, double y, double z);  // about the axis (x, y, z)
    // World to camera as pbrt defines it: left-handed, looking along +z. Fails if the vectors are degenerate.
    static std::optional<Transform> look_at(const std::array<double, 3>& eye, const std::array<double, 3>& target, const std::array<double, 3>& up);
    Transform operator*(const Transform& other) const;
    std::optional<Transform> inverse() const;  // nothing if singular
    Transform transpose() const;
    std::array<double, 3> point(double x, double y, double z) const;
    std::array<double, 3> vector(double x, double y, double z) const;
    bool swaps_handedness() const;
    bool is_identity() const;
    // Whether lengths are the same in all directions, and angles, too: squares of lengths differ by this share at most. By default up to what six or
    // seven digits leave of a rotation.
    bool is_similarity(double tolerance = 1e-5) const;
};

// Something about a file that its user should know.
struct MeshWarning {
    std::string kind;    // the same for all of a kind, in whatever file
    std::string text;    // of the first that was met; names the file, and the line where there is one
    uint64_t files = 1;  // that have it
};

// What was met and mended while meshes and clouds were read. Counts of triangles or points, unless said otherwise.
struct MeshIssues {
    uint64_t not_finite = 0;                 // used a vertex that is not finite (NaN, Inf): dropped
    uint64_t bad_index = 0;                  // used a vertex that does not exist: dropped
    uint64_t degenerate = 0;                 // no area, or a vertex twice: dropped, no ray can hit them
    uint64_t few_corners = 0;                // faces of one or two corners, or none: dropped
    uint64_t crossed = 0;                    // polygons whose outline crosses itself: cut into a fan from their first corner
    uint64_t duplicate = 0;                  // the same three vertices again: kept
    uint64_t non_manifold_edges = 0;         // edges of more than two triangles: kept
    uint64_t not_compared = 0;               // of meshes too large to look for the last two
    uint64_t bad_uv = 0;                     // vertices whose u or v is not finite, or beyond 2^60: kept, with zeros for both
    uint64_t changed_radius = 0;             // points whose radius is smaller or larger than can be stored: kept, with the nearest that can
    std::vector<MeshWarning> warnings = {};  // one of each kind
    void add(const MeshIssues& other);
    // What is not said by a count. text names the file.
    void warn(std::string kind, std::string text) { add_warning({std::move(kind), std::move(text)}); }
    void add_warning(const MeshWarning& warning);
    bool any() const;              // of the counts
    std::string describe() const;  // the counts: "12 degenerate triangles dropped, ..."
};

// Takes in a mesh piece by piece: all vertices, then the triangles. A status that is not ok ends the stream and is passed on.
// Among the triangles may be some that use vertices that do not exist or are not finite, or that have no area: the sink drops them.
class MeshSink {
public:
    virtual ~MeshSink() = default;
    // Before all else, where the source knows about how many will come.
    virtual Status expect(uint64_t vertices, uint64_t triangles) { return (void)vertices, (void)triangles, Status(); }
    // How much memory a source may take beside, to read much at a time. It may change after each call.
    virtual uint64_t buffer_bytes() const { return 0; }
    // Whether coordinates of textures are of any use. If not, a source may leave them out, and need not split vertices for their sake.
    virtual bool wants_uvs() const { return true; }
    // Which attributes there are is the same in every call.
    virtual Status vertices(const MeshVertices& vertices) = 0;
    virtual Status triangles(std::span<const Triangle> indices) = 0;  // indices into all vertices that came
};

// Something that can put a mesh into memory when asked, or hand it on in pieces. Implementations: a mesh in memory, a file.
// Any number of threads may ask at once.
class MeshSource {
public:
    virtual ~MeshSource() = default;
    // Fills mesh (emptied first). Dropped and suspicious triangles are counted in issues.
    virtual Status load(TriangleMesh& mesh, MeshIssues& issues) const = 0;
    // The same triangles in the same order, but for those that the sink drops, without the whole mesh in memory where the format allows it;
    // by default through load(). issues gets what the source itself drops; nobody looks for duplicates and non-manifold edges.
    virtual Status stream(MeshSink& sink, MeshIssues& issues) const;
    virtual std::string name() const = 0;                          // for messages: the file's path, or "scene.pbrt:12"
    virtual std::vector<std::string> files() const { return {}; }  // that the result depends on
    virtual uint64_t bytes_to_read() const { return 0; }           // about; only speed and room made ahead depend on it
};

class MeshInMemory final : public MeshSource {
public:
    MeshInMemory(std::string name, TriangleMesh mesh) : name_(std::move(name)), mesh_(std::move(mesh)) {}
    Status load(TriangleMesh& mesh, MeshIssues& issues) const override;
    Status stream(MeshSink& sink, MeshIssues& issues) const override;
    std::string name() const override { return name_; }
    const TriangleMesh& mesh() const { return mesh_; }

private:
    std::string name_;
    TriangleMesh mesh_;
};

// A point of a cloud as its file has it.
struct CloudPoint {
    Float3 position;             // object space
    float radius = 0;            // 0: from the spacing of the points around it
    uint32_t color = 0xffffffu;  // sRGB, red | green << 8 | blue << 16
};

// Something that can hand on the points of a cloud piece by piece, in the same order each time.
class PointSource {
public:
    virtual ~PointSource() = default;
    // Points that are not finite are dropped and counted in issues.not_finite. A status that take returns ends the stream and is passed on.
    virtual Status stream(const std::function<Status(std::span<const CloudPoint>)>& take, MeshIssues& issues) const = 0;
    virtual uint64_t count() const = 0;  // what the file declares; at most as many are handed on
    virtual bool has_color() const = 0;
    virtual std::string name() const = 0;
    virtual std::vector<std::string> files() const { return {}; }
    // How the files are to be read, where somebody said so: what tells two readings of one file apart.
    virtual std::string reading() const { return {}; }
};

class PointsInMemory final : public PointSource {
public:
    PointsInMemory(std::string name, std::vector<CloudPoint> points, bool has_color)
        : name_(std::move(name)), points_(std::move(points)), has_color_(has_color) {}
    Status stream(const std::function<Status(std::span<const CloudPoint>)>& take, MeshIssues& issues) const override;
    uint64_t count() const override { return points_.size(); }
    bool has_color() const override { return has_color_; }
    std::string name() const override { return name_; }
    const std::vector<CloudPoint>& points() const { return points_; }

private:
    std::string name_;
    std::vector<CloudPoint> points_;
    bool has_color_;
};

struct SpherePrimitive {
    Float3 center;  // object space
    float radius = 1;
};

struct AreaLight {
    Float3 radiance;
    bool two_sided = false;
    // If more than 0, each triangle or sphere emits so much, and radiance is its colour: what it would be if it emitted pi times its area.
    float power = 0;
};

// One mesh, cloud or sphere, placed in the world.
struct Shape {
    std::string name;  // for messages
    Transform to_world;
    bool reverse_orientation = false;
    uint32_t material = 0;                      // index into Scene::materials
    std::optional<uint32_t> area_light;         // index into Scene::area_lights
    bool unseen = false;                        // shines, but no ray meets it; of a cloud: must be false
    std::shared_ptr<const MeshSource> mesh;     // or, if null:
    std::shared_ptr<const PointSource> points;  // or, if null:
    SpherePrimitive sphere;
    // The colours of its vertices, where the mesh has them, are the reflectance of its material, if that is diffuse.
    bool vertex_colors = true;
    // Of a cloud: one radius for all points, in the world; 0: each point's own, or from the spacing around it, times radius_scale.
    float point_radius = 0, radius_scale = 1;
    // Of a mesh: coordinates of textures are baked even if its own material has no use for them. So they are for materials that instances put there.
    bool keep_uvs = false;
    bool backdrop = false;  // such as the ground under a bare mesh: not what the scene shows, so its bounds do not count. Comes after all that is.
};

// Where an object is put: rows of an affine transform from its space to the world, or to that of the object that places it.
struct Placement {
    uint32_t object = 0;  // index into Scene::objects
    std::array<std::array<double, 4>, 3> to_world = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    // Index into Scene::materials: in place of those of all shapes of the object. RP_NONE: they keep theirs. Colours of points and of vertices stay.
    uint32_t material = RP_NONE;
    // From 0 to 1, linear: diffuse reflectances and transmittances are multiplied by it, those of textures, points and vertices, too. What is
    // mirrored or refracted stays as it is.
    Float3 color{1, 1, 1};
    bool operator==(const Placement&) const = default;
};

// A material that a placement puts in place of those of its object.
struct ObjectMaterial {
    uint32_t object = 0, material = 0;
    auto operator<=>(const ObjectMaterial&) const = default;
};

// Something that can hand on placements piece by piece, in the same order each time.
class InstanceSource {
public:
    virtual ~InstanceSource() = default;
    // A status that take returns ends the stream and is passed on.
    virtual Status stream(const std::function<Status(std::span<const Placement>)>& take) const = 0;
    virtual uint64_t count() const = 0;
    virtual std::string name() const = 0;  // for messages
    // Tells whether they are still those of which a scene was baked.
    virtual uint64_t fingerprint() const = 0;
    // All that its placements have, each once: known before the objects are baked, which may have to keep more for their sake.
    virtual std::vector<ObjectMaterial> materials() const { return {}; }
};

class InstancesInMemory final : public InstanceSource {
public:
    InstancesInMemory(std::string name, std::vector<Placement> placements);
    Status stream(const std::function<Status(std::span<const Placement>)>& take) const override { return take(placements_); }
    uint64_t count() const override { return placements_.size(); }
    std::string name() const override { return name_; }
    uint64_t fingerprint() const override;
    std::vector<ObjectMaterial> materials() const override { return materials_; }

private:
    std::string name_;
    std::vector<Placement> placements_;
    std::vector<ObjectMaterial> materials_;
};

// Shapes that are placed in the world by instances, as often as these say. Their to_world leads to the object's own space. None of them is a
// backdrop. Those that shine do so in every place, with the radiance or, at its size there, the power of their area light. The lights of all
// instances are in memory and on the device one by one; there can be 2^24 of them. An instance must not stretch a sphere that shines, or points that
// do. An object may also place objects that come before it in Scene::objects: a tree its leaves, a forest its trees. Baking
// flattens nested instances that add little memory, are more than four levels deep, or shine. Instances must not give a material or a colour to
// objects that are placed by objects, or that place others.
struct Object {
    std::string name;  // for messages
    std::vector<Shape> shapes;
    std::vector<std::shared_ptr<const InstanceSource>> instances = {};  // to_world of these leads to the object's own space
};

// How the places of a picture become rays. (x, y) of a picture, from (-1, -1) at the bottom left to (1, 1) at the top right:
//   perspective      rays leave the eye towards eye + forward + x right + y up
//   orthographic     rays leave eye + x right + y up, all of them along forward
//   equirectangular  rays leave the eye in all directions: from left to right a whole turn about up, from right by way of forward; from top to bottom
//                    from up to down
//   equal_area       the same by the octahedral map of Clarberg (2008), in which equal areas are equal solid angles; forward, right and up are as
//   above
// The values are those of abi/scene.h.
enum class Projection : uint32_t { perspective, orthographic, equirectangular, equal_area };

struct Camera {
    Float3 eye{0, 0, 0};
    Float3 right{1, 0, 0}, up{0, 1, 0};  // half the image's width and height at distance |forward|; of cameras that see all around: unit vectors
    Float3 forward{0, 0, 1};
    Projection projection = Projection::perspective;
    // A thin lens around the place where a ray would begin, in the plane of right and up; 0: none, all is in focus. What lies in the plane through
    // eye + focal_distance forward, parallel to the picture, is in focus. Not for cameras that see all around.
    float lens_radius = 0;     // in the world
    float focal_distance = 1;  // in lengths of forward
    // Of cameras that see all around: the part of the whole that is the picture, left, top, width and height as shares of it.
    std::array<float, 4> window = {0, 0, 1, 1};
    bool sees_all_around() const { return projection >= Projection::equirectangular; }
    bool operator==(const Camera&) const = default;
};

// A pinhole camera at eye. fov_degrees spans the shorter side of a width x height image.
// right_handed: +x of the image is forward x up (as in the real world); otherwise up x forward (pbrt's left-handed space).
std::optional<Camera> make_camera(const Float3& eye, const Float3& target, const Float3& up, double fov_degrees, uint32_t width, uint32_t height,
                                  bool right_handed = true);

// A camera for a picture of another shape: the field of view of the shorter side stays, pixels are square. One that sees all around stays as it is.
Camera fit_camera(Camera camera, uint32_t old_width, uint32_t old_height, uint32_t width, uint32_t height);

// The same as make_camera with a direction that is not rounded to floats on its way from a text.
std::optional<Camera> make_exact_camera(const Float3& eye, const std::array<double, 3>& target, const std::array<double, 3>& up, double fov_degrees,
                                        uint32_t width, uint32_t height, bool right_handed);

// Whether a camera is an upright pinhole, or lens, whose line of sight goes through the middle of its picture: what camera texts and other renderers
// can describe.
bool is_centered_perspective(const Camera& camera);

// What a film makes of the radiance that comes to it. Without a word: radiance as it is.
struct FilmResponse {
    static constexpr float no_limit = std::numeric_limits<float>::infinity();
    float exposure = 1;                                               // the picture is radiance times this ...
    std::array<float, 9> color_matrix = {1, 0, 0, 0, 1, 0, 0, 0, 1};  // ... times this, row by row, on linear sRGB
    // A sample whose luminance, or the largest of whose CIE XYZ components, is above these is scaled down to them, before the exposure.
    float max_luminance = no_limit, max_xyz = no_limit;
    bool operator==(const FilmResponse&) const = default;
};

// How much light counts for a pixel by where it falls, x and y being how far from the pixel's middle it does, in pixels: the product of a
// function of x and one of y, each 0 beyond its radius. Positions are drawn with this density, so that all samples count the same.
//   box       1
//   triangle  1 - |x| / radius
//   gaussian  exp(-first x^2) - exp(-first radius^2)
//   mitchell  the cubic of Mitchell and Netravali with B = first and C = second, over the radius; where it is negative, 0
//   sinc      its main lobe, |x| < 1, times that of a window: sinc(x) sinc(x / first)
// The sums of a film have no sign and all samples have one weight, so that renders can be stopped and go on at any sample: what a filter takes away
// cannot be told.
struct PixelFilter {
    enum class Kind : uint32_t { box, triangle, gaussian, mitchell, sinc };
    Kind kind = Kind::box;
    float radius_x = 0.5f, radius_y = 0.5f;  // pixels
    float first = 0, second = 0;
    bool is_the_pixel() const { return kind == Kind::box && radius_x == 0.5f && radius_y == 0.5f; }  // what is seen through it, and no more
    bool operator==(const PixelFilter&) const = default;
};
// What lights shine as or through (abi/light_image.h); raypager/sky.hpp makes one.
struct LightImage {
    uint32_t width = 0, height = 0;
    std::vector<rp_texel> texels;  // rows from top to bottom
};
using LightImages = std::vector<std::shared_ptr<const LightImage>>;

enum class TexelKind { unsigned_8, unsigned_16, half };
constexpr uint64_t bytes_of_channel(TexelKind kind) { return kind == TexelKind::unsigned_8 ? 1 : 2; }

struct ImageShape {
    uint32_t width = 0, height = 0;  // texels
    uint32_t channels = 1;           // 1: grey; 4: red, green, blue, alpha
    TexelKind kind = TexelKind::unsigned_8;
    bool srgb = false;       // channels other than alpha are encoded as sRGB (unsigned_8 only)
    bool has_alpha = false;  // else that of four channels is 1
};

// An image that textures read: opened while the scene is baked, and read once, a few rows at a time.
class ImageSource {
public:
    virtual ~ImageSource() = default;
    virtual std::string name() const = 0;  // for messages
    virtual Result<ImageShape> shape() const = 0;
    // Hands over all rows from top to bottom, some at a time, channels of a texel side by side; ends at the first status that is not ok.
    virtual Status read(const std::function<Status(std::span<const std::byte> rows)>& take) const = 0;
    // Tells whether the image is still what it was when a scene was baked from it: from the size and time of its file, say.
    virtual Result<uint64_t> fingerprint() const = 0;
};

// What the numbers in a file stand for, alpha aside. automatic: 8 and 16 bits sRGB, others are linear, unless the file says otherwise.
struct ImageEncoding {
    enum class Kind { automatic, linear, srgb, gamma };
    Kind kind = Kind::automatic;
    float gamma = 1;
    bool operator==(const ImageEncoding&) const = default;
};

struct Scene {
    Camera camera;
    FilmResponse film;
    PixelFilter filter;
    uint32_t width = 1280, height = 720;  // of the picture, where no option says otherwise
    uint32_t spp = 64;
    uint32_t max_depth = 5;  // scattering events of a path; 0: only what the camera sees shine
    std::vector<rp_material> materials;
    std::vector<AreaLight> area_lights;
    // Infinite (at most one), distant, point, spot and projection lights, and triangles and spheres that are RP_LIGHT_UNSEEN. probability is filled
    // in when baked.
    std::vector<rp_light> lights;
    LightImages light_images;  // none is null
    // What programs of materials (RP_MATERIAL_PROGRAM_SHIFT) are made of.
    std::vector<std::shared_ptr<const ImageSource>> images;  // none is null
    std::vector<rp_texture_op> texture_ops;
    std::vector<rp_texture_map> texture_maps;
    std::vector<Shape> shapes;                                     // primitives are numbered through in this order
    std::vector<Object> objects;                                   // behind them their primitives, object by object
    std::vector<std::shared_ptr<const InstanceSource>> instances;  // of objects; numbered through in this order. None is null
    std::vector<std::string> files;                                // the scene file and what it includes, meshes excepted
    std::vector<std::string> warnings;                             // one line each, with file:line where there is one
};

// Checks indices, finiteness and ranges. Importers and generators call it last.
Status validate(const Scene& scene);

}  // namespace raypager
