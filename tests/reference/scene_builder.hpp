// Puts test scenes together.
#pragma once

#include <random>
#include <string>

#include "raypager/picture.hpp"
#include "reference/mesh_shapes.hpp"
#include "reference/scenes.hpp"

namespace raypager::reference {

rp_material diffuse(const Vec3& reflectance);
rp_material conductor(const Vec3& eta, const Vec3& k, double alpha);
rp_material glass(double ior);
rp_material absorber();

class SceneBuilder {
public:
    explicit SceneBuilder(PictureSize size);

    uint32_t material(const rp_material& material);
    void camera(const Vec3& eye, const Vec3& target, const Vec3& up, double fov_degrees);
    Camera& camera() { return scene_.camera; }
    Scene& scene() { return scene_; }
    void filter(const PixelFilter& filter) { scene_.filter = filter; }
    Shape& add(std::string name, TriangleMesh mesh, uint32_t material, const Transform& to_world = {});
    Shape& add_sphere(std::string name, const Vec3& center, double radius, uint32_t material);
    Shape& add_points(std::string name, std::vector<CloudPoint> points, bool has_color, uint32_t material);
    void shine(Shape& shape, const Vec3& radiance, bool two_sided = false);
    void infinite_light(const Vec3& radiance);
    void distant_light(const Vec3& towards_light, const Vec3& irradiance);
    void unseen_light(const rp_light& light);  // scene/emitters.hpp
    void point_light(const Vec3& position, const Vec3& intensity);
    void sky(const Image& image, const std::array<Float3, 3>& axes);
    void lamp(rp_light light, const Image* image = nullptr);  // image: or none
    Scene finish();                                           // validated

private:
    Scene scene_;
};

// Numbers that do not depend on the standard library.
class Dice {
public:
    explicit Dice(uint64_t seed) : engine_(seed) {}
    double between(double low, double high) { return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53); }
    uint32_t below(uint32_t n) { return static_cast<uint32_t>(engine_() % n); }
    Vec3 point(double low, double high) {
        const double x = between(low, high), y = between(low, high), z = between(low, high);
        return {x, y, z};
    }

private:
    std::mt19937_64 engine_;
};

}  // namespace raypager::reference
