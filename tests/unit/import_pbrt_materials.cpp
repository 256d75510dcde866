// What the materials of pbrt's scenes become.
#include <gtest/gtest.h>

#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "pbrt_fixture.hpp"
#include "raypager/materials.hpp"
#include "scene/check_material.hpp"
#include "scene/octahedral.hpp"
#include "scene/texture_use.hpp"

namespace raypager {
namespace {

class ImportPbrtMaterials : public test::PbrtTest {
protected:
    const std::string ball = " Shape \"sphere\" ";
    Scene silent(const std::string& material) { return expect_silence("WorldBegin " + material + ball); }
    static rp_material last(const Scene& scene) { return scene.materials[scene.shapes.back().material]; }
    rp_material of(const std::string& material) { return last(silent("Material " + material)); }
};

TEST_F(ImportPbrtMaterials, GlossOfVersion3) {
    const rp_material plastic =
        of("\"plastic\" \"rgb Kd\" [.1 .2 .3] \"rgb Ks\" [.4 .5 .6] \"float roughness\" .2 \"bool remaproughness\" \"false\"");
    EXPECT_EQ(plastic.kind, RP_MATERIAL_LAYERED);
    EXPECT_FLOAT_EQ(plastic.color[2], 0.3f);
    EXPECT_FLOAT_EQ(plastic.specular[0], 0.4f);
    EXPECT_FLOAT_EQ(plastic.alpha, 0.2f);
    EXPECT_FLOAT_EQ(plastic.ior, 1.5f);
    const rp_material substrate = of("\"substrate\"");
    EXPECT_EQ(substrate.flags, RP_MATERIAL_BLEND);
    EXPECT_FLOAT_EQ(substrate.specular[1], 0.5f);
    const rp_material leaf = of("\"translucent\" \"rgb Kd\" [.8 .4 .2] \"rgb reflect\" [.25 .25 .25] \"rgb transmit\" [.75 .75 .75]");
    EXPECT_FLOAT_EQ(leaf.color[0], 0.2f);
    EXPECT_FLOAT_EQ(leaf.transmittance[1], 0.3f);
    EXPECT_FLOAT_EQ(leaf.refracted[0], 0.1875f);
    const rp_material uber = of("\"uber\" \"rgb Kr\" [.5 .5 .5] \"rgb Kt\" [.1 .2 .3] \"float eta\" 1.3");
    EXPECT_FLOAT_EQ(uber.mirror[0], 0.5f);
    EXPECT_FLOAT_EQ(uber.refracted[2], 0.3f);
    EXPECT_FLOAT_EQ(uber.ior, 1.3f);
    EXPECT_TRUE(uber.flags & RP_MATERIAL_SMOOTH_REFRACTION);
    const Scene veil = silent("Material \"uber\" \"rgb opacity\" [.3 .3 .3]");
    EXPECT_EQ(last(veil).kind, RP_MATERIAL_MIX);
    EXPECT_FLOAT_EQ(last(veil).amount, 0.3f);
    EXPECT_EQ(veil.materials[last(veil).second].kind, RP_MATERIAL_LAYERED);
}

TEST_F(ImportPbrtMaterials, GlassAndLayersOfVersion4) {
    EXPECT_EQ(of("\"dielectric\" \"float eta\" 1.4").kind, RP_MATERIAL_DIELECTRIC);
    const rp_material rough = of("\"dielectric\" \"float roughness\" .04");
    EXPECT_EQ(rough.kind, RP_MATERIAL_LAYERED);
    EXPECT_FLOAT_EQ(rough.alpha, 0.2f);
    EXPECT_TRUE(rough.flags & RP_MATERIAL_SOLID);
    const rp_material green = of("\"glass\" \"rgb Kt\" [.3 .8 .2]");
    EXPECT_FLOAT_EQ(green.refracted[1], 0.8f);
    EXPECT_EQ(green.alpha, 0);
    EXPECT_TRUE(of("\"thindielectric\"").flags & RP_MATERIAL_THIN);
    const rp_material coat = of("\"coateddiffuse\" \"rgb reflectance\" [.2 .2 .2] \"float roughness\" .01 \"float thickness\" .02");
    EXPECT_EQ(coat.flags, RP_MATERIAL_COAT);
    EXPECT_FLOAT_EQ(coat.alpha, 0.1f);
    EXPECT_NEAR(coat.internal, 0.5964, 1e-3) << "Egan and Hilgeman 1973, for an index of 1.5";
    const rp_material metal =
        of("\"coatedconductor\" \"float conductor.roughness\" .09 \"spectrum conductor.eta\" \"metal-Au-eta\" \"spectrum conductor.k\" "
           "\"metal-Au-k\" \"float interface.eta\" 1.4");
    EXPECT_EQ(metal.flags, RP_MATERIAL_COAT | RP_MATERIAL_METAL_BASE);
    EXPECT_FLOAT_EQ(metal.base_alpha, 0.3f);
    EXPECT_FLOAT_EQ(metal.ior, 1.4f);
    const rp_material leaf = of("\"diffusetransmission\" \"rgb transmittance\" [.2 .8 .9] \"float scale\" .5");
    EXPECT_FLOAT_EQ(leaf.transmittance[1], 0.4f);
    EXPECT_FLOAT_EQ(leaf.color[0], 0.125f);
    EXPECT_LT(of("\"diffuse\" \"float sigma\" 20").oren_a, 0);
    expect_warning("WorldBegin Material \"coateddiffuse\" \"rgb albedo\" [.5 .5 .5]" + ball, "a coat that scatters is not supported");
    expect_error("WorldBegin Material \"coateddiffuse\" \"float eta\" .5" + ball, "at least 1");
    expect_error("WorldBegin\nMaterial \"thindielectric\" \"float eta\" 1000" + ball,
                 "scene.pbrt:2:1: Material: material 1: the index of refraction must be");
}

TEST_F(ImportPbrtMaterials, RoughnessInTwoDirections) {
    const rp_material metal = of("\"conductor\" \"float uroughness\" .16 \"float vroughness\" .01");
    EXPECT_FLOAT_EQ(metal.alpha, 0.4f);
    EXPECT_FLOAT_EQ(RP_ALPHA_ACROSS(metal), 0.1f);
    const rp_material same = of("\"conductor\" \"float uroughness\" .16 \"float vroughness\" .16");
    EXPECT_FLOAT_EQ(same.alpha, 0.4f);
    EXPECT_EQ(RP_ALPHA_ACROSS(same), 0);
    // Where one is not given, it is `roughness`; and a smooth direction is not quite.
    const rp_material one = of("\"dielectric\" \"float uroughness\" .04");
    EXPECT_EQ(one.kind, RP_MATERIAL_LAYERED);
    EXPECT_FLOAT_EQ(one.alpha, 0.2f);
    EXPECT_FLOAT_EQ(RP_ALPHA_ACROSS(one), 1e-4f);
    const rp_material other = of("\"dielectric\" \"float roughness\" .01 \"float vroughness\" .04");
    EXPECT_FLOAT_EQ(other.alpha, 0.1f);
    EXPECT_FLOAT_EQ(RP_ALPHA_ACROSS(other), 0.2f);
    EXPECT_EQ(of("\"dielectric\" \"float uroughness\" 1e-8 \"float vroughness\" 0").kind, RP_MATERIAL_DIELECTRIC);
    const rp_material substrate = of("\"substrate\" \"float uroughness\" .3 \"float vroughness\" .2 \"bool remaproughness\" \"false\"");
    EXPECT_FLOAT_EQ(substrate.alpha, 0.3f);
    EXPECT_FLOAT_EQ(RP_ALPHA_ACROSS(substrate), 0.2f);
    const rp_material coat = of("\"coateddiffuse\" \"float uroughness\" .01 \"float vroughness\" .04");
    EXPECT_FLOAT_EQ(coat.alpha, 0.1f);
    EXPECT_FLOAT_EQ(RP_ALPHA_ACROSS(coat), 0.2f);
    for (const char* reflectance : {"", "\"rgb reflectance\" [.5 .5 .5] "}) {
        const rp_material both =
            of("\"coatedconductor\" \"float interface.uroughness\" .01 \"float interface.vroughness\" .04 \"float conductor.uroughness\" .09 "
               "\"float conductor.vroughness\" .16 " +
               std::string(reflectance));
        EXPECT_FLOAT_EQ(both.alpha, 0.1f);
        EXPECT_FLOAT_EQ(RP_ALPHA_ACROSS(both), 0.2f);
        EXPECT_FLOAT_EQ(both.base_alpha, 0.3f);
        EXPECT_FLOAT_EQ(RP_BASE_ALPHA_ACROSS(both), 0.4f);
    }
}

TEST_F(ImportPbrtMaterials, TexturesOfRoughnessInTwoDirections) {
    const std::string textures =
        "Texture \"a\" \"float\" \"checkerboard\" \"float tex1\" .1 \"float tex2\" .3 Texture \"b\" \"float\" \"checkerboard\" \"float tex1\" .2 ";
    const auto parameters = [&](const std::string& material) {
        const Scene s = silent(textures + "Material " + material);
        std::vector<uint32_t> set;
        for (size_t i = (last(s).flags >> RP_MATERIAL_PROGRAM_SHIFT) - 1; i < s.texture_ops.size(); ++i) {
            const rp_texture_op& op = s.texture_ops[i];
            if ((op.op & RP_TEXTURE_OPERATION_MASK) == RP_TEXTURE_SET) set.push_back(op.image);
            if (op.op & RP_TEXTURE_LAST) break;
        }
        return set;
    };
    using Parameters = std::vector<uint32_t>;
    EXPECT_EQ(parameters("\"conductor\" \"texture roughness\" \"a\""), Parameters{RP_PARAMETER_ALPHA});
    EXPECT_EQ(parameters("\"conductor\" \"texture uroughness\" \"a\" \"texture vroughness\" \"a\""), Parameters{RP_PARAMETER_ALPHA});
    EXPECT_EQ(parameters("\"conductor\" \"texture uroughness\" \"a\" \"texture vroughness\" \"b\""),
              (Parameters{RP_PARAMETER_ALPHA, RP_PARAMETER_ALPHA_ACROSS}));
    EXPECT_EQ(parameters("\"dielectric\" \"texture vroughness\" \"a\""), Parameters{RP_PARAMETER_ALPHA_ACROSS});
    EXPECT_EQ(parameters("\"coatedconductor\" \"texture conductor.uroughness\" \"a\" \"texture conductor.vroughness\" \"b\""),
              (Parameters{RP_PARAMETER_BASE_ALPHA, RP_PARAMETER_BASE_ALPHA_ACROSS}));
    const rp_material glass = last(silent(textures + "Material \"dielectric\" \"texture vroughness\" \"a\""));
    EXPECT_FLOAT_EQ(glass.alpha, 1e-4f);
    EXPECT_NEAR(RP_ALPHA_ACROSS(glass), std::sqrt(0.2f), 1e-6);
}

// Spheres about one axis share a material; it says which axis that is.
TEST_F(ImportPbrtMaterials, BrushedSpheresHaveAnAxis) {
    const Scene s = expect_silence("WorldBegin Material \"conductor\" \"float uroughness\" .1" + ball + "Translate 3 0 0 Scale 2 2 2" + ball +
                                   "Rotate 90 1 0 0" + ball + "Scale 1 2 1" + ball);
    ASSERT_EQ(s.shapes.size(), 4u);
    const auto axis = [&](size_t shape) { return decode_octahedral(~RP_SPHERE_AXIS(s.materials[s.shapes[shape].material])); };
    EXPECT_EQ(s.shapes[0].material, s.shapes[1].material);
    EXPECT_EQ(axis(0), (Float3{0, 0, 1}));
    EXPECT_EQ(axis(2), (Float3{0, -1, 0}));
    EXPECT_EQ(RP_SPHERE_AXIS(s.materials[s.shapes[3].material]), 0u) << "a mesh, which has uv";
    EXPECT_TRUE(wants_uvs(s, s.shapes[3]));
    EXPECT_FALSE(wants_uvs(silent("Material \"conductor\" \"float roughness\" .1 Scale 1 2 1"), s.shapes[3]));
}

// One that no surface can have is found, wherever it comes from.
TEST_F(ImportPbrtMaterials, RoughnessIsChecked) {
    const auto fault = [](const rp_material& m) { return check_material(std::span(&m, 1), 0).message(); };
    const rp_material metal = conductor_of_reflectance({0.5f, 0.5f, 0.5f}, 0.2f),
                      coat = coated_conductor_material({1, 1, 1}, {1, 1, 1}, 0.2f, 1.5f, 0.1f);
    EXPECT_EQ(fault(anisotropic(metal, 1)), "");
    EXPECT_EQ(fault(anisotropic(coat, 0.3f, 1)), "");
    EXPECT_NE(fault(anisotropic(metal, 1.1f)), "");
    EXPECT_NE(fault(anisotropic(coat, 0, -0.1f)), "");
    EXPECT_NE(fault(anisotropic(coat, NAN)), "");
    EXPECT_NE(fault(anisotropic(conductor_of_reflectance({1, 1, 1}, 0), 0.2f)), "");
}

TEST_F(ImportPbrtMaterials, Mixes) {
    const std::string parts = "MakeNamedMaterial \"a\" \"string type\" \"matte\" MakeNamedMaterial \"b\" \"string type\" \"mirror\" ";
    const Scene mixed = silent(parts + "Material \"mix\" \"string materials\" [\"a\" \"b\"] \"float amount\" .25");
    EXPECT_EQ(last(mixed).kind, RP_MATERIAL_MIX);
    EXPECT_FLOAT_EQ(last(mixed).amount, 0.25f);
    EXPECT_EQ(mixed.materials[last(mixed).first].kind, RP_MATERIAL_DIFFUSE);
    EXPECT_EQ(mixed.materials[last(mixed).second].kind, RP_MATERIAL_CONDUCTOR);
    std::string nested = parts;
    std::string inner = "a";
    for (int i = 0; i < 5; ++i) {
        const std::string name = "m" + std::to_string(i);
        nested += "MakeNamedMaterial \"" + name + "\" \"string type\" \"mix\" \"string materials\" [\"" + inner + "\" \"b\"] ";
        inner = name;
        if (i == 3) silent(nested + "NamedMaterial \"" + name + "\"");
    }
    expect_warning("WorldBegin " + nested + "NamedMaterial \"" + inner + "\"" + ball, "more than 4 times within another");
    expect_warning("WorldBegin Material \"mix\" \"string materials\" [\"x\" \"interface\"]" + ball, "there is no material \"x\"");
}

// A light without a surface lets rays through.
TEST_F(ImportPbrtMaterials, LightsWithoutASurface) {
    const rp_material m = last(silent("Material \"none\" AreaLightSource \"diffuse\""));
    EXPECT_EQ(m.kind, RP_MATERIAL_LAYERED);
    EXPECT_EQ(m.refracted[0], 1);
}

}  // namespace
}  // namespace raypager
