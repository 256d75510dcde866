#include <array>
#include <set>
#include <span>

#include "base/hash.hpp"
#include "raypager/scene.hpp"

namespace raypager {

InstancesInMemory::InstancesInMemory(std::string name, std::vector<Placement> placements)
    : name_(std::move(name)), placements_(std::move(placements)) {
    std::set<ObjectMaterial> found;
    for (const Placement& placement : placements_)
        if (placement.material != RP_NONE) found.insert({placement.object, placement.material});
    materials_.assign(found.begin(), found.end());
}

// Field by field: what lies between them is not set.
uint64_t InstancesInMemory::fingerprint() const {
    Hash64Stream hash;
    for (const Placement& placement : placements_) {
        hash.add(std::as_bytes(std::span(&placement.object, 1)));
        hash.add(std::as_bytes(std::span(placement.to_world)));
        hash.add(std::as_bytes(std::span(&placement.material, 1)));
        hash.add(std::as_bytes(std::span(&placement.color, 1)));
    }
    return hash.value();
}

}  // namespace raypager
