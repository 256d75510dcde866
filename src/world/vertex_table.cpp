#include "world/vertex_table.hpp"

#include <bit>
#include <cstddef>
#include <cstring>

namespace raypager {
namespace {

struct Words {
    uint64_t low, high;
    uint32_t last;
    bool operator==(const Words&) const = default;
};

// But for coordinates of textures.
template <class Vertex>
Words words_of(const Vertex& vertex) {
    static_assert(offsetof(Vertex, normal) == 12);
    Words words;
    std::memcpy(&words.low, &vertex, sizeof words.low);
    std::memcpy(&words.high, &vertex.position.z, sizeof words.high);
    words.last = vertex.color;
    return words;
}

uint64_t bits_of(const Float2& uv) { return std::bit_cast<uint64_t>(uv); }

uint64_t mix(const VertexBits& vertex) {
    const Words words = words_of(vertex);
    uint64_t h = words.low * 0x9e3779b97f4a7c15u;
    h = (h ^ h >> 32 ^ words.high ^ ~words.last ^ bits_of(vertex.uv) * 0xc2b2ae3d27d4eb4fu) * 0xd6e8feb86659fd93u;
    return h ^ h >> 32;
}

}  // namespace

VertexTable::VertexTable(size_t expected) : slots_(std::bit_ceil(2 * expected + 16), RP_NONE) {
    vertices_.reserve(expected);
    recent_.fill(RP_NONE);
}

uint32_t VertexTable::number(const VertexBits& vertex) {
    const uint64_t hash = mix(vertex);
    uint32_t& recent = recent_[hash >> 56];
    if (recent != RP_NONE && is(recent, vertex)) return recent;
    if (2 * vertices_.size() >= slots_.size()) enlarge();
    uint32_t& slot = find(vertex, hash);
    if (slot == RP_NONE) {
        slot = static_cast<uint32_t>(vertices_.size());
        vertices_.push_back({vertex.position, vertex.normal, vertex.color});
        if (bits_of(vertex.uv) != 0) {
            if (uvs_.capacity() == 0) uvs_.reserve(vertices_.capacity());
            uvs_.resize(slot);
            uvs_.push_back(vertex.uv);
        }
    }
    return recent = slot;
}

VertexBits VertexTable::operator[](size_t number) const {
    const Plain& plain = vertices_[number];
    return {plain.position, plain.normal, plain.color, number < uvs_.size() ? uvs_[number] : Float2{}};
}

std::vector<VertexBits> VertexTable::take() {
    std::vector<VertexBits> all;
    all.reserve(size());
    for (size_t i = 0; i < size(); i++) all.push_back((*this)[i]);
    *this = VertexTable(0);
    return all;
}

bool VertexTable::is(uint32_t number, const VertexBits& vertex) const {
    return words_of(vertices_[number]) == words_of(vertex) && (number < uvs_.size() ? bits_of(uvs_[number]) : 0) == bits_of(vertex.uv);
}

uint32_t& VertexTable::find(const VertexBits& vertex, uint64_t hash) {
    const size_t mask = slots_.size() - 1;
    size_t i = hash & mask;
    while (slots_[i] != RP_NONE && !is(slots_[i], vertex)) i = (i + 1) & mask;
    return slots_[i];
}

void VertexTable::enlarge() {
    slots_.assign(2 * slots_.size(), RP_NONE);
    for (uint32_t v = 0; v < vertices_.size(); v++) find((*this)[v], mix((*this)[v])) = v;
}

}  // namespace raypager
