#include <algorithm>
#include <array>
#include <cstring>
#include <set>
#include <span>

#include "raypager/scene.hpp"
#include "scene/placement_hash.hpp"

namespace raypager {

// Field by field: what lies between them is not set.
void add_placements(std::span<const Placement> placements, Hash64Stream& hash) {
    constexpr size_t at_once = 256, object_bytes = sizeof(Placement::object), matrix_bytes = sizeof(Placement::to_world);
    constexpr size_t look_bytes = sizeof(Placement::material) + sizeof(Placement::color), each = object_bytes + matrix_bytes + look_bytes;
    std::array<std::byte, at_once * each> bytes;
    while (!placements.empty()) {
        const auto some = placements.first(std::min(placements.size(), at_once));
        for (size_t i = 0; i < some.size(); ++i) {
            std::memcpy(&bytes[i * each], &some[i].object, object_bytes);
            std::memcpy(&bytes[i * each + object_bytes], some[i].to_world.data(), matrix_bytes);
            std::memcpy(&bytes[i * each + object_bytes + matrix_bytes], &some[i].material, sizeof(Placement::material));
            std::memcpy(&bytes[i * each + object_bytes + matrix_bytes + sizeof(Placement::material)], &some[i].color, sizeof(Placement::color));
        }
        hash.add(std::span(bytes).first(some.size() * each));
        placements = placements.subspan(some.size());
    }
}

InstancesInMemory::InstancesInMemory(std::string name, std::vector<Placement> placements)
    : name_(std::move(name)), placements_(std::move(placements)) {
    std::set<ObjectMaterial> found;
    for (const Placement& placement : placements_)
        if (placement.material != RP_NONE) found.insert({placement.object, placement.material});
    materials_.assign(found.begin(), found.end());
}

uint64_t InstancesInMemory::fingerprint() const {
    Hash64Stream hash;
    add_placements(placements_, hash);
    return hash.value();
}

}  // namespace raypager
