// Objects of pbrt and their instances. Which objects become objects of the scene, and which are written out as shapes, is decided at the end, when
// it is known how often each is placed.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "import/pbrt_reader.hpp"
#include "import/text.hpp"
#include "scene/texture_use.hpp"

namespace raypager {
namespace {

// Instances are kept in pieces, which become sources as they are, so that no time needs room for all of them twice.
constexpr size_t placements_in_a_piece = size_t{1} << 20;
constexpr uint64_t most_instances = RP_NONE - 1;

// Copies of what has fewer triangles take no more room in blocks than its instances would, and rays find them sooner.
constexpr uint64_t few_triangles = 8, sphere_counts_as = 4;
// But a shape of a scene takes more memory than an instance.
constexpr uint64_t many_copies = 1 << 16;

bool is_sphere(const Shape& shape) { return !shape.mesh && !shape.points; }

Transform transform_of(const Placement& placement) {
    Transform transform;
    std::copy(placement.to_world.begin(), placement.to_world.end(), transform.m.begin());
    return transform;
}

// A radius that is given for the world is that in all instances.
bool may_be_instanced(const std::vector<Shape>& shapes) {
    return std::ranges::none_of(shapes, [](const Shape& s) { return s.points && s.point_radius > 0; });
}

// Points on a sphere that shines are drawn as on a sphere.
bool stretches_a_light(const std::vector<Shape>& shapes, const Transform& to_world) {
    return std::ranges::any_of(shapes, [&](const Shape& s) { return s.area_light && is_sphere(s) && !(to_world * s.to_world).is_similarity(); });
}

bool is_small(const std::vector<Shape>& shapes) {
    uint64_t count = 0;
    for (const Shape& shape : shapes) {
        if (const auto* mesh = dynamic_cast<const MeshInMemory*>(shape.mesh.get()))
            count += mesh->mesh().triangles.size();
        else if (const auto* file = dynamic_cast<const MeshFile*>(shape.mesh.get()))
            count += file->declared_triangles() > 0 ? file->declared_triangles() : few_triangles;
        else
            count += shape.points ? shape.points->count() : sphere_counts_as;
    }
    return count < few_triangles;
}

// A whole place near the object, if it is so far from the origin of its own space that single precision would take its digits there.
std::array<double, 3> origin_of(const std::vector<Shape>& shapes, double far_coordinate) {
    std::array<double, 3> origin = shapes.front().to_world.point(0, 0, 0);
    const bool far = std::ranges::any_of(origin, [&](double x) { return std::abs(x) > far_coordinate; });
    for (double& x : origin) x = far ? std::round(x) : 0;
    return origin;
}

}  // namespace

Status PbrtReader::object_begin(const Directive& directive) {
    std::string name;
    RAYPAGER_TRY(take_string(name));
    if (object_) return error(directive, fmt::format("inside the object begun in {}", object_location_.with_line()));
    RAYPAGER_TRY(push(directive, Scope::object));
    const auto [at, added] = object_numbers_.try_emplace(name, objects_.size());
    // Instances of what had the name before stay what they were.
    if (!added && objects_[at->second].instances > 0) at->second = objects_.size();
    if (at->second == objects_.size()) objects_.emplace_back();
    objects_[at->second] = {.name = name, .shapes = {}};
    object_ = &objects_[at->second].shapes;
    object_location_ = directive.location;
    return {};
}

Status PbrtReader::object_end(const Directive& directive) {
    if (!object_) return error(directive, "without ObjectBegin");
    pop(directive, Scope::object);
    object_ = nullptr;
    return {};
}

Status PbrtReader::object_instance(const Directive& directive) {
    std::string name;
    RAYPAGER_TRY(take_string(name));
    if (!is_in_world(directive, name)) return {};
    if (object_) {
        warn(directive.location, fmt::format("an object cannot contain instances; that of \"{}\" is left out", clipped(name)));
        return {};
    }
    const auto found = object_numbers_.find(name);
    if (found == object_numbers_.end()) {
        leave_out(directive, fmt::format("there is no object \"{}\"; the instance is left out", clipped(name)));
        return {};
    }
    if (!state_.transform.inverse()) {
        warn(directive.location, "a transform that cannot be inverted flattens an instance; it is left out");
        return {};
    }
    PbrtObject& object = objects_[found->second];
    if (object.shapes.empty()) return {};
    if (object.instances++ == 0) object.may_be_instanced = may_be_instanced(object.shapes);
    if (!object.may_be_instanced) {
        const Status copied = copy_object(object, state_.transform);
        return copied.ok() ? copied : error(directive, copied.message());
    }
    object.stretches_a_light = object.stretches_a_light || stretches_a_light(object.shapes, state_.transform);
    if (++placed_ > most_instances) return error(directive, fmt::format("more than {} instances", most_instances));
    if (placements_.empty() || placements_.back().size() == placements_in_a_piece) placements_.emplace_back();
    const auto& m = state_.transform.m;
    placements_.back().push_back({static_cast<uint32_t>(found->second), {m[0], m[1], m[2]}});
    return {};
}

Status PbrtReader::copy_object(const PbrtObject& object, const Transform& to_world) {
    for (Shape shape : object.shapes) {
        // What is a sphere in the object is one in the world only if it is not stretched on the way.
        if (is_sphere(shape) && !(to_world * shape.to_world).is_similarity())
            make_ellipsoid(shape, shape.sphere.radius, uses_uvs(scene_, shape.material));
        shape.to_world = to_world * shape.to_world;
        RAYPAGER_TRY(add_shape(std::move(shape)));
    }
    return {};
}

// Spheres stay spheres in an object, whatever its instances do to them; but the textures around one would have to follow it to each place.
void PbrtReader::keep_object(PbrtObject& object) {
    for (Shape& shape : object.shapes)
        if (is_sphere(shape) && uses_uvs(scene_, shape.material)) make_ellipsoid(shape, shape.sphere.radius, true);
    const auto& o = object.origin = origin_of(object.shapes, far_coordinate);
    for (Shape& shape : object.shapes) shape.to_world = Transform::translate(-o[0], -o[1], -o[2]) * shape.to_world;
    object.number = static_cast<uint32_t>(scene_.objects.size());
    scene_.objects.push_back({object.name, std::move(object.shapes)});
}

Status PbrtReader::place_objects(const std::string& scene_file) {
    const auto is_kept = [](const PbrtObject& o) { return o.number != RP_NONE; };
    for (PbrtObject& object : objects_)
        if (object.may_be_instanced && !object.stretches_a_light && object.instances > 1 &&
            (object.instances > many_copies || !is_small(object.shapes)))
            keep_object(object);
    for (std::vector<Placement>& piece : placements_) {
        for (const Placement& placement : piece)
            if (const PbrtObject& object = objects_[placement.object]; !is_kept(object)) RAYPAGER_TRY(copy_object(object, transform_of(placement)));
        std::erase_if(piece, [&](const Placement& placement) { return !is_kept(objects_[placement.object]); });
        for (Placement& placement : piece) {
            const PbrtObject& object = objects_[placement.object];
            for (auto& row : placement.to_world)
                for (size_t a = 0; a < 3; ++a) row[3] += row[a] * object.origin[a];
            placement.object = object.number;
        }
        if (!piece.empty()) scene_.instances.push_back(std::make_shared<InstancesInMemory>(scene_file, std::move(piece)));
    }
    placements_.clear();
    return {};
}

}  // namespace raypager
