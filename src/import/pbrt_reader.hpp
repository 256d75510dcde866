// Interprets a pbrt scene file (version 4 syntax, tolerant of version 3's names): keeps the graphics state as the directives change
// it, and adds what they describe to a scene. One member function a directive; they are spread over the pbrt_*.cpp files by subject.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "import/cloud_file.hpp"
#include "import/curves.hpp"
#include "import/mesh_file.hpp"
#include "import/pbrt_parameters.hpp"
#include "import/pbrt_textures.hpp"
#include "import/pbrt_tokens.hpp"
#include "import/pbrt_warnings.hpp"
#include "import/placement_store.hpp"
#include "raypager/picture.hpp"
#include "raypager/scene.hpp"

namespace raypager {

class PbrtReader {
public:
    // columns: of text clouds whose shapes do not name theirs; empty: the files tell.
    // placements_in_memory: of objects; more than these go to a scratch file.
    explicit PbrtReader(PointColumns columns = {}, size_t placements_in_memory = PlacementStore::usually_in_memory)
        : placements_(std::make_shared<PlacementStore>(placements_in_memory)), columns_(std::move(columns)) {}
    Result<Scene> read(const std::filesystem::path& path);

private:
    struct Directive {
        std::string name;
        PbrtLocation location;
    };
    using Handler = Status (PbrtReader::*)(const Directive&);
    struct GraphicsState {
        Transform transform;    // object to world; before Camera: world to camera
        uint32_t material = 0;  // or no_surface
        std::optional<uint32_t> area_light;
        bool reverse_orientation = false;
    };
    enum class Scope { attribute, transform, object };
    struct SavedState {
        GraphicsState state;
        Scope scope;
        PbrtLocation location;                           // of the Begin
        bool holds_rest = true, holds_transform = true;  // what has not been brought back yet
    };
    struct OpenFile {
        std::filesystem::path path, canonical;
    };
    struct CameraSettings {
        Transform camera_to_world;
        double fov = 90, shutter_seconds = 1;
        Projection projection = Projection::perspective;
        std::optional<double> frame_aspect;
        std::optional<std::array<double, 4>> screen_window;  // left, right, bottom, top
        double lens_radius = 0, focal_distance = 1e6;
        PbrtLocation location;
    };
    struct FilmSettings {
        double iso = 100, scale = 1, white_balance = 0;  // 0: none
        std::optional<double> exposure_time, imaging_ratio;
        double max_component = FilmResponse::no_limit, max_luminance = FilmResponse::no_limit;
        PbrtLocation location;
    };
    // Pixels of the whole film that are the picture.
    struct Crop {
        uint32_t left = 0, right = 0, top = 0, bottom = 0;
    };
    // Not known before all is read: which version's defaults count.
    struct FilterSettings {
        std::string type;
        std::optional<double> x_radius, y_radius, alpha, sigma;
        double b = 1.0 / 3, c = 1.0 / 3, tau = 3;
        PbrtLocation location;
    };
    static constexpr uint32_t no_surface = RP_NONE;  // rays pass: pbrt's "interface" material
    // From here on, single precision is coarser than 8 mm if the unit is the metre.
    static constexpr double far_coordinate = 65536;
    struct PbrtObject {
        std::string name;
        std::vector<Shape> shapes;                   // their to_world is that of the object's definition
        std::shared_ptr<PlacementStore> placements;  // of instances in it, or null
        std::set<uint32_t> places;                   // objects that these are of
        uint64_t instances = 0;                      // in the world, or in objects
        bool nested = false, in_world = false;       // where they are
        bool may_be_instanced = true;                // else each instance is written out at once
        bool stretches_a_light = false;              // an instance does: all are written out in the end
        uint32_t number = RP_NONE;                   // in the scene, if it is an object there
        std::array<double, 3> origin = {};           // of that one's space
    };

