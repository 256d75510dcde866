// All that shines in a scene, with one strategy to sample it: choose a light, then a point or direction on it.
#pragma once

#include <optional>
#include <vector>

#include "raypager/scene.hpp"
#include "reference/bsdf.hpp"
#include "reference/geometry.hpp"

namespace raypager::reference {

struct LightSample {
    Vec3 wi{};                       // unit, from the shaded point to the light
    double distance = infinity;      // to target
    Vec3 target{}, target_normal{};  // of an emitter with surface; the normal is on the side of the shaded point. Point lights: no normal
    Vec3 radiance{};                 // of point and distant lights: irradiance on a facing surface
    double pdf = 0;                  // solid angle, choice of the light included; of point and distant lights the choice alone
    bool delta = false;              // no sampled direction finds this light
};

class Lights {
public:
    // Keeps references to both arguments.
    Lights(const Scene& scene, const ReferenceGeometry& geometry);

    bool any() const { return !lights_.empty(); }
    // From position, whose surface faces normal. Nothing where the chosen light sheds none.
    std::optional<LightSample> sample(const Vec3& position, const Vec3& normal, Random& random) const;

    // Towards -direction from the hit point.
    Vec3 emitted(const Hit& hit, const Vec3& direction) const;
    // Density with which sample() finds the hit point from origin, distance away along direction.
    double pdf_of_hit(const Hit& hit, const Vec3& direction, double distance) const;
    Vec3 infinite_radiance(const Vec3& direction) const;
    double pdf_of_infinite(const Vec3& normal, const Vec3& direction) const;

private:
    struct Light {
        uint32_t primitive = RP_NONE;  // an emitter with surface, or
        const rp_light* other = nullptr;
        double probability = 0, cumulative = 0;
    };

    const AreaLight* area_light(uint32_t primitive) const;
    void add(Light light, double power);
    void normalize_probabilities();
    const Light& choose(double u) const;
    std::optional<LightSample> sample_surface(const Light& light, const Vec3& position, Random& random) const;
    std::optional<LightSample> sample_unseen(const Light& light, const Vec3& position, Random& random) const;
    std::optional<LightSample> sample_infinite(const Vec3& normal, Random& random) const;

    const Scene& scene_;
    const ReferenceGeometry& geometry_;
    std::vector<Light> lights_;
    std::vector<double> probability_of_primitive_;
    Vec3 infinite_radiance_;         // where it is the same in all directions,
    const rp_light* sky_ = nullptr;  // and where it is not
    double infinite_probability_ = 0;
};

}  // namespace raypager::reference
