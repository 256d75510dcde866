#include "reference/path_tracer.hpp"

#include <atomic>
#include <thread>
#include <vector>

#include "reference/bsdf.hpp"
#include "reference/camera.hpp"
#include "reference/lights.hpp"
#include "reference/textures.hpp"

namespace raypager::reference {
namespace {

constexpr uint32_t roulette_depth = 8;  // no path ends by chance before

class PathTracer {
public:
    PathTracer(const Scene& scene, const ReferenceGeometry& geometry, uint32_t max_depth)
        : scene_(scene), geometry_(geometry), lights_(scene, geometry), textures_(scene), max_depth_(max_depth) {
        const bool empty = !(geometry.lower().x <= geometry.upper().x);
        const double extent = empty ? 0 : std::max(max_magnitude(geometry.lower()), max_magnitude(geometry.upper()));
        // Lifts origins off their surface by some float steps of the largest coordinate: origins are rounded to float on the way to
        // Embree, and its triangle test subtracts vertices in float.
        offset_ = 0x1p-19 * std::max(extent, max_magnitude(Vec3(scene.camera.eye)));
    }

    Vec3 radiance(const Vec3& eye, const Vec3& towards, Random& random) const;

private:
    // Where a path's last scattering event was, for the weight of lights that its next ray meets.
    struct LastScatter {
        Vec3 normal;
        double pdf = 0;
        bool specular = true;  // also for the camera: no light was sampled there
    };

    ScatterPoint scatter_point(const Hit& hit, const Vec3& direction, const rp_material& material) const;
    Vec3 tangent_at(const Hit& hit, const rp_material& material) const;
    Vec3 lifted(const Vec3& position, const Vec3& normal, const Vec3& towards) const;
    Vec3 direct_light(const rp_material& material, const ScatterPoint& point, const Vec3& position, Random& random) const;
    bool visible(const LightSample& light, const Vec3& position, const Vec3& normal, Random& random) const;
    std::optional<rp_material> material_at(const Hit& hit, Random& random) const;
    Hit closest(Ray ray, std::optional<rp_material>& material, Random& random) const;