    // pbrt_reader.cpp: files, directives, state.
    static const std::unordered_map<std::string_view, Handler>& handlers();
    struct IncludedFile {
        std::filesystem::path path, canonical;  // the latter empty if there is no such file
        std::optional<std::string> text;        // of small files, which may be included very often
    };
    Status read_file(const std::filesystem::path& path, const std::filesystem::path& canonical, std::string text);
    Status find_include(const Directive& directive, const std::string& name, IncludedFile*& file);
    Status read_directives();
    Status skip_unsupported(const Directive& directive);
    Status take_string(std::string& text);
    Status take_numbers(size_t count, double* numbers);
    Status read_to_the_end(const std::filesystem::path& path);
    PbrtParameters no_parameters() { return PbrtParameters(textures_, warnings_); }
    Status take_type_and_parameters(std::string& type, PbrtParameters& parameters);
    Status error(const Directive& directive, const std::string& what) const;
    void warn(const PbrtLocation& location, const std::string& text) { warnings_.add(location, text); }
    // Warns of each of these parameters that is present, saying what is done instead.
    void warn_if_present(const PbrtParameters& parameters, std::initializer_list<std::string_view> names, const char* instead);
    // Warns of the first parameter that nothing was made of, harmless ones apart.
    void warn_of_unused(const Directive& directive, const std::string& type, const PbrtParameters& parameters,
                        std::initializer_list<std::string_view> harmless);
    // Warns; and says so in the error, if nothing else is to be seen.
    void leave_out(const Directive& directive, const std::string& what);
    void seems_version(int version) { version_ = version_ ? version_ : version; }
    bool is_in_world(const Directive& directive, const std::string& type);
    Status find_file(const std::string& name, std::filesystem::path& path, bool& exists) const;
    Status include(const Directive& directive);
    Status import(const Directive& directive);
    Status world_begin(const Directive& directive);
    Status world_end(const Directive& directive);
    Status attribute_begin(const Directive& directive);
    Status attribute_end(const Directive& directive);
    Status transform_begin(const Directive& directive);
    Status transform_end(const Directive& directive);
    Status reverse_orientation(const Directive& directive);
    Status push(const Directive& directive, Scope scope);
    void pop(const Directive& directive, Scope scope);
    static const char* scope_name(Scope scope);

    // pbrt_transforms.cpp
    Status identity(const Directive& directive);
    Status translate(const Directive& directive);
    Status scale(const Directive& directive);
    Status rotate(const Directive& directive);
    Status look_at(const Directive& directive);
    Status transform(const Directive& directive);
    Status concat_transform(const Directive& directive);
    Status coordinate_system(const Directive& directive);
    Status coord_sys_transform(const Directive& directive);
    Status active_transform(const Directive& directive);
    Status take_matrix(const Directive& directive, Transform& matrix);
    Status apply(const Directive& directive, const Transform& transform);
    Status set_transform(const Directive& directive, const Transform& transform);

    // pbrt_film.cpp
    Status film(const Directive& directive);
    Status film_response(const Directive& directive, const PbrtParameters& parameters);
    Status crop(const Directive& directive, const PbrtParameters& parameters);
    Status set_film_response();
    Status pixel_filter(const Directive& directive);
    Status set_pixel_filter();

    // pbrt_camera.cpp
    Status camera(const Directive& directive);
    Status sampler(const Directive& directive);
    Status integrator(const Directive& directive);
    Status lens(const Directive& directive, const PbrtParameters& parameters, CameraSettings& settings);
    Status frame(const Directive& directive, const PbrtParameters& parameters, CameraSettings& settings);
    Status place_camera();
    void crop_camera();

    // pbrt_roughness.cpp
    // GGX alpha, or a texture of roughness that becomes one as `remap` says (RP_TEXTURE_SET), along the tangent and across it.
    struct PbrtRoughness {
        struct Axis {
            float alpha = 0;
            std::optional<Texture> texture;
        };
        Axis along, across;  // across: 0 where both are the same
        float remap = 0;
        bool is_textured() const { return along.texture || across.texture; }
        void set(float least, TexturedMaterial& material) const;
    };
    Status roughness(const PbrtParameters& parameters, const std::string& prefix, bool version_3, double usual, PbrtRoughness& roughness);

    // pbrt_materials.cpp
    Status material(const Directive& directive);
    Status make_named_material(const Directive& directive);
    Status named_material(const Directive& directive);
    Status make_material(const Directive& directive, const std::string& type, const PbrtParameters& parameters, uint32_t& index);
    Status describe_material(const Directive& directive, const std::string& type, const PbrtParameters& parameters, TexturedMaterial& material);
    Status conductor(const PbrtParameters& parameters, const std::string& prefix, bool version_3, TexturedMaterial& material);
    Status index_of_refraction(const Directive& directive, const PbrtParameters& parameters, const std::string& prefix, float& ior);
    Status dielectric(const Directive& directive, const PbrtParameters& parameters, bool version_3, TexturedMaterial& material);
    void make_translucent(const Directive& directive, const Texture& opacity, TexturedMaterial& material);
    uint32_t keep_material(const Directive& directive, const TexturedMaterial& material);
    Status glossy(const Directive& directive, const std::string& type, const PbrtParameters& parameters, TexturedMaterial& material);
    Status coated(const Directive& directive, const std::string& type, const PbrtParameters& parameters, TexturedMaterial& material);
    Status disney(const Directive& directive, const PbrtParameters& parameters, TexturedMaterial& material);
    Status approximate_material(const Directive& directive, const std::string& type, const PbrtParameters& parameters, TexturedMaterial& material);
    Status mix_materials(const Directive& directive, const PbrtParameters& parameters, TexturedMaterial& material);
    Status bumps(const Directive& directive, const PbrtParameters& parameters, TexturedMaterial& material);

