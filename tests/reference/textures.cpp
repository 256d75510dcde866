#include "reference/textures.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "base/check.hpp"

namespace raypager::reference {
namespace {

double half_value(uint16_t bits) {
    const int exponent = bits >> 10 & 31, mantissa = bits & 1023;
    const double magnitude = exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
    return bits & 0x8000 ? -magnitude : magnitude;
}

double srgb_to_linear(double c) { return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4); }

double channel_value(const std::byte* at, const ImageShape& shape, bool alpha) {
    if (shape.kind == TexelKind::unsigned_8) {
        const double c = static_cast<double>(std::to_integer<int>(*at)) / 255;
        return shape.srgb && !alpha ? srgb_to_linear(c) : c;
    }
    uint16_t bits;
    std::memcpy(&bits, at, sizeof bits);
    return shape.kind == TexelKind::half ? half_value(bits) : bits / 65535.0;
}

Vec3 number(double x) { return Vec3(x, x, x); }
Vec3 rgb(const float* c) { return {c[0], c[1], c[2]}; }
Vec3 mixed(const Vec3& a, const Vec3& b, const Vec3& t) { return a + (b - a) * t; }

double clamped(double x, double low, double high) { return std::min(std::max(x, low), high); }
void store(const Vec3& v, float* out) {
    for (int i = 0; i < 3; i++) out[i] = static_cast<float>(clamped(v[i], 0, 1));
}

double alpha_of(double roughness, float remap) {
    if (remap == 1) return std::sqrt(std::max(roughness, 0.0));
    if (remap != 2) return roughness;
    const double x = std::log(std::max(roughness, 1e-3));
    return 1.62142 + 0.819955 * x + 0.1734 * x * x + 0.0171201 * x * x * x + 0.000640711 * x * x * x * x;
}

void set(rp_material& m, const rp_texture_op& op, const Vec3& v) {
    switch (op.image) {
        case RP_PARAMETER_COLOR:
            return store(v, m.color);
        case RP_PARAMETER_SPECULAR:
            return store(v, m.specular);
        case RP_PARAMETER_TRANSMITTANCE:
            return store(v, m.transmittance);
        case RP_PARAMETER_MIRROR:
            return store(v, m.mirror);
        case RP_PARAMETER_REFRACTED:
            return store(v, m.refracted);
        case RP_PARAMETER_ALPHA:
            m.alpha = static_cast<float>(clamped(alpha_of(v.x, op.a[0]), 1e-3, 1));
            return;
        case RP_PARAMETER_BASE_ALPHA:
            m.base_alpha = static_cast<float>(clamped(alpha_of(v.x, op.a[0]), 1e-3, 1));
            return;
        case RP_PARAMETER_ALPHA_ACROSS:
            RP_ALPHA_ACROSS(m) = static_cast<float>(clamped(alpha_of(v.x, op.a[0]), 1e-3, 1));
            return;
        case RP_PARAMETER_BASE_ALPHA_ACROSS:
            RP_BASE_ALPHA_ACROSS(m) = static_cast<float>(clamped(alpha_of(v.x, op.a[0]), 1e-3, 1));
            return;
        case RP_PARAMETER_AMOUNT:
            m.amount = static_cast<float>(clamped(v.x, 0, 1));
            return;
        case RP_PARAMETER_METAL:
            for (int i = 0; i < 3; i++) {
                const double r = clamped(v[i], 0, 0.9999);
                m.eta[i] = 1;
                m.k[i] = static_cast<float>(2 * std::sqrt(r / (1 - r)));
            }
            return;
        default:
            RAYPAGER_CHECK(false);
    }
}

}  // namespace

ReferenceTextures::ReferenceTextures(const Scene& scene) : scene_(scene) {
    for (const auto& source : scene.images) {
        Pixels pixels;
        pixels.shape = *source->shape();
        const size_t channel_bytes = bytes_of_channel(pixels.shape.kind), channels = pixels.shape.channels;
        const Status read = source->read([&](std::span<const std::byte> rows) -> Status {
            for (size_t at = 0; at < rows.size(); at += channels * channel_bytes) {
                std::array<double, 4> t = {};
                for (size_t c = 0; c < channels; c++) t[c] = channel_value(rows.data() + at + c * channel_bytes, pixels.shape, c == 3);
                if (channels == 1) t = {t[0], t[0], t[0], 1};
                pixels.texels.push_back(t);
            }
            return {};
        });
        RAYPAGER_CHECK(read.ok());
        images_.push_back(std::move(pixels));
    }
}

Vec3 ReferenceTextures::place(uint32_t number_of_map, const TextureSite& site) const {
    if (number_of_map == RP_NONE) return {site.u, site.v, 0};
    const rp_texture_map& map = scene_.texture_maps[number_of_map];
    const float* m = map.m;
    if (map.kind == RP_MAP_UV) return {m[0] * site.u + m[1] * site.v + m[2], m[4] * site.u + m[5] * site.v + m[6], 0};
    const Vec3 p(m[0] * site.position.x + m[1] * site.position.y + m[2] * site.position.z + m[3],
                 m[4] * site.position.x + m[5] * site.position.y + m[6] * site.position.z + m[7],
                 m[8] * site.position.x + m[9] * site.position.y + m[10] * site.position.z + m[11]);
    if (map.kind == RP_MAP_POINT) return p;
    const double around = std::atan2(p.y, p.x), turns = around / (2 * pi);
    double s = std::acos(clamped(p.z / length(p), -1, 1)) / pi, t = turns < 0 ? turns + 1 : turns;
    if (map.kind == RP_MAP_CYLINDER) s = turns + 0.5, t = p.z;
    if (map.swapped) std::swap(s, t);
    return {s * map.scale[0] + map.offset[0], t * map.scale[1] + map.offset[1], 0};
}