    const Scene& scene_;
    const ReferenceGeometry& geometry_;
    Lights lights_;
    ReferenceTextures textures_;
    uint32_t max_depth_;
    double offset_;
};

// The balance heuristic's weight of a sample drawn with density a, where density b could have drawn it as well.
double balance(double a, double b) { return a / (a + b); }

Vec3 PathTracer::radiance(const Vec3& eye, const Vec3& towards, Random& random) const {
    Vec3 origin = eye, direction = towards, light, throughput(1);
    LastScatter last;
    for (uint32_t depth = 0;; depth++) {
        std::optional<rp_material> found;
        const Hit hit = closest({origin.to_float(), direction.to_float()}, found, random);
        if (!hit.found()) {
            const double weight = last.specular ? 1 : balance(last.pdf, lights_.pdf_of_infinite(last.normal, direction));
            return light + throughput * lights_.infinite_radiance(direction) * weight;
        }
        const Vec3 position = geometry_.position(hit);
        if (const Vec3 emitted = lights_.emitted(hit, direction); !is_black(emitted)) {
            const double distance = length(position - origin);
            light += throughput * emitted * (last.specular ? 1 : balance(last.pdf, lights_.pdf_of_hit(hit, direction, distance)));
        }
        if (depth == max_depth_) return light;

        const rp_material& material = *found;
        const ScatterPoint point = scatter_point(hit, direction, material);
        if (!is_specular(material)) light += throughput * direct_light(material, point, position, random);

        const std::optional<ScatterSample> next = sample(material, point, random);
        if (!next) return light;
        throughput *= next->weight;
        if (is_black(throughput)) return light;
        if (depth >= roulette_depth) {
            const double survival = std::min(0.95, max_component(throughput));
            if (random.uniform() >= survival) return light;
            throughput *= 1 / survival;
        }
        last = {.normal = point.geometric_normal, .pdf = next->pdf, .specular = next->specular};
        origin = lifted(position, point.geometric_normal, next->wi);
        direction = next->wi;
    }
}

// What is there, or nothing.
std::optional<rp_material> PathTracer::material_at(const Hit& hit, Random& random) const {
    const Float2 uv = geometry_.uv(hit);
    const TextureSite site = {geometry_.position(hit), hit.normal, uv.x, uv.y};
    uint32_t number = scene_.shapes[geometry_.shape_of(hit.primitive)].material;
    for (;;) {
        if (number == RP_NONE) return std::nullopt;
        const rp_material material = textures_.at(scene_.materials[number], site);
        if (material.kind != RP_MATERIAL_MIX) return material;
        number = random.uniform() < double{material.amount} ? material.second : material.first;
    }
}

// The first hit where there is something.
Hit PathTracer::closest(Ray ray, std::optional<rp_material>& material, Random& random) const {
    for (;;) {
        const Hit hit = geometry_.closest(ray);
        if (!hit.found()) return hit;
        if (ray.tmax < hit.t) return {};
        material = material_at(hit, random);
        if (material) return hit;
        const Vec3 direction(ray.direction), position = geometry_.position(hit);
        ray.origin = lifted(position, hit.normal, direction).to_float();
        // Not farther than to the front of the lamp, although it begins a little higher now.
        if (std::isfinite(ray.tmax)) ray.tmax -= static_cast<float>(hit.t + 2 * offset_ / length(direction));
    }
}

// Around a sphere u grows about the z axis of its shape, if its material is meant for that.
Vec3 PathTracer::tangent_at(const Hit& hit, const rp_material& material) const {
    if (!geometry_.is_sphere(hit.primitive) || RP_SPHERE_AXIS(material) == 0) return geometry_.tangent(hit);
    return cross(Vec3(scene_.shapes[geometry_.shape_of(hit.primitive)].to_world.vector(0, 0, 1)), hit.normal);
}

ScatterPoint PathTracer::scatter_point(const Hit& hit, const Vec3& direction, const rp_material& material) const {
    ScatterPoint point{.wo = -direction, .geometric_normal = hit.normal, .shading_normal = geometry_.shading_normal(hit)};
    point.tangent = tangent_at(hit, material);
    point.outside = dot(hit.normal, point.wo) > 0;
    if (!point.outside) point.geometric_normal = -hit.normal;
    if (dot(point.shading_normal, point.geometric_normal) < 0) point.shading_normal = -point.shading_normal;
    // Where interpolation turned the normal away from the viewer, the geometric one serves.
    if (dot(point.shading_normal, point.wo) <= 0) point.shading_normal = point.geometric_normal;
    return point;
}

Vec3 PathTracer::lifted(const Vec3& position, const Vec3& normal, const Vec3& towards) const {
    return position + normal * (dot(normal, towards) > 0 ? offset_ : -offset_);
}

// Next-event estimation: one light, weighted against the chance that sampling the surface finds it.
Vec3 PathTracer::direct_light(const rp_material& material, const ScatterPoint& point, const Vec3& position, Random& random) const {
    if (!lights_.any()) return {};
    const std::optional<LightSample> light = lights_.sample(position, point.geometric_normal, random);
    if (!light || (material.kind == RP_MATERIAL_LAYERED && !light->delta)) return {};
    const Vec3 scattered = evaluate(material, point, light->wi);
    if (is_black(scattered) || !visible(*light, position, point.geometric_normal, random)) return {};
    const double weight = light->delta ? 1 : balance(light->pdf, pdf(material, point, light->wi));
    return scattered * light->radiance * (weight / light->pdf);
}

bool PathTracer::visible(const LightSample& light, const Vec3& position, const Vec3& normal, Random& random) const {
    std::optional<rp_material> ignored;
    const Vec3 origin = lifted(position, normal, light.wi);
    if (light.distance == infinity) return !closest({origin.to_float(), light.wi.to_float()}, ignored, random).found();
    const Vec3 target = light.target + light.target_normal * offset_;
    return !closest({origin.to_float(), (target - origin).to_float(), 1}, ignored, random).found();
}

void trace_row(const PathTracer& tracer, const Scene& scene, const ReferenceSettings& settings, uint32_t row, Image& image) {
    std::seed_seq mixed{static_cast<uint32_t>(settings.seed), static_cast<uint32_t>(settings.seed >> 32), row};
    uint32_t words[2];
    mixed.generate(words, words + 2);
    Random random(uint64_t{words[1]} << 32 | words[0]);
    for (uint32_t column = 0; column < image.width; column++) {
        Vec3 sum;
        for (uint32_t i = 0; i < settings.spp; i++) {
            const CameraRay ray = camera_ray(scene, column, row, image.width, image.height, random);
            sum += tracer.radiance(ray.origin, ray.direction, random);
        }
        const Float3 mean = (sum / settings.spp).to_float();
        float* pixel = &image.values[3 * (size_t{row} * image.width + column)];
        pixel[0] = mean.x, pixel[1] = mean.y, pixel[2] = mean.z;
    }
}

}  // namespace

Result<Image> trace_reference(const Scene& scene, const ReferenceSettings& settings) {
    const Result<std::shared_ptr<const ReferenceGeometry>> geometry = ReferenceGeometry::build(scene);
    if (!geometry.ok()) return geometry.status();
    return trace_reference(scene, **geometry, settings);
}

Image trace_reference(const Scene& scene, const ReferenceGeometry& geometry, const ReferenceSettings& settings) {
    const PathTracer tracer(scene, geometry, settings.max_depth);
    Image image;
    image.width = settings.width ? settings.width : scene.width;
    image.height = settings.height ? settings.height : scene.height;
    image.values.resize(size_t{3} * image.width * image.height);
    std::atomic<uint32_t> next_row = 0;
    const auto work = [&] {
        for (uint32_t row = next_row++; row < image.height; row = next_row++) trace_row(tracer, scene, settings, row, image);
    };
    std::vector<std::jthread> others;
    for (uint32_t i = 1; i < settings.threads; i++) others.emplace_back(work);
    work();
    others.clear();
    return image;
}

}  // namespace raypager::reference
