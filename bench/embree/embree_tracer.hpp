// The triangles of a baked scene in Embree, and rays traced through it by each of its interfaces.
#pragma once

#include <embree3/rtcore.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "bench/ray_sets.hpp"
#include "raypager/status.hpp"
#include "store/block_file.hpp"

namespace raypager::bench {

enum class EmbreeInterface { single, packet, stream };  // rtcIntersect1, rtcIntersect16, rtcIntersect1M on 64 rays

class EmbreeTracer {
public:
    static Result<std::unique_ptr<EmbreeTracer>> create(const BlockFile& file);
    ~EmbreeTracer();
    // Traces the rays on all cores. coherent: they begin at one point and point in similar directions. Of hits, `hit` and `t` are set; of
    // shadow rays `hit`: something is in the way.
    void trace(const std::vector<Ray>& rays, bool shadow, bool coherent, EmbreeInterface interface, std::vector<SurfacePoint>& hits) const;
    uint64_t bytes() const { return bytes_; }

private:
    EmbreeTracer() = default;
    void trace_chunk(const std::vector<Ray>& rays, size_t begin, size_t end, bool shadow, bool coherent, EmbreeInterface interface,
                     SurfacePoint* hits) const;
    RTCDevice device_ = nullptr;
    RTCScene scene_ = nullptr;
    uint64_t bytes_ = 0;
};

}  // namespace raypager::bench
