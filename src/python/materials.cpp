// Materials and lights. What textures set, is said where a material comes into a scene (textures.cpp).
#include "raypager/materials.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <algorithm>

#include "python/arrays.hpp"
#include "python/bindings.hpp"

namespace raypager::python {
namespace {

using Color = std::array<float, 3>;

void add_layered(nb::module_& module) {
    module.def("coated_diffuse", [](const Color& color, float ior, float alpha) { return coated_diffuse_material(float3(color), ior, alpha); });
    module.def("coated_conductor", [](const Color& eta, const Color& k, float base_alpha, float ior, float alpha) {
        return coated_conductor_material(float3(eta), float3(k), base_alpha, ior, alpha);
    });
    module.def("glossy",
               [](const Color& color, const Color& specular, float alpha) { return glossy_material(float3(color), float3(specular), alpha); });
    module.def("rough_dielectric", [](float ior, float alpha, const Color& reflected, const Color& refracted) {
        return dielectric_material(ior, alpha, float3(reflected), float3(refracted));
    });
    module.def("sheet", [](const Color& color, const Color& specular, float alpha, float ior, const Color& refracted) {
        rp_material material = glossy_material(float3(color), float3(specular), alpha);
        material.flags |= RP_MATERIAL_THIN | RP_MATERIAL_SMOOTH_REFRACTION;
        material.ior = ior;
        std::copy(refracted.begin(), refracted.end(), material.refracted);
        return material;
    });
    module.def("anisotropic", &anisotropic);
    module.def("with_opacity", &with_opacity);
    module.def("mix", &mix_material);
}

void add_lights(nb::module_& module) {
    const nb::class_<rp_light> light(module, "Light");
    module.def("infinite_light", [](const Color& radiance) { return infinite_light(float3(radiance)); });
    module.def("point_light", [](const Color& position, const Color& intensity) { return point_light(float3(position), float3(intensity)); });
    module.def("distant_light",
               [](const std::array<double, 3>& towards, const Color& irradiance) { return distant_light(towards, float3(irradiance)); });
    module.def("spot_light", [](const Color& position, const std::array<double, 3>& axis, const Color& intensity, double end, double full) {
        return spot_light(float3(position), axis, float3(intensity), end, full);
    });
}

}  // namespace

void add_materials(nb::module_& module) {
    nb::class_<rp_material>(module, "Material").def_prop_ro("kind", [](const rp_material& m) { return m.kind; });
    module.def("diffuse", [](const Color& color) { return diffuse_material(float3(color)); });
    module.def("rough_diffuse", [](const Color& color, double sigma) { return rough_diffuse_material(float3(color), sigma); });
    module.def("translucent", [](const Color& color, const Color& through) { return translucent_material(float3(color), float3(through)); });
    module.def("conductor", [](const Color& eta, const Color& k, float alpha) { return conductor_material(float3(eta), float3(k), alpha); });
    module.def("conductor_of_reflectance", [](const Color& color, float alpha) { return conductor_of_reflectance(float3(color), alpha); });
    module.def("named_metal", [](const std::string& name, float alpha) { return named_metal(name, alpha); });
    module.def("dielectric", [](float ior) { return dielectric_material(ior); });
    module.def("thin_dielectric", &thin_dielectric_material);
    module.def("absorbing", &absorbing_material);
    module.def("clay", &clay_material);
    add_layered(module);
    add_lights(module);
    module.attr("NOTHING") = RP_NONE;
    module.attr("PARAMETER_COLOR") = RP_PARAMETER_COLOR;
    module.attr("PARAMETER_SPECULAR") = RP_PARAMETER_SPECULAR;
    module.attr("PARAMETER_TRANSMITTANCE") = RP_PARAMETER_TRANSMITTANCE;
    module.attr("PARAMETER_ALPHA") = RP_PARAMETER_ALPHA;
    module.attr("PARAMETER_AMOUNT") = RP_PARAMETER_AMOUNT;
    module.attr("PARAMETER_METAL") = RP_PARAMETER_METAL;
    module.attr("PARAMETER_REFRACTED") = RP_PARAMETER_REFRACTED;
    module.attr("PARAMETER_BASE_ALPHA") = RP_PARAMETER_BASE_ALPHA;
    module.attr("PARAMETER_NORMAL") = RP_PARAMETER_NORMAL;
}

}  // namespace raypager::python
