#include "gather/vertex_file.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <vector>

#include "base/check.hpp"
#include "base/parallel.hpp"

namespace raypager {
namespace {

constexpr uint32_t page_vertices = 4096;  // 64 to 112 KiB

// The front of a vertex, up to the last attribute that any has.
size_t stride_of(const VertexAttributes& attributes) {
    return attributes.uvs ? sizeof(VertexBits) : attributes.colors ? offsetof(VertexBits, uv) : offsetof(VertexBits, color);
}

// The corners filed under the page of their vertex: those of page p are corners[first[p]] .. corners[first[p + 1] - 1].
struct CornersByPage {
    std::vector<uint32_t> first, corners;

    CornersByPage(std::span<const Triangle> triangles, size_t pages) : first(pages + 2), corners(3 * triangles.size()) {
        for (const Triangle& t : triangles)
            for (const uint32_t v : t) first[v / page_vertices + 2]++;
        for (size_t p = 2; p < first.size(); p++) first[p] += first[p - 1];
        // first[p + 1] runs from the start of page p to its end, where page p + 1 starts.
        for (size_t i = 0; i < corners.size(); i++) corners[first[triangles[i / 3][i % 3] / page_vertices + 1]++] = static_cast<uint32_t>(i);
        first.pop_back();
    }
};

}  // namespace

Result<VertexFile> VertexFile::create(const std::filesystem::path& beside) {
    auto file = SpillFile::create(beside);
    if (!file) return file.status();
    VertexFile vertices;
    vertices.file_ = std::move(*file);
    return vertices;
}

Status VertexFile::append(std::span<const VertexBits> vertices, const VertexAttributes& attributes) {
    if (count_ == 0) stride_ = stride_of(attributes);
    RAYPAGER_CHECK(stride_ == stride_of(attributes));
    packed_.resize(vertices.size() * stride_);
    for (size_t i = 0; i < vertices.size(); i++) std::memcpy(&packed_[i * stride_], &vertices[i], stride_);
    const auto offset = file_->append(packed_);
    if (!offset) return offset.status();
    RAYPAGER_CHECK(*offset == count_ * stride_);
    count_ += vertices.size();
    return {};
}

Status VertexFile::fetch(std::span<const Triangle> triangles, std::span<VertexBits> corners) const {
    RAYPAGER_CHECK(corners.size() == 3 * triangles.size());
    const size_t pages = (count_ + page_vertices - 1) / page_vertices;
    const CornersByPage filed(triangles, pages);
    return parallel_try(pages, 16, [&](size_t begin, size_t end) -> Status {
        std::vector<std::byte> page;
        for (size_t p = begin; p < end; p++) {
            const uint64_t first = uint64_t{p} * page_vertices;
            const auto uses = std::span(filed.corners).subspan(filed.first[p], filed.first[p + 1] - filed.first[p]);
            if (uses.empty()) continue;
            page.resize(std::min<uint64_t>(page_vertices, count_ - first) * stride_);
            RAYPAGER_TRY(file_->read(first * stride_, page));
            for (const uint32_t corner : uses) {
                corners[corner] = {};
                std::memcpy(&corners[corner], &page[(triangles[corner / 3][corner % 3] - first) * stride_], stride_);
            }
        }
        return {};
    });
}

}  // namespace raypager
