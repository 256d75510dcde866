#include "gather/mesh_prefetch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <new>

#include "base/check.hpp"
#include "base/huge_pages.hpp"
#include "base/parallel.hpp"
#include "gather/mesh_intake.hpp"
#include "scene/clean_mesh.hpp"
#include "scene/texture_use.hpp"

namespace raypager {
namespace {

// Keeps a mesh as it comes, unless it grows too large.
class SmallMeshSink final : public MeshSink {
public:
    SmallMeshSink(TriangleMesh& mesh, uint64_t limit, bool uvs, const std::atomic<bool>* stop) : mesh_(mesh), limit_(limit), uvs_(uvs), stop_(stop) {}

    Status expect(uint64_t vertices, uint64_t triangles) override {
        RAYPAGER_TRY(check(vertices, triangles));
        reserve_huge(mesh_.positions, vertices);
        reserve_huge(mesh_.triangles, triangles);
        return {};
    }
    Status vertices(const MeshVertices& vertices) override {
        RAYPAGER_TRY(check(mesh_.positions.size() + vertices.positions.size(), mesh_.triangles.size()));
        mesh_.positions.insert(mesh_.positions.end(), vertices.positions.begin(), vertices.positions.end());
        mesh_.normals.insert(mesh_.normals.end(), vertices.normals.begin(), vertices.normals.end());
        mesh_.colors.insert(mesh_.colors.end(), vertices.colors.begin(), vertices.colors.end());
        if (uvs_) mesh_.uvs.insert(mesh_.uvs.end(), vertices.uvs.begin(), vertices.uvs.end());
        return {};
    }
    Status triangles(std::span<const Triangle> indices) override {
        RAYPAGER_TRY(check(mesh_.positions.size(), mesh_.triangles.size() + indices.size()));
        mesh_.triangles.insert(mesh_.triangles.end(), indices.begin(), indices.end());
        return {};
    }
    uint64_t buffer_bytes() const override { return limit_ / buffer_share; }
    bool wants_uvs() const override { return uvs_; }
    bool too_large() const { return too_large_; }

private:
    Status check(uint64_t vertices, uint64_t triangles) {
        if (stop_ && *stop_) return Status::interrupted("stopped by a signal; nothing was written");
        const VertexAttributes attributes = {.normals = true, .colors = !mesh_.colors.empty(), .uvs = !mesh_.uvs.empty()};
        if (MeshIntake::memory_bytes(vertices, triangles, attributes) <= limit_ - buffer_bytes()) return {};
        too_large_ = true;
        return Status::failed("too large to be read ahead");
    }

    static constexpr uint64_t buffer_share = 16;
    TriangleMesh& mesh_;
    const uint64_t limit_;
    const bool uvs_;
    const std::atomic<bool>* const stop_;
    bool too_large_ = false;
};

}  // namespace

size_t workers_for_mesh(size_t workers, uint64_t bytes, uint64_t other_bytes) {
    const double share = (1.0 + static_cast<double>(bytes)) / (1.0 + static_cast<double>(bytes) + static_cast<double>(other_bytes));
    return std::clamp<size_t>(static_cast<size_t>(std::lround(share * static_cast<double>(workers))), 1, workers);
}

MeshPrefetch::MeshPrefetch(const Scene& scene, uint64_t bytes, const std::atomic<bool>* stop) : scene_(scene), stop_(stop) {
    for (size_t i = 0; i < scene.shapes.size(); i++)
        if (scene.shapes[i].mesh && !scene.shapes[i].unseen) order_.push_back(i);
    if (order_.size() < 2) return;  // nothing to read while the only one is placed
    left_.resize(order_.size() + 1);
    for (size_t n = order_.size(); n-- > 0;) left_[n] = left_[n + 1] + scene.shapes[order_[n]].mesh->bytes_to_read();
    const size_t threads = std::min(workers_, order_.size());
    slots_.resize(2 * threads);
    bytes_each_ = bytes / slots_.size();
    for (size_t i = 0; i < threads; i++) threads_.emplace_back([this] { work(); });
}

MeshPrefetch::~MeshPrefetch() {
    {
        const std::lock_guard lock(mutex_);
        ends_ = true;
    }
    changed_.notify_all();
}

void MeshPrefetch::work() {
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait(lock, [this] { return ends_ || next_ == order_.size() || next_ < taken_ + slots_.size(); });
        if (ends_ || next_ == order_.size()) return;
        Slot& slot = slots_[next_ % slots_.size()];
        slot = {order_[next_++], false, {}};
        const uint64_t behind = left_[next_], mine = left_[next_ - 1] - behind;
        const size_t workers = workers_for_mesh(workers_, mine, behind + under_way_);
        under_way_ += mine;
        lock.unlock();
        auto loaded = load(scene_.shapes[slot.shape], workers);
        lock.lock();
        under_way_ -= mine;
        slot.loaded = std::move(loaded);
        slot.done = true;
        changed_.notify_all();
    }
}

std::optional<MeshPrefetch::Loaded> MeshPrefetch::load(const Shape& shape, size_t workers) const {
    const MeshSource& source = *shape.mesh;
    const WorkersAtMost helpers(workers);
    Loaded loaded;
    SmallMeshSink sink(loaded.mesh, bytes_each_, wants_uvs(scene_, shape), stop_);
    try {
        loaded.status = source.stream(sink, loaded.issues);
        if (sink.too_large()) return {};
        if (loaded.status.ok()) clean_mesh(loaded.mesh, loaded.issues);
    } catch (const std::bad_alloc&) {
        loaded.status = Status::failed(fmt::format("{}: not enough memory for its mesh; give a smaller --host-limit", source.name()));
    }
    return loaded;
}

std::optional<MeshPrefetch::Loaded> MeshPrefetch::take(size_t shape) {
    if (threads_.empty()) return {};
    std::unique_lock lock(mutex_);
    RAYPAGER_CHECK(taken_ < order_.size() && order_[taken_] == shape);
    Slot& slot = slots_[taken_ % slots_.size()];
    changed_.wait(lock, [&] { return next_ > taken_ && slot.done; });
    taken_++;
    auto loaded = std::move(slot.loaded);
    slot.loaded.reset();
    slot.done = false;
    changed_.notify_all();
    return loaded;
}

}  // namespace raypager
