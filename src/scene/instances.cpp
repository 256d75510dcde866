#include <algorithm>
#include <array>
#include <cstring>
#include <span>

#include "raypager/scene.hpp"
#include "scene/placement_hash.hpp"

namespace raypager {

void add_placements(std::span<const Placement> placements, Hash64Stream& hash) {
    constexpr size_t at_once = 256, object_bytes = sizeof(Placement::object), each = object_bytes + sizeof(Placement::to_world);
    std::array<std::byte, at_once * each> bytes;
    while (!placements.empty()) {
        const auto some = placements.first(std::min(placements.size(), at_once));
        for (size_t i = 0; i < some.size(); ++i) {
            std::memcpy(&bytes[i * each], &some[i].object, object_bytes);
            std::memcpy(&bytes[i * each + object_bytes], some[i].to_world.data(), sizeof(Placement::to_world));
        }
        hash.add(std::span(bytes).first(some.size() * each));
        placements = placements.subspan(some.size());
    }
}

uint64_t InstancesInMemory::fingerprint() const {
    Hash64Stream hash;
    add_placements(placements_, hash);
    return hash.value();
}

}  // namespace raypager
