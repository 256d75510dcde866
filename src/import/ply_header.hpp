// The header of a PLY file: which elements follow, with which properties, in which encoding.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/files.hpp"

namespace raypager {

enum class PlyEncoding { ascii, little_endian, big_endian };
enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

size_t ply_type_bytes(PlyType type);
bool ply_type_is_integer(PlyType type);

static_assert(std::endian::native == std::endian::little, "binary PLY is decoded on little-endian machines only");

// A value as a binary PLY stores it. swap: its bytes are in big-endian order.
template <class T>
T load_ply(const std::byte* from, bool swap) {
    std::array<std::byte, sizeof(T)> bytes;
    std::memcpy(bytes.data(), from, sizeof(T));
    if (swap) std::reverse(bytes.begin(), bytes.end());
    return std::bit_cast<T>(bytes);
}
// The same as a number, whatever its type.
inline double load_ply_number(const std::byte* from, PlyType type, bool swap) {
    switch (type) {
        case PlyType::int8:
            return load_ply<int8_t>(from, swap);
        case PlyType::uint8:
            return load_ply<uint8_t>(from, swap);
        case PlyType::int16:
            return load_ply<int16_t>(from, swap);
        case PlyType::uint16:
            return load_ply<uint16_t>(from, swap);
        case PlyType::int32:
            return load_ply<int32_t>(from, swap);
        case PlyType::uint32:
            return load_ply<uint32_t>(from, swap);
        case PlyType::float32:
            return load_ply<float>(from, swap);
        case PlyType::float64:
            return load_ply<double>(from, swap);
    }
    return 0;
}

struct PlyProperty {
    std::string name;
    PlyType type = PlyType::float32;
    std::optional<PlyType> count_type;  // of a list
};

struct PlyElement {
    std::string name;
    uint64_t count = 0;
    std::vector<PlyProperty> properties;
    bool has_list() const;
    std::optional<size_t> find(std::string_view property) const;
};

struct PlyHeader {
    PlyEncoding encoding = PlyEncoding::ascii;
    std::vector<PlyElement> elements;
    uint64_t bytes = 0;  // where the data start
    uint64_t lines = 0;
    std::vector<std::string> warnings;
    const PlyElement* find(std::string_view element) const;
};

// Where the mesh is among the properties of its elements: numbers of properties.
struct PlyLayout {
    using Triple = std::optional<std::array<size_t, 3>>;
    const PlyElement* vertices = nullptr;
    const PlyElement* faces = nullptr;   // null where there are only strips
    const PlyElement* strips = nullptr;  // null where there are only faces
    size_t position[3] = {};
    Triple normal, vertex_color, face_color;
    std::optional<std::array<size_t, 2>> uv;  // of vertices
    std::optional<size_t> wedge_colors;       // of faces: a list of red, green and blue for each corner
    std::optional<size_t> wedge_uvs;          // of faces: a list of u and v for each corner, where vertices have none
    std::optional<size_t> face_number;        // of faces: the number of the face of a Ptex file
    size_t indices = 0, strip_indices = 0;

    // Vertices come before all that uses them, and have a fixed size, and nothing about faces makes new vertices of them: so that a mesh can be
    // handed on while it is read.
    bool in_pieces() const;
};

// Also refuses element counts that the file is too short for, so that counts may be trusted with memory afterwards. Lines of the header may end in
// LF, CR LF or CR.
Result<PlyHeader> read_ply_header(const InputFile& file);
// The layout points into header. An error if there are no vertices or faces to make a mesh of.
// uvs: whether coordinates of textures are wanted.
Result<PlyLayout> find_ply_layout(const PlyHeader& header, const std::string& name, bool uvs);

}  // namespace raypager
