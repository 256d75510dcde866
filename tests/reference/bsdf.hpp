// How surfaces scatter light, in double precision, from the definitions of raypager/abi/scene.h.
#pragma once

#include <optional>
#include <random>

#include "raypager/abi/scene.h"
#include "reference/vector.hpp"

namespace raypager::reference {

class Random {
public:
    explicit Random(uint64_t seed) : engine_(seed) {}
    double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }  // in [0, 1)

private:
    std::mt19937_64 engine_;
};

Vec3 cosine_hemisphere(double u, double v);  // about +z, density cos / pi
Vec3 uniform_sphere(double u, double v);     // density 1 / (4 pi)

// Where light is scattered. All directions are unit vectors that point away from the surface.
struct ScatterPoint {
    Vec3 wo;                // to where the path came from
    Vec3 geometric_normal;  // on the side of wo
    Vec3 shading_normal;    // on the side of geometric_normal and of wo
    bool outside = true;    // wo lies on the side that the surface's own normal points to
    // Where roughness along the tangent goes, of any length and not quite perpendicular to the normals; zero: of no interest.
    Vec3 tangent{};
    Frame frame() const;  // about the shading normal
};

struct ScatterSample {
    Vec3 wi;
    Vec3 weight;     // f |cos| / pdf
    double pdf = 0;  // solid angle; of no meaning if specular
    bool specular = false;
};

// Only a sampled direction carries light: mirrors and glass.
bool is_specular(const rp_material& material);
// f times the cosine to the shading normal; zero for specular materials. Directions on the wrong side of the geometric normal
// carry nothing, reflected or transmitted.
Vec3 evaluate(const rp_material& material, const ScatterPoint& point, const Vec3& wi);
double pdf(const rp_material& material, const ScatterPoint& point, const Vec3& wi);
std::optional<ScatterSample> sample(const rp_material& material, const ScatterPoint& point, Random& random);

// Reflected share of unpolarised light; cosine > 0 on the side of incidence.
double fresnel_dielectric(double cosine, double eta);  // eta: transmitted over incident index
double fresnel_conductor(double cosine, double eta, double k);

}  // namespace raypager::reference
