// Judges the hits that a ray tracer in float precision reports. Where they differ from the exact ones, rounding must be the reason:
// a reported hit has to lie on its primitive within the tolerance, and a surface may be passed over only if the ray, moved by no
// more than the tolerance, really passes by it. So a ray that slips through the edge that two triangles share is never excused.
// A ray in the plane of a triangle meets it anywhere or nowhere, as far as float can tell; that is counted by itself.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "reference/geometry.hpp"

namespace raypager::reference {

enum class Agreement {
    same,      // same primitive, same distance; or neither hits
    tie,       // another primitive at the same distance: shared edges, surfaces that coincide
    rounding,  // differs where a ray within the tolerance does so rightly: silhouettes, grazing rays, starts on surfaces
    flat,      // the ray runs along the triangle's plane, or the triangle is a needle: rounding decides where they meet
    wrong,
};
inline constexpr std::array all_agreements = {Agreement::same, Agreement::tie, Agreement::rounding, Agreement::flat, Agreement::wrong};
const char* name(Agreement agreement);

class HitAudit {
public:
    // tolerance: relative to the largest coordinate of ray origin and hit; 2^-21 is 8 rounding steps of float.
    explicit HitAudit(const ReferenceGeometry& geometry, double tolerance = 0x1p-21);

    // expected: of closest() or closest_brute_force(); exact hits are found in double precision where the claim differs.
    // claimed: primitive (RP_NONE: no hit) and t are looked at.
    Agreement closest(const Ray& ray, const Hit& expected, const Hit& claimed);
    Agreement occluded(const Ray& ray, bool expected, bool claimed);

    uint64_t count(Agreement agreement) const { return counts_[static_cast<size_t>(agreement)]; }
    // Counts, and a line for each of the first differences: all wrong ones before those excused.
    std::string report() const;

private:
    struct Ball {  // around a primitive; radius negative if it cannot be hit
        Vec3 center;
        double radius = -1;
    };

    std::vector<uint32_t> near(const Ray& ray) const;
    Hit exact_closest(const Ray& ray, const std::vector<uint32_t>& near) const;
    Agreement judge_closest(const Ray& ray, const std::vector<uint32_t>& near, const Hit& exact, const Hit& claimed) const;
    Agreement judge_occluded(const Ray& ray, const std::vector<uint32_t>& near, const Hit& exact, bool claimed) const;
    bool agrees(const Ray& ray, const Hit& exact, const Hit& claimed) const;
    bool lies_on_primitive(const Ray& ray, const Hit& hit) const;
    bool meets_flatly(const Ray& ray, const Hit& hit) const;
    bool passes_when_moved(const Ray& ray, const std::vector<uint32_t>& near, double margin, double beyond) const;
    double margin(const Ray& ray, uint32_t primitive) const;
    Agreement count_as(Agreement agreement);
    Agreement note(Agreement agreement, const Ray& ray, const std::string& what);

    const ReferenceGeometry& geometry_;
    double tolerance_;
    std::vector<Ball> balls_;
    std::array<uint64_t, all_agreements.size()> counts_{};
    std::vector<std::string> wrong_, excused_;
};

// Of a point, and of the points of a ray, from the surface of a primitive.
double distance_to_primitive(const ReferenceGeometry& geometry, uint32_t primitive, const Vec3& point);
double distance_to_primitive(const ReferenceGeometry& geometry, uint32_t primitive, const Ray& ray);

}  // namespace raypager::reference
