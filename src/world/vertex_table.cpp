#include "world/vertex_table.hpp"

#include <bit>
#include <cstring>

namespace raypager {
namespace {

struct Words {
    uint64_t low, high;
    uint32_t last;
    bool operator==(const Words&) const = default;
};

Words words_of(const VertexBits& vertex) {
    static_assert(sizeof(VertexBits) == 20);
    Words words;
    std::memcpy(&words.low, &vertex, sizeof words.low);
    std::memcpy(&words.high, &vertex.position.z, sizeof words.high);
    words.last = vertex.color;
    return words;
}

uint64_t mix(const Words& words) {
    uint64_t h = words.low * 0x9e3779b97f4a7c15u;
    h = (h ^ h >> 32 ^ words.high ^ ~words.last) * 0xd6e8feb86659fd93u;
    return h ^ h >> 32;
}

}  // namespace

VertexTable::VertexTable(size_t expected) : slots_(std::bit_ceil(2 * expected + 16), RP_NONE) {
    vertices_.reserve(expected);
    recent_.fill(RP_NONE);
}

uint32_t VertexTable::number(const VertexBits& vertex) {
    const Words words = words_of(vertex);
    const uint64_t hash = mix(words);
    uint32_t& recent = recent_[hash >> 56];
    if (recent != RP_NONE && words_of(vertices_[recent]) == words) return recent;
    if (2 * vertices_.size() >= slots_.size()) enlarge();
    uint32_t& slot = find(vertex, hash);
    if (slot == RP_NONE) {
        slot = static_cast<uint32_t>(vertices_.size());
        vertices_.push_back(vertex);
    }
    return recent = slot;
}

uint32_t& VertexTable::find(const VertexBits& vertex, uint64_t hash) {
    const Words words = words_of(vertex);
    const size_t mask = slots_.size() - 1;
    size_t i = hash & mask;
    while (slots_[i] != RP_NONE && !(words_of(vertices_[slots_[i]]) == words)) i = (i + 1) & mask;
    return slots_[i];
}

void VertexTable::enlarge() {
    slots_.assign(2 * slots_.size(), RP_NONE);
    for (uint32_t v = 0; v < vertices_.size(); v++) find(vertices_[v], mix(words_of(vertices_[v]))) = v;
}

}  // namespace raypager
