#include "import/precision.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <span>

#include "import/gltf_mesh.hpp"
#include "import/mesh_file.hpp"
#include "scene/placement_transform.hpp"
#include "scene/vector.hpp"

namespace raypager {
namespace {

// Of the extent of what is seen beside it, an offset up to this share is not noticed.
constexpr double harmless_share = 0.02;
// Things that are seen under a smaller angle are small in the picture.
constexpr double min_angle = 0.05;
constexpr uint64_t max_triangles_looked_at = 100'000'000, max_pairs = 1'000'000;

struct Box {
    Vector lower = {INFINITY, INFINITY, INFINITY}, upper = {-INFINITY, -INFINITY, -INFINITY};
    void add(const Vector& p) {
        for (size_t a = 0; a < 3; ++a) {
            lower[a] = std::min(lower[a], p[a]);
            upper[a] = std::max(upper[a], p[a]);
        }
    }
    void add(const Box& other) {
        if (other.empty()) return;
        add(other.lower);
        add(other.upper);
    }
    bool empty() const { return !(lower[0] <= upper[0]); }
    double extent() const { return std::max({upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2]}); }
    Vector center() const { return 0.5 * (lower + upper); }
    // Nearer to the other box than so much, along each axis.
    bool is_near(const Box& other, double distance) const {
        for (size_t a = 0; a < 3; ++a)
            if (lower[a] - other.upper[a] > distance || other.lower[a] - upper[a] > distance) return false;
        return true;
    }
    double largest_coordinate() const {
        double largest = 0;
        for (size_t a = 0; a < 3; ++a) largest = std::max({largest, std::abs(lower[a]), std::abs(upper[a])});
        return largest;
    }
    // Of the point of it that is nearest to the origin.
    double min_coordinate() const {
        double least = 0;
        for (size_t a = 0; a < 3; ++a)
            if (lower[a] > 0 || upper[a] < 0) least = std::max(least, std::min(std::abs(lower[a]), std::abs(upper[a])));
        return least;
    }
};

// As the kernels have it (rp_offset_exponent).
double offset_of(double largest_coordinate) { return largest_coordinate > 0 ? std::exp2(std::floor(std::log2(largest_coordinate)) - 19) : 0; }

Box placed(const Box& box, const Transform& transform) {
    Box result;
    for (int corner = 0; corner < 8 && !box.empty(); ++corner)
        result.add(transform.point(corner & 1 ? box.upper[0] : box.lower[0], corner & 2 ? box.upper[1] : box.lower[1],
                                   corner & 4 ? box.upper[2] : box.lower[2]));
    return result;
}

class PrecisionCheck {
public:
    explicit PrecisionCheck(const Scene& scene) : scene_(scene) {
        boxes_.reserve(scene.shapes.size());
        shapes_.reserve(scene.shapes.size());
        for (const Shape& shape : scene.shapes) add(shape, shape.to_world);
        const std::vector<std::optional<Transform>> nearest = nearest_placements();
        for (size_t i = 0; i < nearest.size(); ++i)
            for (const Shape& shape : scene.objects[i].shapes)
                if (nearest[i]) add(shape, *nearest[i] * shape.to_world);
    }

    // A surface with large offsets, and what suffers from it.
    struct Finding {
        size_t surface = 0, subject = 0;
        double offset = 0;
    };
    std::optional<Finding> find() {
        std::vector<size_t> largest;  // of shapes, those with the largest coordinates first
        for (size_t i = 0; i < boxes_.size(); ++i)
            if (!boxes_[i].empty()) largest.push_back(i);
        std::stable_sort(largest.begin(), largest.end(),
                         [&](size_t a, size_t b) { return boxes_[a].largest_coordinate() > boxes_[b].largest_coordinate(); });
        for (size_t j = 0; j < boxes_.size(); ++j) {
            if (!is_prominent(boxes_[j])) continue;
            const double allowed = harmless_share * boxes_[j].extent();
            for (const size_t i : largest) {
                if (offset_of(boxes_[i].largest_coordinate()) <= allowed || ++pairs_ > max_pairs) break;
                const double offset = offset_near(i, boxes_[j]);
                if (offset > allowed) return Finding{i, j, offset};
            }
        }
        return std::nullopt;
    }

    const Box& box(size_t shape) const { return boxes_[shape]; }
    const Shape& shape(size_t shape) const { return *shapes_[shape].shape; }

private:
    // Of the scene, and of its objects where these are nearest to the camera.
    struct PlacedInWorld {
        const Shape* shape;
        Transform to_world;
    };

    void add(const Shape& shape, const Transform& to_world) {
        shapes_.push_back({&shape, to_world});
        boxes_.push_back(bounds(shape, to_world));
    }