    // pbrt_textures.cpp
    Status texture(const Directive& directive);
    Status make_texture(const Directive& directive, const std::string& type, const PbrtParameters& parameters, bool is_float, PbrtTexture& made);
    Status image_source(const Directive& directive, const PbrtParameter& file, const ImageEncoding& encoding,
                        std::shared_ptr<const ImageSource>& source);
    Status image_encoding(const Directive& directive, const PbrtParameters& parameters, ImageEncoding& encoding);
    Status image_texture(const Directive& directive, const PbrtParameters& parameters, bool is_float, PbrtTexture& made);
    Status ptex_texture(const Directive& directive, const PbrtParameters& parameters, bool is_float, PbrtTexture& made);
    void give_faces(const Directive& directive, const std::string& type, const PbrtParameters& parameters, Shape& shape);
    Status noise_texture(const Directive& directive, const std::string& type, const PbrtParameters& parameters, Texture& texture);
    Status surface_map(const Directive& directive, const PbrtParameters& parameters, bool flipped, std::optional<rp_texture_map>& map);
    rp_texture_map point_map(const Directive& directive);
    Transform to_texture_space(const Directive& directive);
    // The first of these parameters that is there, which may be a texture.
    Status color_texture(const PbrtParameters& parameters, std::initializer_list<std::string_view> names, const Float3& fallback, Texture& result);
    Status number_texture(const PbrtParameters& parameters, std::initializer_list<std::string_view> names, double fallback, Texture& result);

    // pbrt_colors.cpp
    // The colour of the first of these parameters that is there. Never negative, always finite.
    Status color(const PbrtParameters& parameters, std::initializer_list<std::string_view> names, const Float3& fallback, Float3& color);
    Status parameter_color(const PbrtParameter& parameter, const Float3& fallback, Float3& color);
    Status named_color(const PbrtParameter& parameter, const Float3& fallback, Float3& color);
    Status blackbody_parameter(const PbrtParameter& parameter, Float3& color);

    // pbrt_lights.cpp
    Status light_source(const Directive& directive);
    Status area_light_source(const Directive& directive);
    Status light_color(const PbrtParameters& parameters, std::string_view name, Float3& color, double per_power = 0);
    Status infinite_light_source(const Directive& directive, const PbrtParameters& parameters);
    Status distant_light(const Directive& directive, const PbrtParameters& parameters);
    Status point_light(const Directive& directive, const PbrtParameters& parameters);
    Status spot_light(const Directive& directive, const PbrtParameters& parameters);
    Status goniometric_light(const Directive& directive, const PbrtParameters& parameters);
    Status projection_light(const Directive& directive, const PbrtParameters& parameters);
    Status share_power(const std::string& type, Shape& shape);

    // pbrt_skies.cpp
    struct PbrtSky {
        Image image;                 // in the mapping of skies
        std::array<Float3, 3> axes;  // in the world
    };
    Status read_light_image(const Directive& directive, const PbrtParameter& file, Image& image);
    Status bring_into_sky(const Directive& directive, const PbrtParameter& file, Image& image);
    Status light_axes(const Directive& directive, std::array<Float3, 3>& axes);
    Status add_light_image(const Directive& directive, const Image& image, rp_light& light);
    Status image_sky(const Directive& directive, const PbrtParameters& parameters, const PbrtParameter& file);
    Status finish_sky();

    // pbrt_shapes.cpp
    Status shape(const Directive& directive);
    std::optional<double> constant_alpha(const PbrtParameter* alpha) const;
    // Makes what a directive says of a shape but for its place and looks. Left without a source and without a radius: there is nothing to be seen.
    Status make_shape(const Directive& directive, const std::string& type, const PbrtParameters& parameters, Shape& shape);
    Status find_shape_file(const Directive& directive, const PbrtParameters& parameters, std::filesystem::path& path, bool& exists);
    Status triangle_mesh(const Directive& directive, const PbrtParameters& parameters, Shape& shape);
    Status ply_mesh(const Directive& directive, const PbrtParameters& parameters, Shape& shape);
    Status points(const Directive& directive, const PbrtParameters& parameters, Shape& shape);
    Status mesh_in_memory(const Directive& directive, TriangleMesh mesh, Shape& shape);
    // Drops them if there are not as many as points.
    void check_uvs(const Directive& directive, size_t points, std::vector<Float2>& uvs);
    Status add_shape(Shape shape);
    Status cut_out(const Directive& directive, const PbrtParameters& parameters, Shape& shape);

