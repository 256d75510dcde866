// Programs of textures on the device (kernels/shading/texture.cl) against the reference tracer's, which are of double precision; and what a path
// keeps while it waits for pages.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <random>

#include "raypager/image_source.hpp"
#include "reference/textures.hpp"
#include "scene/check_texture.hpp"
#include "scene/image_levels.hpp"
#include "support/texture_probe.hpp"
#include "support/textured_scene.hpp"

namespace raypager {
namespace {

using reference::ReferenceTextures;
using reference::Vec3;
using support::ProgramSite;
using support::SlotTexels;

// Makes programs that take no more off the stack than is there, and put no more on it than it holds.
class ProgramMaker {
public:
    ProgramMaker(Scene& scene, uint32_t seed) : scene_(scene), random_(seed) {}

    // deep: fills the stack first.
    void add_program(bool deep) {
        rp_material m = {};
        m.kind = random_() % 8 == 0 ? RP_MATERIAL_MIX : RP_MATERIAL_LAYERED;
        m.flags = static_cast<uint32_t>(scene_.texture_ops.size() + 1) << RP_MATERIAL_PROGRAM_SHIFT;
        if (m.kind == RP_MATERIAL_LAYERED) {
            m.flags |= RP_MATERIAL_METAL_BASE;
            RP_ALPHA_ACROSS(m) = RP_BASE_ALPHA_ACROSS(m) = 0.5f;
        }
        scene_.materials.push_back(m);
        lookup_ = size_ = 0;
        while (deep && size_ < RP_TEXTURE_STACK) add_leaf();
        const size_t length = scene_.texture_ops.size() + 6 + random_() % 20;
        while (scene_.texture_ops.size() < length || size_ > 1) add_any(scene_.texture_ops.size() < length);
        if (size_ == 0) add_leaf();
        add_set();
        scene_.texture_ops.back().op |= RP_TEXTURE_LAST;
    }
    float share() { return std::uniform_real_distribution<float>(0, 1)(random_); }
    // A multiple of 1/64 that is none of 1/32: exact in either precision, and no whole number after the maps here.
    float coordinate() { return (2.0f * static_cast<float>(random_() % 257) - 255) / 64; }
    Vec3 direction() {
        std::normal_distribution<double> along;
        return reference::normalized(Vec3(along(random_), along(random_), along(random_)));
    }

private:
    rp_texture_op& add(uint32_t op) {
        const auto map = random_() % (scene_.texture_maps.size() + 1);
        scene_.texture_ops.push_back({op, 0, 0, map == 0 ? RP_NONE : static_cast<uint32_t>(map - 1), {share(), share(), share(), 0}, {}});
        return scene_.texture_ops.back();
    }
    void add_leaf() {
        const uint32_t kind = random_() % 4;
        if (kind == 0 || (kind > 1 && lookup_ + 2 > RP_TEXEL_WORDS)) {
            add(RP_TEXTURE_CONSTANT);
        } else if (kind == 1) {
            add(RP_TEXTURE_UV);
        } else {
            constexpr uint32_t wraps[] = {RP_WRAP_REPEAT, RP_WRAP_CLAMP, RP_WRAP_MIRROR};  // of a black one filters would matter
            const uint32_t image = static_cast<uint32_t>(random_() % scene_.images.size());
            rp_texture_op& op =
                add(RP_TEXTURE_IMAGE | static_cast<uint32_t>(random_() % 7) << RP_TEXTURE_CHANNEL_SHIFT |
                    (wraps[random_() % 3] | wraps[random_() % 3] << 2) << RP_TEXTURE_WRAP_SHIFT | (random_() % 2 ? RP_TEXTURE_INVERT : 0u));
            op.image = image;
            op.lookup = lookup_;
            lookup_ += texel_words(format_of(*scene_.images[image]->shape()));
        }
        size_++;
    }
    void add_set() {
        constexpr uint32_t parameters[] = {
            RP_PARAMETER_COLOR, RP_PARAMETER_SPECULAR,   RP_PARAMETER_TRANSMITTANCE, RP_PARAMETER_MIRROR,       RP_PARAMETER_REFRACTED,
            RP_PARAMETER_ALPHA, RP_PARAMETER_BASE_ALPHA, RP_PARAMETER_METAL,         RP_PARAMETER_ALPHA_ACROSS, RP_PARAMETER_BASE_ALPHA_ACROSS};
        rp_texture_op& op = add(RP_TEXTURE_SET | (random_() % 2 ? RP_TEXTURE_INVERT : 0u));
        const bool is_mix = scene_.materials.back().kind == RP_MATERIAL_MIX;
        op.image = is_mix ? RP_PARAMETER_AMOUNT : parameters[random_() % std::size(parameters)];
        op.a[0] = static_cast<float>(random_() % 3);
        size_--;
    }
    void add_any(bool may_grow) {
        constexpr uint32_t of_some[][2] = {{RP_TEXTURE_SCALE, 2},  {RP_TEXTURE_MIX, 3},       {RP_TEXTURE_CHECKS, 2},
                                           {RP_TEXTURE_BILERP, 4}, {RP_TEXTURE_DIRECTION, 2}, {RP_TEXTURE_SET, 1}};
        const auto& [kind, takes] = of_some[random_() % std::size(of_some)];
        if (may_grow && size_ < RP_TEXTURE_STACK && random_() % 2) return add_leaf();
        if (takes > size_) return;
        if (kind == RP_TEXTURE_SET) return add_set();
        rp_texture_op& op = add(kind | (kind == RP_TEXTURE_CHECKS && random_() % 2 ? RP_TEXTURE_SOLID : 0u));
        if (kind == RP_TEXTURE_DIRECTION) {
            const Float3 d = direction().to_float();
            op.a[0] = d.x, op.a[1] = d.y, op.a[2] = d.z;
        }
        size_ -= takes - 1;
    }

