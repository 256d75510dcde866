#include "import/textures.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "scene/octahedral.hpp"
#include "scene/texture_use.hpp"

namespace raypager {
namespace {

void put_rgb(const Float3& from, float* to) {
    to[0] = from.x;
    to[1] = from.y;
    to[2] = from.z;
}

Float3 times_each(const Float3& a, const Float3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
bool is_everywhere(const Texture& t, float value) { return t.is_constant() && t.mean() == Float3{value, value, value}; }

// Colours that are on the stack at once, at most, while an expression is computed.
size_t stack_need(const Texture& t) {
    if (t.is_constant()) return 1;
    size_t need = 1;
    for (size_t i = 0; i < t.node()->inputs.size(); ++i) need = std::max(need, i + stack_need(t.node()->inputs[i]));
    return need;
}

// Of its images, along u or v from 0 to 1, at most.
float texels_along(const Texture& t) {
    if (t.is_constant()) return 0;
    float most = 0;
    for (const Texture& input : t.node()->inputs) most = std::max(most, texels_along(input));
    if (!t.node()->source) return most;
    const auto shape = t.node()->source->shape();
    const bool scaled = t.node()->map && t.node()->map->kind == RP_MAP_UV;
    const float along_u = scaled ? std::abs(t.node()->map->m[0]) : 1, along_v = scaled ? std::abs(t.node()->map->m[5]) : 1;
    return shape ? std::max({most, along_u * static_cast<float>(shape->width), along_v * static_cast<float>(shape->height)}) : most;
}

bool same_map(const rp_texture_map& a, const rp_texture_map& b) {
    return a.kind == b.kind && a.swapped == b.swapped && std::ranges::equal(a.m, b.m) && std::ranges::equal(a.scale, b.scale) &&
           std::ranges::equal(a.offset, b.offset);
}

bool same_lookup(const Scene& scene, const rp_texture_op& a, const rp_texture_op& b) {
    constexpr uint32_t wrap = 0xfu << RP_TEXTURE_WRAP_SHIFT;
    if (a.image != b.image || (a.op & wrap) != (b.op & wrap) || (a.map == RP_NONE) != (b.map == RP_NONE)) return false;
    return a.map == RP_NONE || same_map(scene.texture_maps[a.map], scene.texture_maps[b.map]);
}

// Writes one program behind all others.
class ProgramWriter {
public:
    ProgramWriter(Scene& scene, uint32_t first_word) : scene_(scene), begin_(scene.texture_ops.size()), words_(first_word), jitter_(first_word) {}

    void set(const TexturedMaterial::Parameter& p) {
        compute(p.value);
        rp_texture_op op = texture_op(RP_TEXTURE_SET, {p.remap, 0, 0});
        op.image = p.parameter;
        scene_.texture_ops.push_back(op);
    }
    // The height here, and a step away along the surface in two directions.
    void bump(const Texture& height) {
        constexpr float steps[3][2] = {{0, 0}, {1, 0}, {-1, 1}};
        const float texels = texels_along(height);
        const size_t begin = scene_.texture_ops.size();
        for (const auto& step : steps) {
            rp_texture_op shift = texture_op(RP_TEXTURE_SHIFT, {step[0], step[1], texels});
            if (step[0] != 0) scene_.texture_ops.push_back(shift);
            jitter_ = 0;  // the same texels of each image, moved
            begin_ = scene_.texture_ops.size();
            compute(height);
        }
        begin_ = begin;
        scene_.texture_ops.push_back(texture_op(RP_TEXTURE_SHIFT, {0, -1, texels}));
        scene_.texture_ops.push_back(texture_op(RP_TEXTURE_BUMP, {0, 0, texels}));
    }
    uint32_t words() const { return words_; }

private:
    void compute(const Texture& t) {
        if (t.is_constant()) {
            scene_.texture_ops.push_back(texture_op(RP_TEXTURE_CONSTANT, t.mean()));
            return;
        }
        const Texture::Node& node = *t.node();
        for (const Texture& input : node.inputs) compute(input);
        rp_texture_op op = node.op;
        op.map = RP_NONE;
        if (node.map) {
            op.map = static_cast<uint32_t>(scene_.texture_maps.size());
            scene_.texture_maps.push_back(*node.map);
        }
        if (node.source) look_up(node, op);
        scene_.texture_ops.push_back(op);
    }

    // What is looked up twice is looked up once.
    void look_up(const Texture::Node& node, rp_texture_op& op) {
        auto& images = scene_.images;
        const auto found = std::find(images.begin(), images.end(), node.source);
        op.image = static_cast<uint32_t>(found - images.begin());
        if (found == images.end()) images.push_back(node.source);
        for (size_t i = begin_; i < scene_.texture_ops.size(); ++i) {
            const rp_texture_op& before = scene_.texture_ops[i];
            if ((before.op & RP_TEXTURE_OPERATION_MASK) != RP_TEXTURE_IMAGE || !same_lookup(scene_, before, op)) continue;
            op.lookup = before.lookup;
            if (op.map != RP_NONE) scene_.texture_maps.pop_back();
            op.map = before.map;
            return;
        }
        const auto shape = node.source->shape();
        op.lookup = words_;
        op.op |= (jitter_++ & RP_TEXTURE_JITTER_MASK) << RP_TEXTURE_JITTER_SHIFT;
        words_ += shape && shape->channels * bytes_of_channel(shape->kind) <= 4 ? 1 : 2;
    }

    Scene& scene_;
    size_t begin_;  // of what may share lookups
    uint32_t words_, jitter_ = 0;
};

// Behind the words that the programs of a material and of its parts take.
uint32_t words_end(const Scene& scene, const rp_material& m) {
    uint32_t end = 0;
    if (m.kind == RP_MATERIAL_MIX) {
        end = words_end(scene, scene.materials[m.second]);
        if (m.first != RP_NONE) end = std::max(end, words_end(scene, scene.materials[m.first]));
    }
    const uint32_t program = m.flags >> RP_MATERIAL_PROGRAM_SHIFT;
    for (size_t i = program - 1; program > 0; ++i) {
        const rp_texture_op& op = scene.texture_ops[i];
        if ((op.op & RP_TEXTURE_OPERATION_MASK) == RP_TEXTURE_IMAGE) {
            const auto shape = scene.images[op.image]->shape();
            end = std::max(end, op.lookup + (shape && shape->channels * bytes_of_channel(shape->kind) <= 4 ? 1 : 2));
        }
        if (op.op & RP_TEXTURE_LAST) break;
    }
    return end;
}

}  // namespace

rp_texture_op texture_op(uint32_t kind, const Float3& a) {
    rp_texture_op op{};
    op.op = kind;
    op.map = RP_NONE;
    put_rgb(a, op.a);
    return op;
}

Texture Texture::operation(const rp_texture_op& op, std::vector<Texture> inputs, std::optional<rp_texture_map> map, const Float3& mean) {
    Texture t(mean);
    t.node_ = std::make_shared<const Node>(Node{op, map, nullptr, std::move(inputs)});
    return t;
}

Texture Texture::image(std::shared_ptr<const ImageSource> source, const rp_texture_op& op, std::optional<rp_texture_map> map) {
    const Float3 half = {op.a[0] / 2, op.a[1] / 2, op.a[2] / 2};
    Texture t(op.op & RP_TEXTURE_INVERT ? Float3{1 - half.x, 1 - half.y, 1 - half.z} : half);
    t.node_ = std::make_shared<const Node>(Node{op, map, std::move(source), {}});
    return t;
}

Texture operator*(const Texture& a, const Texture& b) {
    if (a.is_constant() && b.is_constant()) return times_each(a.mean(), b.mean());
    if (is_everywhere(a, 1) || is_everywhere(b, 0)) return b;
    if (is_everywhere(b, 1) || is_everywhere(a, 0)) return a;
    // An image, or a product, takes a constant as its own factor.
    const Texture &constant = a.is_constant() ? a : b, &other = a.is_constant() ? b : a;
    if (constant.is_constant()) {
        const uint32_t kind = other.node()->op.op & RP_TEXTURE_OPERATION_MASK;
        if ((kind == RP_TEXTURE_IMAGE && !(other.node()->op.op & RP_TEXTURE_INVERT)) || kind == RP_TEXTURE_SCALE) {
            rp_texture_op op = other.node()->op;
            put_rgb(times_each({op.a[0], op.a[1], op.a[2]}, constant.mean()), op.a);
            if (kind == RP_TEXTURE_IMAGE) return Texture::image(other.node()->source, op, other.node()->map);
            return Texture::operation(op, other.node()->inputs, other.node()->map, times_each(other.mean(), constant.mean()));
        }
    }
    return Texture::operation(texture_op(RP_TEXTURE_SCALE), {a, b}, std::nullopt, times_each(a.mean(), b.mean()));
}

Texture mixed(const Texture& a, const Texture& b, const Texture& share_of_b) {
    if (is_everywhere(share_of_b, 0)) return a;
    if (is_everywhere(share_of_b, 1)) return b;
    const Float3 t = share_of_b.mean();
    const Float3 mean = {std::lerp(a.mean().x, b.mean().x, t.x), std::lerp(a.mean().y, b.mean().y, t.y), std::lerp(a.mean().z, b.mean().z, t.z)};
    if (a.is_constant() && b.is_constant() && share_of_b.is_constant()) return mean;
    return Texture::operation(texture_op(RP_TEXTURE_MIX), {a, b, share_of_b}, std::nullopt, mean);
}

Texture one_minus(const Texture& a) { return mixed(Texture(1.0), Texture(0.0), a); }

void TexturedMaterial::set(uint32_t parameter, const Texture& value, float* out) {
    put_rgb({std::clamp(value.mean().x, 0.0f, 1.0f), std::clamp(value.mean().y, 0.0f, 1.0f), std::clamp(value.mean().z, 0.0f, 1.0f)}, out);
    std::erase_if(textures, [&](const Parameter& p) { return p.parameter == parameter; });
    if (!value.is_constant()) textures.push_back({parameter, value});
}

bool add_material(Scene& scene, const TexturedMaterial& textured) {
    rp_material material = textured.material;
    const size_t begin = scene.texture_ops.size(), maps = scene.texture_maps.size(), images = scene.images.size();
    bool fits = begin + 1 < RP_NONE >> RP_MATERIAL_PROGRAM_SHIFT;
    ProgramWriter program(scene, words_end(scene, material));
    for (const TexturedMaterial::Parameter& p : textured.textures) {
        fits = fits && stack_need(p.value) <= RP_TEXTURE_STACK;
        if (fits) program.set(p);
    }
    if (textured.height) {
        fits = fits && stack_need(*textured.height) + 2 <= RP_TEXTURE_STACK;
        if (fits) program.bump(*textured.height);
    }
    fits = fits && program.words() <= RP_TEXEL_WORDS;
    if (!fits) {
        scene.texture_ops.resize(begin);
        scene.texture_maps.resize(maps);
        scene.images.resize(images);
    } else if (scene.texture_ops.size() > begin) {
        scene.texture_ops.back().op |= RP_TEXTURE_LAST;
        material.flags |= static_cast<uint32_t>(begin + 1) << RP_MATERIAL_PROGRAM_SHIFT;
    }
    scene.materials.push_back(material);
    return fits;
}

namespace {

// By u and v, in whichever way.
bool by_uv(const Scene& scene, const rp_texture_op& op) {
    const uint32_t kind = op.op & RP_TEXTURE_OPERATION_MASK;
    const bool mapped =
        kind == RP_TEXTURE_IMAGE || kind == RP_TEXTURE_BILERP || kind == RP_TEXTURE_UV || kind == RP_TEXTURE_CHECKS || kind == RP_TEXTURE_DOTS;
    return mapped && (op.map == RP_NONE || scene.texture_maps[op.map].kind == RP_MAP_UV);
}

// u is the angle about z, v is 0 at -z and 1 at +z.
rp_texture_map around_sphere(const Scene& scene, const rp_texture_op& op, const Transform& to_object) {
    rp_texture_map map{};
    map.kind = RP_MAP_SPHERE;
    for (size_t row = 0; row < 3; ++row)
        for (size_t column = 0; column < 4; ++column) map.m[4 * row + column] = static_cast<float>(to_object.m[row][column]);
    const float identity[8] = {1, 0, 0, 0, 0, 1, 0, 0};
    const float* uv = op.map == RP_NONE ? identity : scene.texture_maps[op.map].m;
    map.swapped = 1;
    map.scale[0] = uv[0];
    map.offset[0] = uv[2];
    map.scale[1] = -uv[5];
    map.offset[1] = uv[5] + uv[6];
    return map;
}

// The axis about which u grows: a sphere is turned and scaled, but not stretched.
uint32_t axis_code(const Transform& to_object) { return encode_octahedral(to_object.m[2][0], to_object.m[2][1], to_object.m[2][2]); }

// The material with this number, or one like it with textures and tangents around this sphere.
uint32_t material_around(Scene& scene, uint32_t number, const Transform& to_object) {
    rp_material material = scene.materials[number];
    bool changed = false;
    if (material.kind == RP_MATERIAL_MIX) {
        const uint32_t first = material.first == RP_NONE ? RP_NONE : material_around(scene, material.first, to_object),
                       second = material_around(scene, material.second, to_object);
        changed = first != material.first || second != material.second;
        material.first = first;
        material.second = second;
    }
    if (const uint32_t program = material.flags >> RP_MATERIAL_PROGRAM_SHIFT; program > 0) {
        const size_t begin = scene.texture_ops.size();
        bool around = false;
        for (size_t i = program - 1;; ++i) {
            rp_texture_op op = scene.texture_ops[i];
            if (by_uv(scene, op)) {
                const rp_texture_map map = around_sphere(scene, op, to_object);
                op.map = static_cast<uint32_t>(scene.texture_maps.size());
                scene.texture_maps.push_back(map);
                around = true;
            }
            scene.texture_ops.push_back(op);
            if (op.op & RP_TEXTURE_LAST) break;
        }
        around = around && begin + 1 < RP_NONE >> RP_MATERIAL_PROGRAM_SHIFT;
        if (around)
            material.flags = (material.flags & RP_MATERIAL_FLAGS) | static_cast<uint32_t>(begin + 1) << RP_MATERIAL_PROGRAM_SHIFT;
        else
            scene.texture_ops.resize(begin);
        changed = changed || around;
    }
    if (is_anisotropic(material)) {
        RP_SPHERE_AXIS(material) = ~axis_code(to_object);
        changed = true;
    }
    if (!changed) return number;
    scene.materials.push_back(material);
    return static_cast<uint32_t>(scene.materials.size() - 1);
}

}  // namespace

void map_textures_around_spheres(Scene& scene) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> known;  // by material and axis, where nothing else counts
    for (Shape& shape : scene.shapes) {
        if (shape.mesh || shape.points) continue;
        const auto to_object = shape.to_world.inverse();
        if (!to_object) continue;
        const std::pair key(shape.material, axis_code(*to_object));
        if (const auto found = known.find(key); found != known.end()) {
            shape.material = found->second;
            continue;
        }
        const size_t ops = scene.texture_ops.size();
        shape.material = material_around(scene, shape.material, *to_object);
        if (scene.texture_ops.size() == ops) known.emplace(key, shape.material);
    }
}

}  // namespace raypager
