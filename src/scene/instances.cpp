#include <array>
#include <span>

#include "base/hash.hpp"
#include "raypager/scene.hpp"

namespace raypager {

// Field by field: what lies between them is not set.
uint64_t InstancesInMemory::fingerprint() const {
    Hash64Stream hash;
    for (const Placement& placement : placements_) {
        hash.add(std::as_bytes(std::span(&placement.object, 1)));
        hash.add(std::as_bytes(std::span(placement.to_world)));
    }
    return hash.value();
}

}  // namespace raypager