    Scene& scene_;
    std::mt19937 random_;
    uint32_t lookup_ = 0, size_ = 0;
};

// Of each kind, with numbers that are exact.
std::vector<rp_texture_map> maps_of_all_kinds() {
    return {{RP_MAP_UV, 0, {}, {2, 0.5f, 0.25f, 0, -1, 4, 1, 0, 0, 0, 0, 0}, {1, 1}, {0, 0}},
            {RP_MAP_UV, 0, {}, {0, -3, 0, 0, 1, 0, -2, 0, 0, 0, 0, 0}, {1, 1}, {0, 0}},
            {RP_MAP_POINT, 0, {}, {1, 0.5f, 0, 3, 0, 2, 0, -1, 0.25f, 0, 1, 0.5f}, {1, 1}, {0, 0}},
            {RP_MAP_SPHERE, 0, {}, {1, 0, 0, 0.3f, 0, 1, 0, 0, 0, 0, 1, -0.2f}, {1, 1}, {0, 0}},
            {RP_MAP_SPHERE, 1, {}, {0, 1, 0, 0, 0, 0, 2, 0, 1, 0, 0.5f, 0.1f}, {3, -4}, {0.3f, 0.7f}},
            {RP_MAP_CYLINDER, 0, {}, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0.11f}, {2, 3}, {0.1f, 0}},
            {RP_MAP_CYLINDER, 1, {}, {0, 0, 1, 0.1f, 1, 0, 0, 0, 0, -1, 0.1f, 0}, {1, 1}, {-0.4f, 0.2f}}};
}

// That of a conductor of this k, whose index is 1.
double reflectance_of(float k) { return double{k} * k / (4 + double{k} * k); }

void expect_same_material(const rp_material& found, const rp_material& expected) {
    constexpr double bound = 3e-5;  // bilinear between corners of which one is far outside
    const auto near = [](const float* a, const float* b, int count, double most, const char* name) {
        for (int i = 0; i < count; i++) EXPECT_NEAR(a[i], b[i], most) << name << ' ' << i;
    };
    near(found.color, expected.color, 3, bound, "color");
    near(found.specular, expected.specular, 3, bound, "specular");
    near(found.transmittance, expected.transmittance, 3, bound, "transmittance");
    near(found.mirror, expected.mirror, 3, bound, "mirror");
    near(found.refracted, expected.refracted, 3, bound, "refracted");
    near(&found.amount, &expected.amount, 1, 2e-4, "amount, or alpha across");
    // Roots are steep next to 0.
    near(&found.alpha, &expected.alpha, 1, 2e-4, "alpha");
    near(&found.base_alpha, &expected.base_alpha, 1, 2e-4, "base_alpha");
    near(&RP_BASE_ALPHA_ACROSS(found), &RP_BASE_ALPHA_ACROSS(expected), 1, 2e-4, "base_alpha across");
    near(found.eta, expected.eta, 3, 0, "eta");
    for (int i = 0; i < 3; i++) EXPECT_NEAR(reflectance_of(found.k[i]), reflectance_of(expected.k[i]), bound) << "k " << i;
    EXPECT_EQ(found.flags, expected.flags);
    EXPECT_EQ(found.kind, expected.kind);
}

// All operations but noise and bumps, all parameters.
TEST(TextureProgramsOnDevice, RandomOnesAreAsInTheReference) {
    constexpr uint32_t seed = 41, programs = 600, sites_each = 8;
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Scene scene;
    for (const uint32_t channels : {1u, 4u}) {
        for (const TexelKind kind : {TexelKind::unsigned_8, TexelKind::unsigned_16, TexelKind::half})
            scene.images.push_back(support::random_image({1, 1, channels, kind, false}, 10 * channels + static_cast<uint32_t>(kind)));
        scene.images.push_back(support::random_image({1, 1, channels, TexelKind::unsigned_8, true}, channels));
    }
    scene.texture_maps = maps_of_all_kinds();
    ProgramMaker maker(scene, seed);
    for (uint32_t i = 0; i < programs; i++) maker.add_program(i % 4 == 0);
    const auto checked = check_textures({scene.texture_ops, scene.texture_maps, scene.materials, scene.images.size(), {}});
    ASSERT_TRUE(checked.ok()) << checked.message();
    std::vector<ProgramSite> sites;
    for (uint32_t i = 0; i < programs * sites_each; i++) {
        ProgramSite site;
        for (float& x : site.position) x = maker.coordinate();
        const Float3 n = maker.direction().to_float();
        site.normal[0] = n.x, site.normal[1] = n.y, site.normal[2] = n.z;
        site.u = maker.coordinate();
        site.v = maker.coordinate();
        site.width = maker.share();
        site.sample = i;
        site.material = i / sites_each;
        sites.push_back(site);
    }
    support::TextureProbe probe(scene);
    const ReferenceTextures expected(scene);
    std::vector<SlotTexels> texels;
    std::vector<rp_material> materials;
    const auto results = probe.run_programs(sites, texels, materials);
    for (size_t i = 0; i < sites.size() && !testing::Test::HasFailure(); i++) {
        SCOPED_TRACE(testing::Message() << "program " << sites[i].material << ", site " << i);
        const ProgramSite& s = sites[i];
        EXPECT_EQ(results[i].done, 1u);
        expect_same_material(materials[i], expected.at(scene.materials[s.material], {Vec3(s.position), Vec3(s.normal), s.u, s.v}));
    }
}

rp_texture_op program_op(uint32_t op, uint32_t image = 0, uint32_t lookup = 0, std::array<float, 4> a = {1, 1, 1, 0}) {
    return {op, image, lookup, RP_NONE, {a[0], a[1], a[2], a[3]}, {}};
}

// A material whose program begins behind all others, and sets its colour in the end.
void add_color_program(Scene& scene, std::vector<rp_texture_op> ops) {
    rp_material m = {};
    m.flags = static_cast<uint32_t>(scene.texture_ops.size() + 1) << RP_MATERIAL_PROGRAM_SHIFT;
    scene.materials.push_back(m);
    ops.push_back(program_op(RP_TEXTURE_SET | RP_TEXTURE_LAST, RP_PARAMETER_COLOR));
    scene.texture_ops.insert(scene.texture_ops.end(), ops.begin(), ops.end());
}

// Four images, of which each has a page of its own beside that of tails, in a product; the third takes two words.
class WaitingPrograms : public testing::Test {
protected:
    WaitingPrograms() {
        const TexelKind kinds[] = {TexelKind::unsigned_8, TexelKind::unsigned_16, TexelKind::half, TexelKind::unsigned_8};
        const uint32_t channels[] = {4, 1, 4, 1};
        std::vector<rp_texture_op> ops;
        for (uint32_t i = 0; i < 4; i++) {
            scene_.images.push_back(support::random_image({70, 50, channels[i], kinds[i], i == 0}, i));
            ops.push_back(program_op(RP_TEXTURE_IMAGE, i, lookups_[i]));
            if (i > 0) ops.push_back(program_op(RP_TEXTURE_SCALE));
        }
        add_color_program(scene_, ops);
        probe_ = std::make_unique<support::TextureProbe>(scene_);
        std::mt19937 random(3);
        for (uint32_t i = 0; i < 200; i++) {
            ProgramSite site;
            site.u = static_cast<float>(random() % 1000) / 999;
            site.v = static_cast<float>(random() % 1000) / 999;
            site.sample = i;
            sites_.push_back(site);
        }
        probe_->run_programs(sites_, texels_, materials_);
    }
    uint32_t page_of(uint32_t image) const { return probe_->tables().image_levels[probe_->tables().images[image].first_level].page; }

