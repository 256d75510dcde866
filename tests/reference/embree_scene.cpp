#include "reference/embree_scene.hpp"

#include <algorithm>
#include <utility>

#include "base/check.hpp"

namespace raypager::reference {
namespace {

constexpr unsigned triangles_geometry = 0, spheres_geometry = 1;

RTCRay to_embree(const Ray& ray) {
    RTCRay r{};
    r.org_x = ray.origin.x, r.org_y = ray.origin.y, r.org_z = ray.origin.z;
    r.dir_x = ray.direction.x, r.dir_y = ray.direction.y, r.dir_z = ray.direction.z;
    r.tnear = std::numeric_limits<float>::min();  // t > 0
    r.tfar = ray.tmax;
    r.mask = 0xffffffffu;
    return r;
}

Ray from_embree(const RTCRay& r) { return {{r.org_x, r.org_y, r.org_z}, {r.dir_x, r.dir_y, r.dir_z}, r.tfar}; }

void sphere_bounds(const RTCBoundsFunctionArguments* arguments) {
    const auto& sphere = static_cast<const WorldSphere*>(arguments->geometryUserPtr)[arguments->primID];
    // One step outwards makes up for the rounding of the sums.
    const auto below = [&](float c) { return std::nextafter(c - sphere.radius, -std::numeric_limits<float>::infinity()); };
    const auto above = [&](float c) { return std::nextafter(c + sphere.radius, std::numeric_limits<float>::infinity()); };
    RTCBounds& b = *arguments->bounds_o;
    b.lower_x = below(sphere.center.x), b.lower_y = below(sphere.center.y), b.lower_z = below(sphere.center.z);
    b.upper_x = above(sphere.center.x), b.upper_y = above(sphere.center.y), b.upper_z = above(sphere.center.z);
}

void sphere_intersect(const RTCIntersectFunctionNArguments* arguments) {
    RAYPAGER_CHECK(arguments->N == 1);
    if (!arguments->valid[0]) return;
    const auto& sphere = static_cast<const WorldSphere*>(arguments->geometryUserPtr)[arguments->primID];
    auto& ray_hit = *reinterpret_cast<RTCRayHit*>(arguments->rayhit);
    const Hit hit = intersect_sphere(sphere, from_embree(ray_hit.ray));
    if (!hit.found()) return;
    ray_hit.ray.tfar = static_cast<float>(hit.t);
    ray_hit.hit.u = ray_hit.hit.v = 0;
    ray_hit.hit.geomID = spheres_geometry;
    ray_hit.hit.primID = arguments->primID;
    ray_hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}

void sphere_occluded(const RTCOccludedFunctionNArguments* arguments) {
    RAYPAGER_CHECK(arguments->N == 1);
    if (!arguments->valid[0]) return;
    const auto& sphere = static_cast<const WorldSphere*>(arguments->geometryUserPtr)[arguments->primID];
    auto& ray = *reinterpret_cast<RTCRay*>(arguments->ray);
    if (intersect_sphere(sphere, from_embree(ray)).found()) ray.tfar = -std::numeric_limits<float>::infinity();
}

}  // namespace

ReferenceGeometry::EmbreeScene::EmbreeScene(Content content) : content_(std::move(content)) {
    device_ = rtcNewDevice(nullptr);
    RAYPAGER_CHECK(device_ != nullptr);
    scene_ = rtcNewScene(device_);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    if (!content_.triangles.empty()) add_triangles();
    if (!content_.spheres.empty()) add_spheres();
    rtcCommitScene(scene_);
    RAYPAGER_CHECK(rtcGetDeviceError(device_) == RTC_ERROR_NONE);
}

ReferenceGeometry::EmbreeScene::~EmbreeScene() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
}

void ReferenceGeometry::EmbreeScene::add_triangles() {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    // Embree allocates the buffers, because it reads some bytes past their end.
    void* positions = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Float3), content_.positions.size());
    void* triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Triangle), content_.triangles.size());
    RAYPAGER_CHECK(positions && triangles);
    std::copy(content_.positions.begin(), content_.positions.end(), static_cast<Float3*>(positions));
    std::copy(content_.triangles.begin(), content_.triangles.end(), static_cast<Triangle*>(triangles));
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene_, geometry, triangles_geometry);
    rtcReleaseGeometry(geometry);
}

void ReferenceGeometry::EmbreeScene::add_spheres() {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(content_.spheres.size()));
    rtcSetGeometryUserData(geometry, content_.spheres.data());
    rtcSetGeometryBoundsFunction(geometry, sphere_bounds, nullptr);
    rtcSetGeometryIntersectFunction(geometry, sphere_intersect);
    rtcSetGeometryOccludedFunction(geometry, sphere_occluded);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene_, geometry, spheres_geometry);
    rtcReleaseGeometry(geometry);
}

Hit ReferenceGeometry::EmbreeScene::closest(const Ray& ray) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit ray_hit{};
    ray_hit.ray = to_embree(ray);
    ray_hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    ray_hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_, &context, &ray_hit);
    if (ray_hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
    const std::vector<uint32_t>& ids = ray_hit.hit.geomID == triangles_geometry ? content_.triangle_ids : content_.sphere_ids;
    Hit hit{.t = ray_hit.ray.tfar, .primitive = ids[ray_hit.hit.primID]};
    hit.u = ray_hit.hit.u, hit.v = ray_hit.hit.v;
    return hit;
}

bool ReferenceGeometry::EmbreeScene::occluded(const Ray& ray) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay embree_ray = to_embree(ray);
    rtcOccluded1(scene_, &context, &embree_ray);
    return embree_ray.tfar < 0;
}

}  // namespace raypager::reference
