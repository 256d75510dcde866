// Scene files -> Scene.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// Light on what comes without any.
struct BareLight {
    enum class Kind { usual, none, key, sun };  // usual: the sun over landscapes, a key light elsewhere
    struct Place {
        double azimuth = 0, elevation = 0;  // degrees: to the right of the first view, and above the ground
    };
    Kind kind = Kind::usual;
    std::optional<Place> place;  // of the sun
    double strength = 1;         // times as bright as usual
};

// What meshes and clouds that come without a scene are made of, what they stand on, and the light that falls on them.
struct BareLook {
    std::optional<rp_material> material;  // of all meshes and clouds; none: as their files say, clay where they do not
    std::optional<Float3> sky;            // radiance; black: there is none; not given: dim, or blue over landscapes
    BareLight light;
    bool no_ground = false;          // meshes and clouds get one otherwise; landscapes have their own
    uint32_t width = 0, height = 0;  // of the picture that is framed; 0: as a Scene has it
};

// What a column of a text cloud holds. skip: known to be something that no picture is made of.
enum class PointColumn : uint8_t { skip, x, y, z, intensity, red, green, blue, classification, radius };
using PointColumns = std::vector<PointColumn>;
// A list as users write it: "x,y,z,i,r,g,b", with "_" or "-" for what is to be passed over. An error of usage names the word that is wrong.
Result<PointColumns> parse_point_columns(const std::string& list);
// The other way round.
std::string point_column_list(const PointColumns& columns);

inline constexpr uint64_t default_keep_bytes = uint64_t{512} << 20;

struct ImportOptions {
    uint64_t keep_bytes = default_keep_bytes;  // that may stay in memory of meshes that had to be read to frame them, to save reading them again
    BareLook look;                             // of bare meshes and clouds
    PointColumns columns;                      // of text clouds; empty: the files tell
};

// One .pbrt, .gltf or .glb file, or any number of bare meshes (.ply .obj .stl .off) and point clouds (.las .ply .xyz .pts .txt), also packed (.gz),
// which are framed, lit and given a ground together; so are glTF files that have no camera or no light. Meshes and clouds are read when they are
// baked. An error names file and place; what was read but could not be used is in Scene::warnings.
Result<Scene> import_scene(const std::vector<std::filesystem::path>& inputs, const ImportOptions& options = {});

// Reads scenes of a format that the library does not know.
using SceneReader = std::function<Result<Scene>(const std::filesystem::path&, const ImportOptions&)>;
// From now on import_scene hands files with this ending (".usd") to it; null: no longer. Not while other threads import.
void use_scene_reader(const std::string& ending, SceneReader reader);

// What a scene that was read so has of its own, and which axis points up in it.
struct SceneParts {
    bool camera = false, light = false, z_up = false;
};
// Gives it what it lacks, as bare meshes have it: a camera that frames the points, in world space, which are some of what is seen, such as corners
// of boxes around it; light; and where it had neither, a ground. An error if there are no points, or none that can be framed.
Status complete_scene(const BareLook& look, const SceneParts& parts, std::span<const std::array<double, 3>> points, Scene& scene);

// Gives the disk space back that unpacked files take, which are kept for the next time that they are opened.
void forget_unpacked_files();

}  // namespace raypager
