#include "import/obj_corners.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace raypager {
namespace {

uint64_t bits(float x) { return std::bit_cast<uint32_t>(x + 0.0f); }
uint64_t hash_of(const Float3& v) { return bits(v.x) * 0x9e3779b97f4a7c15u ^ bits(v.y) * 0xc2b2ae3d27d4eb4fu ^ bits(v.z) << 21; }
uint64_t hash_of(const Float2& v) { return bits(v.x) * 0x9e3779b97f4a7c15u ^ bits(v.y) * 0xc2b2ae3d27d4eb4fu; }

template <class Item>
uint32_t number_of(std::vector<Item>& different, IndexTable& known, const Item& item) {
    const auto next = static_cast<uint32_t>(different.size());
    const uint32_t found = known.find_or_add(
        hash_of(item), next, [&](uint32_t i) { return hash_of(different[i]); }, [&](uint32_t i) { return different[i] == item; });
    if (found == next) different.push_back(item);
    return found;
}

}  // namespace

void ObjCorners::add_normal(const Float3& normal) {
    const bool finite = std::isfinite(normal.x) && std::isfinite(normal.y) && std::isfinite(normal.z);
    normal_numbers_.push_back(number_of(normals_, known_normals_, finite ? normal : Float3{}));
}

void ObjCorners::add_uv(const Float2& uv) { uv_numbers_.push_back(number_of(uvs_, known_uvs_, uv)); }

uint32_t ObjCorners::find_or_add(std::vector<Pair>& pairs, IndexTable& known, const Pair& pair) {
    if (pair.uv == RP_NONE && pair.normal == RP_NONE) return RP_NONE;
    const auto hash = [](const Pair& p) { return uint64_t{p.uv} << 32 | p.normal; };
    const auto next = static_cast<uint32_t>(pairs.size());
    const uint32_t found = known.find_or_add(
        hash(pair), next, [&](uint32_t i) { return hash(pairs[i]); }, [&](uint32_t i) { return pairs[i] == pair; });
    if (found == next) pairs.push_back(pair);
    return found;
}

const std::vector<uint32_t>& ObjCorners::attributes(std::vector<Triangle>& before, const std::vector<uint32_t>& uvs,
                                                    const std::vector<uint32_t>& normals) {
    const auto any = [](const std::vector<uint32_t>& numbers) {
        return std::any_of(numbers.begin(), numbers.end(), [](uint32_t n) { return n != RP_NONE; });
    };
    attributes_.clear();
    const bool any_uvs = any(uvs);
    if (!any_uvs && !any(normals)) return attributes_;
    if (any_uvs && !has_pairs_) {
        has_pairs_ = true;
        for (Triangle& corners : before)
            for (uint32_t& normal : corners) normal = find_or_add(pairs_, known_pairs_, {RP_NONE, normal});
    }
    for (size_t i = 0; i < normals.size(); ++i)
        attributes_.push_back(has_pairs_ ? find_or_add(pairs_, known_pairs_, {uvs[i], normals[i]}) : normals[i]);
    return attributes_;
}

// What is zero is none.
uint32_t ObjCorners::different_normal(uint32_t statement) const {
    const uint32_t number = statement < normal_numbers_.size() ? normal_numbers_[statement] : RP_NONE;
    return number == RP_NONE || normals_[number] == Float3{} ? RP_NONE : number;
}

// From numbers of statements to those of what differs.
void ObjCorners::number(std::vector<Triangle>& attributes, bool keep_uvs) {
    std::vector<Pair> different;
    std::vector<uint32_t> number_of_pair;
    IndexTable known;
    for (const Pair& pair : pairs_) {
        const uint32_t uv = keep_uvs && pair.uv < uv_numbers_.size() ? uv_numbers_[pair.uv] : RP_NONE;
        number_of_pair.push_back(find_or_add(different, known, {uv, different_normal(pair.normal)}));
    }
    pairs_ = std::move(different);
    for (Triangle& corners : attributes)
        for (uint32_t& attribute : corners)
            attribute = !has_pairs_ ? different_normal(attribute) : attribute == RP_NONE ? RP_NONE : number_of_pair[attribute];
}

void ObjCorners::split(TriangleMesh& mesh, std::vector<Triangle>& attributes, bool keep_uvs) {
    if (attributes.empty()) return;
    number(attributes, keep_uvs);
    const SplitVertices split = split_vertices(mesh.triangles, attributes, mesh.positions.size());
    bool any_uvs = false, any_normals = false;
    for (const uint32_t attribute : split.attribute) {
        if (attribute == RP_NONE) continue;
        any_uvs |= pair(attribute).uv != RP_NONE;
        any_normals |= pair(attribute).normal != RP_NONE;
    }
    if (!any_uvs && !any_normals) return;
    append_copies(mesh.positions, split);
    if (!mesh.colors.empty()) append_copies(mesh.colors, split);
    if (any_normals) mesh.normals.resize(mesh.positions.size());
    if (any_uvs) mesh.uvs.resize(mesh.positions.size());
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
        if (split.attribute[i] == RP_NONE) continue;
        const Pair named = pair(split.attribute[i]);
        if (named.normal != RP_NONE) mesh.normals[i] = normals_[named.normal];
        if (named.uv != RP_NONE) mesh.uvs[i] = uvs_[named.uv];
    }
}

}  // namespace raypager
