// Which texture programs may be run.
#include <gtest/gtest.h>

#include <cmath>

#include "scene/check_texture.hpp"

namespace raypager {
namespace {

rp_texture_op op_of(uint32_t op, uint32_t image = 0, uint32_t lookup = 0, uint32_t map = RP_NONE) { return {op, image, lookup, map, {}, {}}; }

class TextureProgramsCheck : public ::testing::Test {
protected:
    void SetUp() override {
        maps_ = {{RP_MAP_POINT, 0, {}, {}, {}, {}}};
        ops_ = {op_of(RP_TEXTURE_IMAGE | RP_TEXTURE_INVERT | 6u << RP_TEXTURE_CHANNEL_SHIFT | 15u << RP_TEXTURE_WRAP_SHIFT, 1, 0, 0),
                op_of(RP_TEXTURE_IMAGE, 2, 1),
                op_of(RP_TEXTURE_CHECKS | RP_TEXTURE_SOLID, 0, 0, 0),
                op_of(RP_TEXTURE_SET, RP_PARAMETER_COLOR),
                op_of(RP_TEXTURE_CONSTANT),
                op_of(RP_TEXTURE_SET | RP_TEXTURE_LAST, RP_PARAMETER_ALPHA),
                op_of(RP_TEXTURE_MARBLE),
                op_of(RP_TEXTURE_SET | RP_TEXTURE_LAST, RP_PARAMETER_NORMAL)};
        ops_[6].a[0] = 8;
        materials_.resize(3);
        materials_[1].flags = RP_MATERIAL_METAL_BASE | 1u << RP_MATERIAL_PROGRAM_SHIFT;
        materials_[2].flags = 7u << RP_MATERIAL_PROGRAM_SHIFT;
    }
    Status check() const {
        return check_textures({ops_, maps_, materials_, 3, [](uint32_t image) { return image == 1 ? 1u : 2u; }});
    }
    // With a change, which is taken back.
    template <class Change>
    void expect_refused(const Change& change, const std::string& words) {
        const auto ops = ops_;
        const auto maps = maps_;
        const auto materials = materials_;
        change();
        const Status status = check();
        EXPECT_FALSE(status.ok()) << words;
        EXPECT_NE(status.message().find(words), std::string::npos) << status.message();
        ops_ = ops, maps_ = maps, materials_ = materials;
    }

    std::vector<rp_texture_op> ops_;
    std::vector<rp_texture_map> maps_;
    std::vector<rp_material> materials_;
};

TEST_F(TextureProgramsCheck, GoodOnesMayRun) {
    EXPECT_TRUE(check().ok()) << check().message();
    EXPECT_EQ(program_of(materials_[0]), RP_NONE);
    EXPECT_EQ(program_of(materials_[1]), 0u);
    EXPECT_EQ(program_of(materials_[2]), 6u);
    // The same place of an image may be read twice, and one channel or another of it.
    ops_[1] = ops_[0];
    ops_[1].op = RP_TEXTURE_IMAGE | 15u << RP_TEXTURE_WRAP_SHIFT;
    EXPECT_TRUE(check().ok()) << check().message();
}

// Some lie in a field that means something else in other materials.
TEST_F(TextureProgramsCheck, ParametersAreThoseOfTheMaterial) {
    ops_[3].image = RP_PARAMETER_AMOUNT;
    EXPECT_NE(check().message().find("material 1 an operation sets what only a mix has"), std::string::npos) << check().message();
    materials_[1].kind = RP_MATERIAL_MIX;
    expect_refused([&] { ops_[3].image = RP_PARAMETER_COLOR; }, "only a mix has");
    ops_[5].image = RP_PARAMETER_AMOUNT;
    EXPECT_TRUE(check().ok()) << check().message();
    ops_[3].image = RP_PARAMETER_COLOR, ops_[5].image = RP_PARAMETER_ALPHA_ACROSS;
    for (const uint32_t kind : {RP_MATERIAL_DIFFUSE, RP_MATERIAL_CONDUCTOR, RP_MATERIAL_LAYERED}) {
        materials_[1].kind = kind;
        RP_ALPHA_ACROSS(materials_[1]) = 0;
        EXPECT_NE(check().message().find("has none"), std::string::npos) << kind;
        RP_ALPHA_ACROSS(materials_[1]) = 0.5f;
        EXPECT_EQ(check().ok(), kind != RP_MATERIAL_DIFFUSE) << kind;
    }
    ops_[5].image = RP_PARAMETER_BASE_ALPHA_ACROSS;
    EXPECT_FALSE(check().ok());
    RP_BASE_ALPHA_ACROSS(materials_[1]) = 0.5f;
    EXPECT_TRUE(check().ok()) << check().message();
    materials_[1].flags &= ~RP_MATERIAL_METAL_BASE;
    EXPECT_FALSE(check().ok());
}

TEST_F(TextureProgramsCheck, OthersMayNot) {
    expect_refused([&] { ops_[4].op = RP_TEXTURE_OPERATIONS; }, "unknown");
    expect_refused([&] { ops_[4].op |= RP_TEXTURE_INVERT; }, "unknown flags");
    expect_refused([&] { ops_[4].op |= 1u << 30; }, "unknown flags");
    expect_refused([&] { ops_[0].op |= 7u << RP_TEXTURE_CHANNEL_SHIFT; }, "unknown channel");
    expect_refused([&] { ops_[0].image = 3; }, "an image that does not exist");
    expect_refused([&] { ops_[0].map = 1; }, "coordinates that do not exist");
    expect_refused([&] { ops_[6].map = 1; }, "coordinates that do not exist");
    expect_refused([&] { ops_[4].a[3] = INFINITY; }, "not finite");
    expect_refused([&] { ops_[4].b[0] = NAN; }, "not finite");
    expect_refused([&] { ops_[6].a[0] = 1e9f; }, "octaves");
    expect_refused([&] { ops_[6].a[0] = -1; }, "octaves");
    expect_refused([&] { ops_[3].image = RP_PARAMETERS; }, "unknown parameter");
    expect_refused([&] { ops_[2].op = RP_TEXTURE_MIX; }, "more off the stack");
    expect_refused([&] { ops_.insert(ops_.begin(), RP_TEXTURE_STACK, op_of(RP_TEXTURE_CONSTANT)); }, "more on the stack");
    expect_refused([&] { ops_[7].op = RP_TEXTURE_SET; }, "no end");
    expect_refused([&] { ops_[5].op = RP_TEXTURE_SET; }, "does not exist");  // the programs are one, and material 2 begins within
    expect_refused([&] { ops_[1].lookup = 0; }, "two texels");
    expect_refused([&] { ops_[1].lookup = RP_TEXEL_WORDS; }, "out of reach");
    expect_refused([&] { ops_[1].lookup = UINT32_MAX; }, "out of reach");
    expect_refused([&] { materials_[1].flags = 2u << RP_MATERIAL_PROGRAM_SHIFT; }, "material 1");
    expect_refused([&] { materials_[2].flags = 0xffffffu << RP_MATERIAL_PROGRAM_SHIFT; }, "material 2");
    expect_refused([&] { maps_[0].kind = 4; }, "unknown kind");
    expect_refused([&] { maps_[0].m[11] = NAN; }, "not finite");
    expect_refused([&] { maps_[0].offset[1] = INFINITY; }, "not finite");
}

}  // namespace
}  // namespace raypager
