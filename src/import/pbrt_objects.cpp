// Objects of pbrt and their instances. Which objects become objects of the scene, and which are written out as shapes, is decided at the end, when
// it is known how often each is placed.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "import/pbrt_reader.hpp"
#include "import/text.hpp"
#include "scene/placement_transform.hpp"
#include "scene/texture_use.hpp"

namespace raypager {
namespace {

constexpr uint64_t most_instances = RP_NONE - 1;

// Copies of what has fewer triangles take no more room in blocks than its instances would, and rays find them sooner.
constexpr uint64_t few_triangles = 8, sphere_counts_as = 4;
// But a shape of a scene takes more memory than an instance.
constexpr uint64_t many_copies = 1 << 16;

bool is_sphere(const Shape& shape) { return !shape.mesh && !shape.points; }

// So far from being singular that elimination finds its inverse; the usual case, without that work.
bool surely_invertible(const Transform& transform) {
    constexpr double least_share = 1e-6, smallest = 1e-30, largest = 1e30;
    const auto& m = transform.m;
    double lengths = 1;
    for (size_t i = 0; i < 3; ++i) {
        const double length = std::abs(m[i][0]) + std::abs(m[i][1]) + std::abs(m[i][2]);
        if (!(length > smallest && length < largest && std::abs(m[i][3]) < largest)) return false;
        lengths *= length;
    }
    const double determinant = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) + m[0][1] * (m[1][2] * m[2][0] - m[1][0] * m[2][2]) +
                               m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    return std::abs(determinant) > least_share * lengths;
}

// A radius that is given for the world is that in all instances.
bool may_be_instanced(const std::vector<Shape>& shapes) {
    return std::ranges::none_of(shapes, [](const Shape& s) { return s.points && s.point_radius > 0; });
}

// Points on a sphere that shines are drawn as on a sphere.
bool stretches_a_light(const std::vector<Shape>& shapes, const Transform& to_world) {
    return std::ranges::any_of(shapes, [&](const Shape& s) { return s.area_light && is_sphere(s) && !(to_world * s.to_world).is_similarity(); });
}

bool has_round_light(const std::vector<Shape>& shapes) {
    return std::ranges::any_of(shapes, [](const Shape& s) { return s.area_light && is_sphere(s); });
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

std::string no_room(const Status& why) { return fmt::format("no room for so many instances ({}); set TMPDIR to another folder", why.message()); }

// A whole place near the object, if it is so far from the origin of its own space that single precision would take its digits there.
std::array<double, 3> origin_of(const std::vector<Shape>& shapes, double far_coordinate) {
    if (shapes.empty()) return {};
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
    // Instances of what had the name before stay what they were. Objects come behind those that they place.
    const auto [at, added] = object_numbers_.try_emplace(name, objects_.size());
    if (!added && objects_[at->second].instances == 0) objects_[at->second] = {};
    at->second = objects_.size();
    objects_.emplace_back().name = name;
    object_ = &objects_.back();
    object_location_ = directive.location;
    return {};
}

Status PbrtReader::object_end(const Directive& directive) {
    if (!object_) return error(directive, "without ObjectBegin");
    pop(directive, Scope::object);
    // From here on it may be copied.
    if (object_->placements)
        if (const Status kept = object_->placements->finish(); !kept.ok()) return error(directive, no_room(kept));
    object_ = nullptr;
    return {};
}

Status PbrtReader::object_instance(const Directive& directive) {
    std::string name;
    RAYPAGER_TRY(take_string(name));
    if (!is_in_world(directive, name)) return {};
    const auto found = object_numbers_.find(name);
    if (found == object_numbers_.end()) {
        leave_out(directive, fmt::format("there is no object \"{}\"; the instance is left out", clipped(name)));
        return {};
    }
    if (!surely_invertible(state_.transform) && !state_.transform.inverse()) {
        warn(directive.location, "a transform that cannot be inverted flattens an instance; it is left out");
        return {};
    }
    PbrtObject& object = objects_[found->second];
    if (&object == object_) return error(directive, fmt::format("object \"{}\" in itself", clipped(name)));
    if (object.shapes.empty() && !object.placements) return {};
    if (object.instances++ == 0) object.may_be_instanced = may_be_instanced(object.shapes);
    // Where an instance of what shines comes to stand, and whether it is stretched there, is known of the world alone.
    const bool stretched = stretches_a_light(object.shapes, state_.transform);
    if (!object.may_be_instanced || (object_ && has_round_light(object.shapes)) || (object.placements && stretched)) {
        const Status copied = copy_object(object, state_.transform);
        return copied.ok() ? copied : error(directive, copied.message());
    }
    object.stretches_a_light = object.stretches_a_light || stretched;
    const Status placed = place(static_cast<uint32_t>(found->second), state_.transform);
    return placed.ok() ? placed : error(directive, placed.message());
}

// In the world, or in the object that is being defined. pbrt has no instances in objects; nothing speaks against them.
Status PbrtReader::place(uint32_t object, const Transform& transform) {
    if (object_) {
        if (!object_->placements) object_->placements = std::make_shared<PlacementStore>();
        object_->places.insert(object);
        objects_[object].nested = true;
    }
    if (!object_) objects_[object].in_world = true;
    PlacementStore& store = object_ ? *object_->placements : *placements_;
    if (store.count() == most_instances) return Status::failed(fmt::format("more than {} instances", most_instances));
    const auto& m = transform.m;
    const Status kept = store.add({object, {m[0], m[1], m[2]}});
    return kept.ok() ? kept : Status::failed(no_room(kept));
}

Status PbrtReader::copy_object(const PbrtObject& object, const Transform& to_world) {
    for (Shape shape : object.shapes) {
        // What is a sphere in the object is one in the world only if it is not stretched on the way.
        if (is_sphere(shape) && !(to_world * shape.to_world).is_similarity())
            make_ellipsoid(shape, shape.sphere.radius, uses_uvs(scene_, shape.material));
        shape.to_world = to_world * shape.to_world;
        RAYPAGER_TRY(add_shape(std::move(shape)));
    }
    if (!object.placements) return {};
    return object.placements->for_each_piece([&](std::span<Placement> placements) -> Status {
        for (const Placement& p : placements) RAYPAGER_TRY(place(p.object, to_world * transform_of(p)));
        return {};
    });
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

// Whether rays come to it: in the world, or in an object that is kept.
std::vector<bool> PbrtReader::placed_objects() const {
    std::vector<bool> placed(objects_.size(), false);
    for (size_t i = objects_.size(); i-- > 0;) {
        const PbrtObject& object = objects_[i];
        placed[i] = placed[i] || object.in_world;
        if (!placed[i]) continue;
        for (const uint32_t inner : object.places) placed[inner] = true;
    }
    return placed;
}

bool PbrtReader::is_to_be_kept(const PbrtObject& object) const {
    if (!object.may_be_instanced) return false;
    if (object.nested || object.placements) return true;
    return !object.stretches_a_light && object.instances > 1 && (object.instances > many_copies || !is_small(object.shapes));
}

Status PbrtReader::place_objects(const std::string& scene_file) {
    if (placements_->count() == 0) return {};
    if (const Status kept = placements_->finish(); !kept.ok()) return Status::failed(no_room(kept));
    const auto placed = std::make_shared<std::vector<StoredInstances::PlacedObject>>();
    const std::vector<bool> is_placed = placed_objects();
    for (size_t i = 0; i < objects_.size(); i++) {
        PbrtObject& object = objects_[i];
        if (is_placed[i] && is_to_be_kept(object)) keep_object(object);
        placed->push_back({object.number, object.origin});
    }
    const auto no_shapes = [](const Placement&) { return Status(); };
    for (PbrtObject& object : objects_) {
        if (object.number == RP_NONE || !object.placements) continue;
        if (const Status kept = object.placements->finish(); !kept.ok()) return Status::failed(no_room(kept));
        const auto instances = std::make_shared<StoredInstances>(scene_file, std::move(object.placements), placed, object.origin);
        RAYPAGER_TRY(instances->prepare(no_shapes));
        scene_.objects[object.number].instances.push_back(instances);
    }
    const auto instances = std::make_shared<StoredInstances>(scene_file, std::move(placements_), placed);
    RAYPAGER_TRY(instances->prepare([&](const Placement& p) { return copy_object(objects_[p.object], transform_of(p)); }));
    if (instances->count() > 0) scene_.instances.push_back(instances);
    return {};
}

}  // namespace raypager
