#include "import/gltf_draco.hpp"

#include <fmt/format.h>

#include <array>
#include <cstring>
#include <optional>

#include "import/text.hpp"

#ifdef RAYPAGER_DRACO
#include <draco/compression/decode.h>
#endif

namespace raypager {

#ifdef RAYPAGER_DRACO
namespace {

// Draco takes memory for as many triangles and vertices as a file says that there are, before it looks for them. Even a flat grid takes more than a
// byte for so many.
constexpr uint64_t most_per_byte = 512;

// The numbers of faces and of vertices. Format: "Draco Bitstream Specification", 2.2, sections 3.1 and 3.2. Nothing: it is no mesh of this version.
std::optional<std::array<uint64_t, 2>> declared_sizes(std::span<const std::byte> packed) {
    constexpr size_t header_bytes = 11;
    constexpr uint8_t triangular_mesh = 1, edgebreaker = 1, metadata = 0x80;
    const auto byte = [&](size_t at) { return std::to_integer<uint8_t>(packed[at]); };
    if (packed.size() < header_bytes || std::memcmp(packed.data(), "DRACO", 5) != 0) return std::nullopt;
    if (byte(5) != 2 || byte(6) < 2 || byte(7) != triangular_mesh || byte(8) > edgebreaker || byte(10) & metadata) return std::nullopt;
    size_t at = header_bytes + (byte(8) == edgebreaker ? 1 : 0);
    std::array<uint64_t, 2> sizes = {};
    for (uint64_t& size : sizes) {
        for (int shift = 0;; shift += 7) {
            if (at >= packed.size() || shift > 28) return std::nullopt;
            const uint8_t next = byte(at++);
            size |= static_cast<uint64_t>(next & 0x7f) << shift;
            if (!(next & 0x80)) break;
        }
    }
    return sizes;
}

bool take_values(const draco::PointAttribute& from, uint32_t vertices, DracoAttribute& to) {
    const uint32_t components = to.components;
    to.values.resize(size_t{vertices} * components);
    const double scale = to.fractions && !from.normalized() ? (from.data_type() == draco::DT_INT8     ? 1 / 127.0
                                                               : from.data_type() == draco::DT_UINT8  ? 1 / 255.0
                                                               : from.data_type() == draco::DT_INT16  ? 1 / 32767.0
                                                               : from.data_type() == draco::DT_UINT16 ? 1 / 65535.0
                                                                                                      : 1.0)
                                                            : 1.0;
    for (uint32_t i = 0; i < vertices; ++i) {
        float* out = to.values.data() + size_t{i} * components;
        const auto index = from.mapped_index(draco::PointIndex(i));
        if (index.value() >= from.size() || !from.ConvertValue<float>(index, static_cast<int8_t>(components), out)) return false;
        for (uint32_t c = 0; c < components; ++c) out[c] = static_cast<float>(out[c] * scale);
    }
    return true;
}

}  // namespace

Status unpack_draco(std::span<const std::byte> packed, std::span<DracoAttribute* const> attributes, std::vector<uint32_t>& indices) {
    const auto sizes = declared_sizes(packed);
    if (!sizes) return Status::failed("its Draco data are damaged, or no mesh of Draco's bitstream 2.2");
    for (const uint64_t size : *sizes)
        if (size / most_per_byte > packed.size())
            return Status::failed(fmt::format("its Draco data claim {} triangles or vertices in {} bytes; the file is damaged", size, packed.size()));
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(packed.data()), packed.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (!decoded.ok()) return Status::failed(fmt::format("its Draco data cannot be unpacked ({})", clipped(decoded.status().error_msg_string())));
    const draco::Mesh& mesh = *decoded.value();
    const uint32_t vertices = mesh.num_points();
    for (DracoAttribute* attribute : attributes) {
        if (attribute->id < 0) continue;
        const auto* found = mesh.GetAttributeByUniqueId(static_cast<uint32_t>(attribute->id));
        if (!found || !take_values(*found, vertices, *attribute))
            return Status::failed(fmt::format("its Draco data have no sound attribute {}; the file is damaged", attribute->id));
    }
    indices.reserve(size_t{mesh.num_faces()} * 3);
    for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f)
        for (const draco::PointIndex& p : mesh.face(f)) indices.push_back(p.value());
    return {};
}
#else
Status unpack_draco(std::span<const std::byte>, std::span<DracoAttribute* const>, std::vector<uint32_t>&) {
    return Status::failed("is compressed by Draco (KHR_draco_mesh_compression), which this build is without; build with libdraco-dev");
}
#endif

}  // namespace raypager
