#include "reference/geometry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/check.hpp"
#include "reference/embree_scene.hpp"

namespace raypager::reference {
namespace {

// The unit normal outside a triangle, or the zero vector if it is degenerate. Differences of floats are exact in double, so that
// three collinear corners give exactly zero.
Vec3 triangle_normal(const Corners& p) {
    const Vec3 normal = cross(p[1] - p[0], p[2] - p[0]);
    const double size = length(normal);
    return size > 0 && std::isfinite(size) ? normal / size : Vec3();
}

double determinant(const Transform& t) { return dot(Vec3(t.vector(1, 0, 0)), cross(Vec3(t.vector(0, 1, 0)), Vec3(t.vector(0, 0, 1)))); }

}  // namespace

Hit intersect_sphere(const WorldSphere& sphere, const Ray& ray) {
    // The discriminant is taken from the vector between centre and line, which does not cancel for distant origins
    // (Haines et al., Precision Improvements for Ray/Sphere Intersection, Ray Tracing Gems, 2019).
    const Vec3 o = Vec3(ray.origin) - Vec3(sphere.center), d(ray.direction);
    const double a = dot(d, d), middle = -dot(o, d) / a, radius = sphere.radius;
    const Vec3 offset = o + middle * d;
    const double discriminant = radius * radius - dot(offset, offset);
    if (!(discriminant >= 0) || !(radius > 0)) return {};
    const double half_chord = std::sqrt(discriminant / a);
    const double t = middle - half_chord > 0 ? middle - half_chord : middle + half_chord;
    if (!(t > 0 && t <= ray.tmax)) return {};
    const Vec3 outward = normalized(o + t * d);
    return {.t = t, .primitive = 0, .normal = sphere.normal_inwards ? -outward : outward};
}

// A ray with the shear that makes its direction (0, 0, 1).
struct ReferenceGeometry::ShearedRay {
    Ray ray;
    Vec3 origin;
    int kx, ky, kz;
    double sx, sy, sz;
    explicit ShearedRay(const Ray& r) : ray(r), origin(r.origin) {
        const Vec3 d(r.direction);
        kz = std::abs(d.x) > std::abs(d.y) ? (std::abs(d.x) > std::abs(d.z) ? 0 : 2) : (std::abs(d.y) > std::abs(d.z) ? 1 : 2);
        kx = (kz + 1) % 3;
        ky = (kz + 2) % 3;
        sx = d[kx] / d[kz];
        sy = d[ky] / d[kz];
        sz = 1 / d[kz];
    }
    // x and y across the ray, z along it in units of t.
    Vec3 sheared(const Vec3& point) const {
        const Vec3 p = point - origin;
        return {p[kx] - sx * p[kz], p[ky] - sy * p[kz], sz * p[kz]};
    }
};

ReferenceGeometry::ReferenceGeometry() = default;
ReferenceGeometry::~ReferenceGeometry() = default;

Result<std::shared_ptr<const ReferenceGeometry>> ReferenceGeometry::build(const Scene& scene) {
    std::shared_ptr<ReferenceGeometry> geometry(new ReferenceGeometry());
    geometry->ranges_.emplace_back();
    for (const Shape& shape : scene.shapes) {
        RAYPAGER_CHECK(!shape.unseen);  // such lights stand among the scene's
        if (Status status = geometry->add_shape(shape); !status.ok()) return status.at(shape.name);
    }
    geometry->find_bounds();
    EmbreeScene::Content content;
    content.positions = geometry->positions_;
    content.spheres = geometry->spheres_;
    for (uint32_t id = 0; id < geometry->primitive_count(); id++) {
        if (geometry->is_sphere(id)) {
            content.sphere_ids.push_back(id);
        } else if (!geometry->is_degenerate(id)) {
            content.triangles.push_back(geometry->triangle(id));
            content.triangle_ids.push_back(id);
        }
    }
    geometry->embree_ = std::make_unique<EmbreeScene>(std::move(content));
    return std::shared_ptr<const ReferenceGeometry>(std::move(geometry));
}

// Fills the open last range and opens the next one.
Status ReferenceGeometry::add_shape(const Shape& shape) {
    const size_t before = triangles_.size() + spheres_.size();
    ranges_.back().first = static_cast<uint32_t>(shape.mesh ? triangles_.size() : spheres_.size());
    ranges_.back().sphere = !shape.mesh;
    RAYPAGER_TRY(shape.mesh ? add_mesh(shape) : shape.points ? add_points(shape) : add_sphere(shape));
    const uint64_t end = ranges_.back().first_primitive + uint64_t{triangles_.size() + spheres_.size() - before};
    if (end >= RP_NONE) return Status::failed("too many primitives for the reference tracer");
    ranges_.push_back({.first_primitive = static_cast<uint32_t>(end)});
    return {};
}

Status ReferenceGeometry::add_mesh(const Shape& shape) {
    TriangleMesh mesh;
    MeshIssues issues;
    RAYPAGER_TRY(shape.mesh->load(mesh, issues));
    const auto base = static_cast<uint32_t>(positions_.size());
    for (const Float3& p : mesh.positions) positions_.push_back(Vec3(shape.to_world.point(p.x, p.y, p.z)).to_float());
    normals_.resize(positions_.size());
    uvs_.insert(uvs_.end(), mesh.uvs.begin(), mesh.uvs.end());
    uvs_.resize(positions_.size());
    if (!mesh.normals.empty()) {
        const std::optional<Transform> inverse = shape.to_world.inverse();
        if (!inverse) return Status::failed("the transform is singular");
        const Transform of_normals = inverse->transpose();
        for (size_t i = 0; i < mesh.normals.size(); i++) {
            const Float3& n = mesh.normals[i];
            const Vec3 world(of_normals.vector(n.x, n.y, n.z));
            const double size = length(world);
            if (size > 0) normals_[base + i] = (world / size).to_float();
        }
    }
    const bool flip = shape.reverse_orientation != shape.to_world.swaps_handedness();
    for (Triangle t : mesh.triangles) {
        for (uint32_t& index : t) index += base;
        if (flip) std::swap(t[1], t[2]);
        triangles_.push_back(t);
    }
    return {};
}

Status ReferenceGeometry::add_sphere(const Shape& shape) {
    const double scale = std::cbrt(std::abs(determinant(shape.to_world)));
    const Vec3 axes[3] = {Vec3(shape.to_world.vector(1, 0, 0)), Vec3(shape.to_world.vector(0, 1, 0)), Vec3(shape.to_world.vector(0, 0, 1))};
    for (int i = 0; i < 3; i++) {
        // What a product of a few float matrices leaves of a similarity.
        const bool similar = std::abs(length(axes[i]) - scale) <= 1e-5 * scale && std::abs(dot(axes[i], axes[(i + 1) % 3])) <= 1e-5 * scale * scale;
        if (!similar) return Status::failed("a sphere scaled unevenly is none: tessellate it");
    }
    const Float3& c = shape.sphere.center;
    // Seen from the world, the natural normal of a sphere is the outer one in mirrored spaces, too.
    spheres_.push_back({.center = Vec3(shape.to_world.point(c.x, c.y, c.z)).to_float(),
                        .radius = static_cast<float>(scale * shape.sphere.radius),
                        .normal_inwards = shape.reverse_orientation});
    return {};
}

// Points must have radii of their own that the engine stores as they are, in a space that is the world's.
Status ReferenceGeometry::add_points(const Shape& shape) {
    MeshIssues issues;
    return shape.points->stream(
        [&](std::span<const CloudPoint> points) -> Status {
            for (const CloudPoint& p : points) {
                if (!(p.radius > 0) || !shape.to_world.is_identity()) return Status::failed("not a cloud that the reference tracer takes");
                spheres_.push_back({.center = p.position, .radius = p.radius, .normal_inwards = false});
            }
            return {};
        },
        issues);
}

void ReferenceGeometry::find_bounds() {
    const auto grow = [&](const Vec3& a, const Vec3& b) {
        lower_ = {std::min(lower_.x, a.x), std::min(lower_.y, a.y), std::min(lower_.z, a.z)};
        upper_ = {std::max(upper_.x, b.x), std::max(upper_.y, b.y), std::max(upper_.z, b.z)};
    };
    for (uint32_t id = 0; id < primitive_count(); id++) {
        if (is_degenerate(id)) continue;
        if (is_sphere(id)) {
            const Vec3 center(sphere(id).center), radius(double{sphere(id).radius});
            grow(center - radius, center + radius);
        } else {
            for (const Vec3& p : corners(id)) grow(p, p);
        }
    }
}

const ReferenceGeometry::Range& ReferenceGeometry::range_of(uint32_t primitive) const {
    RAYPAGER_CHECK(primitive < primitive_count());
    return ranges_[shape_of(primitive)];
}

uint32_t ReferenceGeometry::shape_of(uint32_t primitive) const {
    const auto after =
        std::upper_bound(ranges_.begin(), ranges_.end(), primitive, [](uint32_t id, const Range& range) { return id < range.first_primitive; });
    return static_cast<uint32_t>(after - ranges_.begin()) - 1;
}

const Triangle& ReferenceGeometry::triangle(uint32_t primitive) const {
    const Range& range = range_of(primitive);
    RAYPAGER_CHECK(!range.sphere);
    return triangles_[range.first + (primitive - range.first_primitive)];
}

Corners ReferenceGeometry::corners(uint32_t primitive) const {
    const Triangle& t = triangle(primitive);
    return {Vec3(positions_[t[0]]), Vec3(positions_[t[1]]), Vec3(positions_[t[2]])};
}

const WorldSphere& ReferenceGeometry::sphere(uint32_t primitive) const {
    const Range& range = range_of(primitive);
    RAYPAGER_CHECK(range.sphere);
    return spheres_[range.first + (primitive - range.first_primitive)];
}

double ReferenceGeometry::area(uint32_t primitive) const {
    if (is_sphere(primitive)) return 4 * pi * double{sphere(primitive).radius} * sphere(primitive).radius;
    const Corners p = corners(primitive);
    const double area = 0.5 * length(cross(p[1] - p[0], p[2] - p[0]));
    return std::isfinite(area) ? area : 0;
}

Vec3 ReferenceGeometry::position(const Hit& hit) const {
    if (is_sphere(hit.primitive)) {
        const WorldSphere& s = sphere(hit.primitive);
        return Vec3(s.center) + hit.normal * (s.normal_inwards ? -s.radius : s.radius);
    }
    const Corners p = corners(hit.primitive);
    return p[0] * (1 - hit.u - hit.v) + p[1] * hit.u + p[2] * hit.v;
}

Vec3 ReferenceGeometry::shading_normal(const Hit& hit) const {
    if (is_sphere(hit.primitive)) return hit.normal;
    const Triangle& t = triangle(hit.primitive);
    for (const uint32_t vertex : t) {
        if (normals_[vertex] == Float3{}) return hit.normal;
    }
    const Vec3 sum = Vec3(normals_[t[0]]) * (1 - hit.u - hit.v) + Vec3(normals_[t[1]]) * hit.u + Vec3(normals_[t[2]]) * hit.v;
    const double size = length(sum);
    return size > 0 ? sum / size : hit.normal;
}

Float2 ReferenceGeometry::uv(const Hit& hit) const {
    if (is_sphere(hit.primitive)) return {};
    const Triangle& t = triangle(hit.primitive);
    const double w = 1 - hit.u - hit.v;
    return {static_cast<float>(w * uvs_[t[0]].x + hit.u * uvs_[t[1]].x + hit.v * uvs_[t[2]].x),
            static_cast<float>(w * uvs_[t[0]].y + hit.u * uvs_[t[1]].y + hit.v * uvs_[t[2]].y)};
}

namespace {

// Where a mesh says nothing: Duff et al., Building an Orthonormal Basis, Revisited, JCGT 6(1), 2017.
Vec3 any_tangent(const Vec3& n) {
    const double sign = std::copysign(1.0, n.z), a = -1 / (sign + n.z);
    return {1 + sign * n.x * n.x * a, sign * n.x * n.y * a, -sign * n.x};
}

}  // namespace

// position = p0 + u dp/du + v dp/dv, solved for the edges.
Vec3 ReferenceGeometry::tangent(const Hit& hit) const {
    if (is_sphere(hit.primitive)) return any_tangent(hit.normal);
    const Corners p = corners(hit.primitive);
    const Triangle& t = triangle(hit.primitive);
    const auto& [a, b, c] = std::array{uvs_[t[0]], uvs_[t[1]], uvs_[t[2]]};
    const double u1{b.x - a.x}, v1{b.y - a.y}, u2{c.x - a.x}, v2{c.y - a.y}, determinant = u1 * v2 - u2 * v1;
    if (determinant == 0) return any_tangent(hit.normal);
    return ((p[1] - p[0]) * v2 - (p[2] - p[0]) * v1) / determinant;
}

Hit ReferenceGeometry::closest(const Ray& ray) const {
    Hit hit = embree_->closest(ray);
    if (!hit.found()) return hit;
    if (is_sphere(hit.primitive)) {
        const uint32_t id = hit.primitive;
        hit = intersect_sphere(sphere(id), ray);
        hit.primitive = id;
    } else {
        hit.normal = triangle_normal(corners(hit.primitive));
    }
    return hit;
}

bool ReferenceGeometry::occluded(const Ray& ray) const { return embree_->occluded(ray); }

Hit ReferenceGeometry::closest_brute_force(const Ray& ray) const {
    const ShearedRay sheared(ray);
    Hit best;
    for (uint32_t id = 0; id < primitive_count(); id++) {
        const Hit hit = intersect(id, sheared);
        if (hit.t < best.t) best = hit;
    }
    return best;
}

bool ReferenceGeometry::occluded_brute_force(const Ray& ray) const {
    const ShearedRay sheared(ray);
    for (uint32_t id = 0; id < primitive_count(); id++) {
        if (intersect(id, sheared).found()) return true;
    }
    return false;
}

Hit ReferenceGeometry::intersect(uint32_t primitive, const Ray& ray) const { return intersect(primitive, ShearedRay(ray)); }

Hit ReferenceGeometry::intersect(uint32_t primitive, const ShearedRay& ray) const {
    if (!is_sphere(primitive)) return intersect_triangle(primitive, ray);
    Hit hit = intersect_sphere(sphere(primitive), ray.ray);
    if (hit.found()) hit.primitive = primitive;
    return hit;
}

// The edge functions of a shared edge are exact negatives of each other in its two triangles, and a rounded difference of two
// rounded products never has the wrong sign: so no ray passes between them (Woop et al. 2013, section 3).
Hit ReferenceGeometry::intersect_triangle(uint32_t primitive, const ShearedRay& ray) const {
    const Corners p = corners(primitive);
    const Vec3 a = ray.sheared(p[0]), b = ray.sheared(p[1]), c = ray.sheared(p[2]);
    const double u = c.x * b.y - c.y * b.x, v = a.x * c.y - a.y * c.x, w = b.x * a.y - b.y * a.x;
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return {};
    const double sum = u + v + w;
    if (sum == 0) return {};
    const double t = (u * a.z + v * b.z + w * c.z) / sum;
    if (!(t > 0 && t <= ray.ray.tmax)) return {};
    const Vec3 normal = triangle_normal(p);
    if (is_black(normal)) return {};  // degenerate
    return {.t = t, .primitive = primitive, .u = v / sum, .v = w / sum, .normal = normal};
}

}  // namespace raypager::reference