    static constexpr uint32_t lookups_[] = {31, 0, 7, 3};
    Scene scene_;
    std::unique_ptr<support::TextureProbe> probe_;
    std::vector<ProgramSite> sites_;
    std::vector<SlotTexels> texels_;      // with all pages
    std::vector<rp_material> materials_;  // likewise
};

// An absent page is named, texels that were found before it stay, and later come from the slot, whatever has become of their pages.
TEST_F(WaitingPrograms, GoOnWithTheTexelsThatTheyHave) {
    std::vector<SlotTexels> texels;
    std::vector<rp_material> materials;
    uint32_t have = 0;
    for (uint32_t absent = 0; absent < 4; absent++) {
        // All but this image are absent from here on, too: that of the first is met first.
        std::vector<uint32_t> pages;
        for (uint32_t i = absent; i < 4; i++) pages.push_back(page_of(i));
        for (uint32_t i = 0; i + 1 < absent; i++) pages.push_back(page_of(i));
        probe_->set_absent(pages);
        for (ProgramSite& site : sites_) site.have = have;
        const auto results = probe_->run_programs(sites_, texels, materials);
        if (absent > 0) have |= 1u << lookups_[absent - 1];
        for (size_t i = 0; i < sites_.size(); i++) {
            ASSERT_EQ(results[i].done, 0u);
            ASSERT_EQ(results[i].absent, support::TextureProbe::first_page + page_of(absent));
            ASSERT_EQ(results[i].have, have);
            for (uint32_t k = 0; k < absent; k++) ASSERT_EQ(texels[i][lookups_[k]], texels_[i][lookups_[k]]) << k;
            if (absent > 2) {
                ASSERT_EQ(texels[i][lookups_[2] + 1], texels_[i][lookups_[2] + 1]);
            }
        }
    }
    probe_->set_absent({page_of(0), page_of(1), page_of(2)});
    for (ProgramSite& site : sites_) site.have = have;
    const auto results = probe_->run_programs(sites_, texels, materials);
    for (size_t i = 0; i < sites_.size(); i++) {
        ASSERT_EQ(results[i].done, 1u);
        ASSERT_EQ(results[i].have, have | 1u << lookups_[3]);
        ASSERT_EQ(std::memcmp(&materials[i], &materials_[i], sizeof(rp_material)), 0);
    }
    EXPECT_EQ(texels, texels_);
}

// Lookups with other jitters have texels of their own, so that the mean of a product is that of the means; those with the same lie alike.
TEST(TextureProgramsOnDevice, LookupsAreIndependentUnlessTheyAreToLieAlike) {
    constexpr uint32_t samples = 1 << 14;
    Scene scene;
    std::vector<std::byte> texels = {std::byte{0}, std::byte{255}};
    scene.images = {memory_image("steps", {2, 1, 1, TexelKind::unsigned_8, false}, texels)};
    for (const uint32_t jitter : {0u, 1u, 7u, 31u})
        add_color_program(scene, {program_op(RP_TEXTURE_IMAGE, 0, 0), program_op(RP_TEXTURE_IMAGE | jitter << RP_TEXTURE_JITTER_SHIFT, 0, 1),
                                  program_op(RP_TEXTURE_SCALE)});
    support::TextureProbe probe(scene);
    std::vector<ProgramSite> sites(4 * samples);
    for (uint32_t i = 0; i < sites.size(); i++) {
        sites[i].material = i / samples;
        sites[i].u = 0.55f;  // so 0.6 of the lookups are 1
        sites[i].sample = i % samples;
    }
    std::vector<SlotTexels> words;
    std::vector<rp_material> materials;
    probe.run_programs(sites, words, materials);
    for (uint32_t k = 0; k < 4; k++) {
        double sum = 0;
        for (uint32_t i = 0; i < samples; i++) sum += materials[k * samples + i].color[0];
        EXPECT_NEAR(sum / samples, k == 0 ? 0.6 : 0.36, 0.005) << k;
    }
}

}  // namespace
}  // namespace raypager