std::array<double, 4> ReferenceTextures::texel(const Pixels& image, int64_t x, int64_t y, uint32_t wrap) const {
    const auto along = [&](int64_t i, int64_t n, uint32_t mode) -> int64_t {
        if (i >= 0 && i < n) return i;
        if (mode == RP_WRAP_BLACK) return -1;
        if (mode == RP_WRAP_CLAMP) return i < 0 ? 0 : n - 1;
        if (mode == RP_WRAP_REPEAT) return ((i % n) + n) % n;
        const int64_t k = ((i % (2 * n)) + 2 * n) % (2 * n);
        return k < n ? k : 2 * n - 1 - k;
    };
    const int64_t column = along(x, image.shape.width, wrap & 3), row = along(y, image.shape.height, wrap >> 2 & 3);
    if (column < 0 || row < 0) return {};
    return image.texels[static_cast<size_t>(row * image.shape.width + column)];
}

Vec3 ReferenceTextures::looked_up(const rp_texture_op& op, const TextureSite& site) const {
    const Pixels& image = images_[op.image];
    const Vec3 st = place(op.map, site);
    const double x = st.x * image.shape.width - 0.5, y = st.y * image.shape.height - 0.5, fx = x - std::floor(x), fy = y - std::floor(y);
    const auto column = static_cast<int64_t>(std::floor(x)), row = static_cast<int64_t>(std::floor(y));
    std::array<double, 4> c = {};
    for (int i = 0; i < 4; i++) {
        const auto t = texel(image, column + (i & 1), row + (i >> 1), op.op >> RP_TEXTURE_WRAP_SHIFT);
        const double weight = (i & 1 ? fx : 1 - fx) * (i >> 1 ? fy : 1 - fy);
        for (size_t k = 0; k < 4; k++) c[k] += weight * t[k];
    }
    const uint32_t channel = op.op >> RP_TEXTURE_CHANNEL_SHIFT & RP_TEXTURE_CHANNEL_MASK;
    Vec3 v(c[0], c[1], c[2]);
    if (channel == 1) v = number((c[0] + c[1] + c[2]) / 3);
    if (channel == 2) v = number(0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]);
    if (channel >= 3) v = number(c[channel - 3]);
    v = v * rgb(op.a);
    return op.op & RP_TEXTURE_INVERT ? Vec3(std::max(1 - v.x, 0.0), std::max(1 - v.y, 0.0), std::max(1 - v.z, 0.0)) : v;
}

rp_material ReferenceTextures::at(const rp_material& material, const TextureSite& site) const {
    rp_material m = material;
    std::vector<Vec3> stack;
    const auto pop = [&] {
        const Vec3 top = stack.back();
        stack.pop_back();
        return top;
    };
    const uint32_t program = material.flags >> RP_MATERIAL_PROGRAM_SHIFT;
    for (size_t i = program - 1; program > 0; i++) {
        const rp_texture_op& op = scene_.texture_ops[i];
        const Vec3 st = place(op.map, site);
        switch (op.op & RP_TEXTURE_OPERATION_MASK) {
            case RP_TEXTURE_CONSTANT:
                stack.push_back(rgb(op.a));
                break;
            case RP_TEXTURE_IMAGE:
                stack.push_back(looked_up(op, site));
                break;
            case RP_TEXTURE_SCALE: {
                const Vec3 y = pop(), x = pop();
                stack.push_back(x * y * rgb(op.a));
                break;
            }
            case RP_TEXTURE_MIX: {
                const Vec3 amount = pop(), y = pop(), x = pop();
                stack.push_back(mixed(x, y, amount));
                break;
            }
            case RP_TEXTURE_DIRECTION: {
                const Vec3 y = pop(), x = pop();
                stack.push_back(mixed(y, x, number(std::abs(dot(site.normal, rgb(op.a))))));
                break;
            }
            case RP_TEXTURE_CHECKS: {
                const Vec3 y = pop(), x = pop();
                const double sum = std::floor(st.x) + std::floor(st.y) + (op.op & RP_TEXTURE_SOLID ? std::floor(st.z) : 0);
                stack.push_back(std::fmod(std::abs(sum), 2) == 0 ? x : y);
                break;
            }
            case RP_TEXTURE_BILERP: {
                const Vec3 v11 = pop(), v10 = pop(), v01 = pop(), v00 = pop();
                stack.push_back(mixed(mixed(v00, v01, number(st.y)), mixed(v10, v11, number(st.y)), number(st.x)));
                break;
            }
            case RP_TEXTURE_UV:
                stack.push_back({st.x - std::floor(st.x), st.y - std::floor(st.y), 0});
                break;
            case RP_TEXTURE_SET: {
                const Vec3 v = pop();
                set(m, op, op.op & RP_TEXTURE_INVERT ? number(1) - v : v);
                break;
            }
            default:
                RAYPAGER_CHECK(false);  // noise is compared elsewhere
        }
        if (op.op & RP_TEXTURE_LAST) break;
    }
    return m;
}

}  // namespace raypager::reference