    // pbrt_objects.cpp
    Status object_begin(const Directive& directive);
    Status object_end(const Directive& directive);
    Status object_instance(const Directive& directive);
    Status place(uint32_t object, const Transform& transform);
    std::vector<bool> placed_objects() const;
    bool is_to_be_kept(const PbrtObject& object) const;
    Status copy_object(const PbrtObject& object, const Transform& to_world);
    void keep_object(PbrtObject& object);
    Status place_objects(const std::string& scene_file);

    // pbrt_curved_shapes.cpp
    Status sphere(const Directive& directive, const PbrtParameters& parameters, Shape& shape);
    void make_sphere(double radius, Shape& shape);
    void make_ellipsoid(Shape& shape, double radius, bool uvs);
    bool wants_uvs() const;  // of the shape that is read
    Status sweep(const Directive& directive, const PbrtParameters& parameters, double& radians);
    Status lengths(const Directive& directive, std::initializer_list<double> values);
    Status disk(const Directive& directive, const PbrtParameters& parameters, Shape& shape);
    Status cylinder(const Directive& directive, const PbrtParameters& parameters, Shape& shape);
    Status cone(const Directive& directive, const PbrtParameters& parameters, Shape& shape);
    Status paraboloid(const Directive& directive, const PbrtParameters& parameters, Shape& shape);
    Status hyperboloid(const Directive& directive, const PbrtParameters& parameters, Shape& shape);
    Status curve(const Directive& directive, const PbrtParameters& parameters, Shape& shape);
    Status curve_points(const Directive& directive, const PbrtParameters& parameters, CurveShape& curve);
    Status loop_subdivision(const Directive& directive, const PbrtParameters& parameters, Shape& shape);
    Status bilinear_mesh(const Directive& directive, const PbrtParameters& parameters, Shape& shape);

    Scene scene_;
    PbrtWarnings warnings_;
    PbrtTokens* tokens_ = nullptr;      // of the file that is being read
    std::vector<OpenFile> open_files_;  // from the scene file to the one being read, to find cycles and relative paths
    uint64_t included_ = 0, kept_text_bytes_ = 0;
    std::unordered_map<std::string, IncludedFile> included_files_;  // by the folder that the name counts from, and the name
    std::set<std::string> listed_files_;                            // in scene_.files
    bool any_known_ = false;                                        // a directive that means something was met
    bool world_begun_ = false, world_ended_ = false;
    std::string first_left_out_;
    int version_ = 0;                         // of pbrt, 3 or 4, by the first directive that only one of them has
    std::optional<std::string> odd_nesting_;  // the first warning of one, if any: version 3 allows it
    PbrtLocation odd_nesting_location_;
    GraphicsState state_;
    std::vector<SavedState> saved_;
    bool transforms_active_ = true;
    std::map<std::string, Transform> coordinate_systems_;
    std::optional<CameraSettings> camera_;
    FilmSettings film_;
    std::optional<Crop> crop_;
    std::optional<FilterSettings> filter_;
    std::optional<PbrtSky> sky_;  // all images of skies so far
    std::map<std::string, uint32_t> named_materials_;
    bool textured_alpha_ = false;                                            // of the shape that is read
    std::map<std::tuple<uint32_t, const void*, float>, uint32_t> cut_outs_;  // by material and alpha
    PbrtTextures textures_;
    std::map<std::tuple<std::filesystem::path, int, float>, std::shared_ptr<const ImageSource>> image_sources_;  // by name and encoding
    std::map<std::tuple<std::filesystem::path, int, float>, std::shared_ptr<const PtexAtlas>> ptex_files_;       // likewise
    std::map<std::pair<const MeshFile*, const PtexAtlas*>, std::shared_ptr<const MeshFile>> meshes_with_faces_;
    std::map<uint32_t, std::optional<uint32_t>> without_textures_;  // by material: that with mid values
    std::vector<PbrtObject> objects_;
    std::unordered_map<std::string, size_t> object_numbers_;  // by name: the latest of that name
    std::shared_ptr<PlacementStore> placements_;              // of objects_, but for those that are written out at once
    PbrtObject* object_ = nullptr;                            // between ObjectBegin and ObjectEnd
    PbrtLocation object_location_;
    std::map<std::filesystem::path, std::shared_ptr<const MeshFile>> mesh_files_;
    bool has_noted_colors_ = false;                                                                          // of meshes
    std::map<std::pair<std::filesystem::path, std::string>, std::shared_ptr<const CloudFile>> cloud_files_;  // by name and columns
    const PointColumns columns_;
    std::shared_ptr<const MeshSource> ball_, ball_with_uvs_;  // a unit sphere of triangles, if one was needed
};

}  // namespace raypager
