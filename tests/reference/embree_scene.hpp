// Embree's side of ReferenceGeometry.
#pragma once

#include <embree3/rtcore.h>

#include <cstdint>
#include <vector>

#include "reference/geometry.hpp"

namespace raypager::reference {

// The first hit of a sphere, in double precision; primitive is 0 in a hit.
Hit intersect_sphere(const WorldSphere& sphere, const Ray& ray);

struct ReferenceGeometry::EmbreeScene {
    struct Content {
        std::vector<Float3> positions;
        std::vector<Triangle> triangles;  // none degenerate
        std::vector<WorldSphere> spheres;
        std::vector<uint32_t> triangle_ids, sphere_ids;  // primitives beside triangles and spheres
    };

    explicit EmbreeScene(Content content);
    ~EmbreeScene();
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;
    Hit closest(const Ray& ray) const;  // without normal
    bool occluded(const Ray& ray) const;

private:
    void add_triangles();
    void add_spheres();

    Content content_;
    RTCDevice device_ = nullptr;
    RTCScene scene_ = nullptr;
};

}  // namespace raypager::reference
