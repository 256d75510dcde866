#include "pack/vertex_windows.hpp"

#include <algorithm>

#include "base/check.hpp"

namespace raypager {

VertexWindows::Reference VertexWindows::place(const uint32_t* vertices, uint32_t count) {
    const auto end = static_cast<uint32_t>(sequence_.size());
    // How far back the window may start if `fresh` vertices are appended: its first vertex is a multiple of the unit.
    const auto earliest = [end](uint32_t fresh) {
        const uint32_t reach = end + fresh;
        if (reach <= RP_CLUSTER_VERTICES) return 0u;
        return (reach - RP_CLUSTER_VERTICES + RP_CLUSTER_UNIT - 1) / RP_CLUSTER_UNIT * RP_CLUSTER_UNIT;
    };
    const auto count_missing = [&](uint32_t first) {
        uint32_t missing = 0;
        for (uint32_t i = 0; i < count; i++) missing += places_[vertices[i]] == RP_NONE || places_[vertices[i]] < first;
        return missing;
    };
    uint32_t oldest = RP_NONE, newest = 0;
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t place = places_[vertices[i]];
        oldest = std::min(oldest, place == RP_NONE ? end : place);
        newest = std::max(newest, place == RP_NONE ? RP_NONE : place);
    }
    uint32_t first = oldest / RP_CLUSTER_UNIT * RP_CLUSTER_UNIT;
    if (newest == RP_NONE || newest - first >= RP_CLUSTER_VERTICES) {
        // Each vertex that is appended may push the window on, so that another one is left behind.
        uint32_t fresh = count_missing(0);
        for (uint32_t missing; (missing = count_missing(earliest(fresh))) > fresh;) fresh = missing;
        const uint32_t limit = earliest(fresh);
        oldest = end;
        for (uint32_t i = 0; i < count; i++) {
            uint32_t& place = places_[vertices[i]];
            if (place == RP_NONE || place < limit) {
                place = static_cast<uint32_t>(sequence_.size());
                sequence_.push_back(vertices[i]);
            }
            oldest = std::min(oldest, place);
        }
        first = oldest / RP_CLUSTER_UNIT * RP_CLUSTER_UNIT;
    }
    Reference reference = {first, {}};
    for (uint32_t i = 0; i < RP_LEAF_MAX_PRIMITIVES + 2; i++) {
        const uint32_t offset = places_[vertices[std::min(i, count - 1)]] - first;
        RAYPAGER_CHECK(offset < RP_CLUSTER_VERTICES);
        reference.bytes[i] = static_cast<uint8_t>(offset);
    }
    return reference;
}

}  // namespace raypager
