#include "import/mesh_sample.hpp"

#include <algorithm>

#include "base/jitter.hpp"
#include "scene/clean_mesh.hpp"

namespace raypager {
namespace {

// Takes one triangle from anywhere in each stretch of so many: a fixed place might follow the rows of a regular mesh.
class TrianglePicker final : public MeshSink {
public:
    TrianglePicker(uint64_t most, std::vector<Triangle>& picked) : most_(most), picked_(picked) {}

    Status expect(uint64_t, uint64_t triangles) override {
        stretch_ = std::max<uint64_t>(1, (triangles + most_ - 1) / most_);
        return {};
    }
    Status vertices(const MeshVertices&) override { return {}; }
    Status triangles(std::span<const Triangle> indices) override {
        for (const Triangle& t : indices) {
            if (count_ % stretch_ == 0) wanted_ = count_ + jitter(count_, stretch_);
            if (count_++ == wanted_ && picked_.size() < most_) picked_.push_back(t);
        }
        return {};
    }
    uint64_t count() const { return count_; }

private:
    const uint64_t most_;
    std::vector<Triangle>& picked_;
    uint64_t stretch_ = 1, count_ = 0, wanted_ = 0;
};

// Takes the vertices of these numbers, which ascend.
class VertexPicker final : public MeshSink {
public:
    VertexPicker(std::span<const uint32_t> numbers, MeshSample& sample) : numbers_(numbers), sample_(sample) {}

    Status vertices(const MeshVertices& vertices) override {
        for (const Float3& p : vertices.positions) {
            if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) {
                sample_.lower = {std::min(sample_.lower.x, p.x), std::min(sample_.lower.y, p.y), std::min(sample_.lower.z, p.z)};
                sample_.upper = {std::max(sample_.upper.x, p.x), std::max(sample_.upper.y, p.y), std::max(sample_.upper.z, p.z)};
            }
            auto& found = sample_.mesh.positions;
            if (found.size() < numbers_.size() && numbers_[found.size()] == count_) found.push_back(p);
            count_++;
        }
        return {};
    }
    Status triangles(std::span<const Triangle>) override { return {}; }

private:
    const std::span<const uint32_t> numbers_;
    MeshSample& sample_;
    uint64_t count_ = 0;
};

}  // namespace

Result<MeshSample> sample_mesh(const MeshSource& source, uint64_t most, MeshIssues& issues) {
    MeshSample sample;
    MeshIssues counted_by_the_bake;
    TrianglePicker triangles(most, sample.mesh.triangles);
    if (auto status = source.stream(triangles, counted_by_the_bake); !status.ok()) return status;
    if (!sample.mesh.triangles.empty()) sample.triangles = static_cast<double>(triangles.count()) / static_cast<double>(sample.mesh.triangles.size());

    std::vector<uint32_t> numbers;
    for (const Triangle& t : sample.mesh.triangles) numbers.insert(numbers.end(), t.begin(), t.end());
    std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
    VertexPicker vertices(numbers, sample);
    if (auto status = source.stream(vertices, counted_by_the_bake); !status.ok()) return status;
    // Numbers of vertices that do not exist lie behind all others: they stay out of range.
    for (Triangle& t : sample.mesh.triangles)
        for (uint32_t& v : t) v = static_cast<uint32_t>(std::lower_bound(numbers.begin(), numbers.end(), v) - numbers.begin());
    clean_mesh(sample.mesh, issues);
    return sample;
}

}  // namespace raypager
