// The triangles and spheres of a block file by what they look like.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "block/decode.hpp"
#include "raypager/status.hpp"
#include "store/block_file.hpp"

namespace raypager::bench {

// Primitives of one material that shine alike, or not at all.
struct Group {
    uint32_t material = 0;
    bool shines = false;
    Float3 radiance;
    uint64_t triangles = 0, spheres = 0;
    bool normals = false;  // some triangle has them at its corners
    bool colored = false;  // its points bring their own colours
};

class Groups {
public:
    explicit Groups(const BakedScene& scene);
    std::span<Group> all() { return groups_; }
    uint32_t of_primitive(uint32_t id) const;  // index into all()
    // A primitive that shines to both sides: the exporter cannot say so.
    bool two_sided() const { return two_sided_; }

private:
    std::vector<uint32_t> first_primitive_, group_;  // by range
    std::vector<Group> groups_;
    bool two_sided_ = false;
};

// Decodes all blocks in their order, each in some parts.
Status for_each_part(const BlockFile& file, const std::function<Status(const DecodedLeaf& primitives)>& take);

}  // namespace raypager::bench
