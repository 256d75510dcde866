#include "embree_tracer.hpp"

#include <fmt/format.h>
#include <pmmintrin.h>

#include <limits>
#include <map>
#include <tuple>

#include "base/parallel.hpp"
#include "block/decode.hpp"

namespace raypager::bench {
namespace {

constexpr size_t stream_rays = 64, packet_rays = 16;
constexpr size_t chunk_rays = 1024;

bool count_bytes(void* total, ssize_t bytes, bool) {
    __atomic_add_fetch(static_cast<uint64_t*>(total), static_cast<uint64_t>(bytes), __ATOMIC_RELAXED);
    return true;
}

void set(RTCRayHit& ray, const Ray& r) {
    ray.ray.org_x = r.origin.x;
    ray.ray.org_y = r.origin.y;
    ray.ray.org_z = r.origin.z;
    ray.ray.tnear = 0;
    ray.ray.dir_x = r.direction.x;
    ray.ray.dir_y = r.direction.y;
    ray.ray.dir_z = r.direction.z;
    ray.ray.time = 0;
    ray.ray.tfar = r.t_max;
    ray.ray.mask = ~0u;
    ray.ray.id = ray.ray.flags = 0;
    ray.hit.primID = ray.hit.geomID = ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}

void get(const RTCRayHit& ray, bool shadow, SurfacePoint& hit) {
    hit.hit = shadow ? ray.ray.tfar < 0 : ray.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    hit.t = ray.ray.tfar;
    hit.primitive = ray.hit.primID;
}

}  // namespace

Result<std::unique_ptr<EmbreeTracer>> EmbreeTracer::create(const BlockFile& file) {
    std::unique_ptr<EmbreeTracer> tracer(new EmbreeTracer);
    tracer->device_ = rtcNewDevice(nullptr);
    rtcSetDeviceMemoryMonitorFunction(tracer->device_, count_bytes, &tracer->bytes_);
    std::vector<float> positions;
    std::vector<uint32_t> triangles, stored;
    for (uint32_t index = 0; index < file.scene().blocks.size(); index++) {
        std::vector<std::byte> bytes(file.scene().blocks[index].stored_bytes);
        RAYPAGER_TRY(file.read_block(index, bytes));
        const BlockView block(bytes);
        std::map<std::tuple<float, float, float>, uint32_t> numbers;
        for (const rp_u32 root : file.scene().block_entries_of(index).roots) {
            for (const DecodedTriangle& triangle : decode_subtree(block, root).triangles) {
                for (const Float3& v : triangle.vertices) {
                    const auto [entry, is_new] = numbers.try_emplace({v.x, v.y, v.z}, static_cast<uint32_t>(positions.size() / 3));
                    if (is_new) positions.insert(positions.end(), {v.x, v.y, v.z});
                    triangles.push_back(entry->second);
                }
            }
        }
    }
    const RTCGeometry geometry = rtcNewGeometry(tracer->device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* p = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, positions.size() / 3);
    std::copy(positions.begin(), positions.end(), static_cast<float*>(p));
    void* t = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles.size() / 3);
    std::copy(triangles.begin(), triangles.end(), static_cast<uint32_t*>(t));
    rtcCommitGeometry(geometry);
    tracer->scene_ = rtcNewScene(tracer->device_);
    rtcAttachGeometry(tracer->scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(tracer->scene_);
    if (const RTCError error = rtcGetDeviceError(tracer->device_); error != RTC_ERROR_NONE)
        return Status::failed(fmt::format("Embree: error {}", error));
    return tracer;
}

EmbreeTracer::~EmbreeTracer() {
    if (scene_) rtcReleaseScene(scene_);
    if (device_) rtcReleaseDevice(device_);
}

void EmbreeTracer::trace_chunk(const std::vector<Ray>& rays, size_t begin, size_t end, bool shadow, bool coherent, EmbreeInterface interface,
                               SurfacePoint* hits) const {
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    if (interface == EmbreeInterface::single) {
        for (size_t i = begin; i < end; i++) {
            RTCRayHit ray;
            set(ray, rays[i]);
            shadow ? rtcOccluded1(scene_, &context, &ray.ray) : rtcIntersect1(scene_, &context, &ray);
            get(ray, shadow, hits[i]);
        }
        return;
    }
    if (interface == EmbreeInterface::stream) {
        for (size_t i = begin; i < end; i += stream_rays) {
            alignas(16) RTCRayHit stream[stream_rays];
            const auto count = static_cast<unsigned>(std::min(stream_rays, end - i));
            for (unsigned k = 0; k < count; k++) set(stream[k], rays[i + k]);
            if (shadow)
                rtcOccluded1M(scene_, &context, &stream[0].ray, count, sizeof(RTCRayHit));
            else
                rtcIntersect1M(scene_, &context, stream, count, sizeof(RTCRayHit));
            for (unsigned k = 0; k < count; k++) get(stream[k], shadow, hits[i + k]);
        }
        return;
    }
    for (size_t i = begin; i < end; i += packet_rays) {
        alignas(64) int valid[packet_rays];
        RTCRayHit16 packet;
        for (size_t k = 0; k < packet_rays; k++) {
            valid[k] = i + k < end ? -1 : 0;
            const Ray& r = rays[std::min(i + k, end - 1)];
            packet.ray.org_x[k] = r.origin.x;
            packet.ray.org_y[k] = r.origin.y;
            packet.ray.org_z[k] = r.origin.z;
            packet.ray.tnear[k] = 0;
            packet.ray.dir_x[k] = r.direction.x;
            packet.ray.dir_y[k] = r.direction.y;
            packet.ray.dir_z[k] = r.direction.z;
            packet.ray.time[k] = 0;
            packet.ray.tfar[k] = r.t_max;
            packet.ray.mask[k] = ~0u;
            packet.ray.id[k] = packet.ray.flags[k] = 0;
            packet.hit.primID[k] = packet.hit.geomID[k] = packet.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
        }
        shadow ? rtcOccluded16(valid, scene_, &context, &packet.ray) : rtcIntersect16(valid, scene_, &context, &packet);
        for (size_t k = 0; k < packet_rays && i + k < end; k++) {
            hits[i + k].hit = shadow ? packet.ray.tfar[k] < 0 : packet.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
            hits[i + k].t = packet.ray.tfar[k];
            hits[i + k].primitive = packet.hit.primID[k];
        }
    }
}

void EmbreeTracer::trace(const std::vector<Ray>& rays, bool shadow, bool coherent, EmbreeInterface interface, std::vector<SurfacePoint>& hits) const {
    hits.resize(rays.size());
    parallel_for((rays.size() + chunk_rays - 1) / chunk_rays, 1, [&](size_t chunk, size_t) {
        const size_t begin = chunk * chunk_rays;
        trace_chunk(rays, begin, std::min(begin + chunk_rays, rays.size()), shadow, coherent, interface, hits.data());
    });
}

}  // namespace raypager::bench