    // Of each object; nothing if there is no instance of it.
    std::vector<std::optional<Transform>> nearest_placements() {
        std::vector<std::optional<Transform>> nearest(scene_.objects.size());
        std::vector<double> distances(nearest.size(), INFINITY);
        std::vector<Vector> centers(nearest.size());
        for (size_t i = 0; i < centers.size(); ++i) {
            Box box;
            for (const Shape& shape : scene_.objects[i].shapes) box.add(bounds(shape, shape.to_world));
            if (!box.empty()) centers[i] = box.center();
        }
        const auto look_at = [&](std::span<const Placement> placements) {
            for (const Placement& placement : placements) {
                if (placement.object >= nearest.size()) continue;  // refused when it is baked
                const Transform to_world = transform_of(placement);
                const Vector& center = centers[placement.object];
                const double distance = length(to_world.point(center[0], center[1], center[2]) - vector(scene_.camera.eye));
                if (!(distance < distances[placement.object])) continue;
                distances[placement.object] = distance;
                nearest[placement.object] = to_world;
            }
            return Status();
        };
        // A source that fails now fails when it is baked, too.
        for (const auto& source : scene_.instances) (void)source->stream(look_at);
        return nearest;
    }

    Box bounds(const Shape& shape, const Transform& to_world) {
        Box box;
        if (shape.points) return box;
        if (!shape.mesh) {
            const auto& s = shape.sphere;
            const Vector r = {s.radius, s.radius, s.radius};
            box.add(vector(s.center) - r);
            box.add(vector(s.center) + r);
            return placed(box, to_world);
        }
        const auto [known, is_new] = local_.try_emplace(shape.mesh.get());
        if (is_new) {
            if (const auto* mesh = dynamic_cast<const MeshInMemory*>(shape.mesh.get())) {
                for (const Float3& p : mesh->mesh().positions)
                    if (finite(p)) known->second.add(vector(p));
            } else if (const auto* file = dynamic_cast<const MeshFile*>(shape.mesh.get())) {
                for (const Vector& p : file->corners_of_sample()) known->second.add(p);
            } else if (const auto* gltf = dynamic_cast<const GltfMesh*>(shape.mesh.get())) {
                for (const Vector& p : gltf->corners()) known->second.add(p);
            }
        }
        return placed(known->second, to_world);
    }

    // In front of the camera, and not small.
    bool is_prominent(const Box& box) const {
        if (box.empty() || !(box.extent() > 0)) return false;
        const Vector towards = box.center() - vector(scene_.camera.eye);
        return box.extent() >= min_angle * length(towards) &&
               dot(towards, vector(scene_.camera.forward)) + box.extent() * length(vector(scene_.camera.forward)) > 0;
    }

    // The largest offset of rays that leave this shape near the box.
    double offset_near(size_t i, const Box& box) {
        const auto& [shape, to_world] = shapes_[i];
        const double reach = box.extent();
        if (!boxes_[i].is_near(box, reach)) return 0;
        if (!shape->mesh) return offset_of(boxes_[i].largest_coordinate());
        const auto* const in_memory = dynamic_cast<const MeshInMemory*>(shape->mesh.get());
        if (in_memory == nullptr) return offset_of(boxes_[i].min_coordinate());
        const TriangleMesh& mesh = in_memory->mesh();
        triangles_ += mesh.triangles.size();
        if (triangles_ > max_triangles_looked_at) return 0;
        double largest = 0;
        for (const Triangle& t : mesh.triangles) {
            Box triangle;
            for (const uint32_t v : t)
                if (v < mesh.positions.size()) triangle.add(to_world.point(mesh.positions[v].x, mesh.positions[v].y, mesh.positions[v].z));
            if (!triangle.empty() && triangle.is_near(box, reach)) largest = std::max(largest, triangle.largest_coordinate());
        }
        return offset_of(largest);
    }

    const Scene& scene_;
    std::vector<PlacedInWorld> shapes_;
    std::vector<Box> boxes_;                  // of these, in the world; empty where nothing is known
    std::map<const MeshSource*, Box> local_;  // in object space
    uint64_t triangles_ = 0, pairs_ = 0;
};

}  // namespace

void warn_of_precision(Scene& scene) {
    PrecisionCheck check(scene);
    const auto found = check.find();
    if (!found) return;
    const Shape &surface = check.shape(found->surface), &subject = check.shape(found->subject);
    const std::string beside = found->surface == found->subject
                                   ? fmt::format("for its extent of {:.3g}", check.box(found->subject).extent())
                                   : fmt::format("beside {}, of extent {:.3g}", subject.name, check.box(found->subject).extent());
    scene.warnings.push_back(fmt::format(
        "{}: coordinates of up to {:.3g} leave too little precision {}: light and shadow are wrong within {:.2g} of its surface; bring the "
        "scene nearer to the origin, or make large shapes smaller",
        surface.name, check.box(found->surface).largest_coordinate(), beside, found->offset));
}

}  // namespace raypager
