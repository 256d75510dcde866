#include "import/placement_store.hpp"

#include <algorithm>
#include <filesystem>
#include <type_traits>

#include "scene/placement_hash.hpp"

namespace raypager {
namespace {

constexpr size_t placements_at_once = size_t{1} << 15;
static_assert(std::is_trivially_copyable_v<Placement>);

}  // namespace

Status PlacementStore::spill() {
    if (!file_) {
        std::error_code error;
        const auto folder = std::filesystem::temp_directory_path(error);
        auto file = SpillFile::create((error ? std::filesystem::path("/tmp") : folder) / "placements");
        if (!file) return file.status();
        file_ = std::move(*file);
    }
    RAYPAGER_TRY(wait_until_written());
    on_disk_ += recent_.size();
    // One after the other, and nobody else writes to the file: so they lie in their order.
    auto write = [file = file_, placements = std::exchange(recent_, {})] { return file->append(std::as_bytes(std::span(placements))).status(); };
    recent_.reserve(in_memory_);
    writing_ = std::async(std::launch::async | std::launch::deferred, std::move(write));
    return {};
}

Status PlacementStore::wait_until_written() { return writing_.valid() ? writing_.get() : Status(); }

Status PlacementStore::finish() {
    if (!file_) return {};
    if (!recent_.empty()) RAYPAGER_TRY(spill());
    recent_ = {};
    return wait_until_written();
}

Status PlacementStore::for_each_piece(const Take& take) const {
    std::vector<Placement> piece;
    for (uint64_t first = 0; first < on_disk_; first += piece.size()) {
        piece.resize(std::min<uint64_t>(placements_at_once, on_disk_ - first));
        RAYPAGER_TRY(file_->read(first * sizeof(Placement), std::as_writable_bytes(std::span(piece))));
        RAYPAGER_TRY(take(piece));
    }
    for (auto rest = std::span(recent_); !rest.empty(); rest = rest.subspan(piece.size())) {
        piece.assign(rest.begin(), rest.begin() + static_cast<ptrdiff_t>(std::min(placements_at_once, rest.size())));
        RAYPAGER_TRY(take(piece));
    }
    return {};
}

StoredInstances::StoredInstances(std::string name, std::shared_ptr<const PlacementStore> store,
                                 std::shared_ptr<const std::vector<PlacedObject>> objects, const std::array<double, 3>& origin)
    : name_(std::move(name)), store_(std::move(store)), objects_(std::move(objects)), origin_(origin) {}

Status StoredInstances::prepare(const std::function<Status(const Placement&)>& left_out) {
    Hash64Stream hash;
    count_ = 0;
    RAYPAGER_TRY(store_->for_each_piece([&](std::span<Placement> placements) -> Status {
        for (const Placement& placement : placements)
            if ((*objects_)[placement.object].number == RP_NONE) RAYPAGER_TRY(left_out(placement));
        const auto some = kept(placements);
        count_ += some.size();
        add_placements(some, hash);
        return {};
    }));
    fingerprint_ = hash.value();
    return {};
}

Status StoredInstances::stream(const std::function<Status(std::span<const Placement>)>& take) const {
    return store_->for_each_piece([&](std::span<Placement> placements) {
        const auto some = kept(placements);
        return some.empty() ? Status() : take(some);
    });
}

std::span<const Placement> StoredInstances::kept(std::span<Placement> placements) const {
    const auto left_out = [&](const Placement& p) { return (*objects_)[p.object].number == RP_NONE; };
    const auto end = std::remove_if(placements.begin(), placements.end(), left_out);
    const auto some = placements.first(static_cast<size_t>(end - placements.begin()));
    for (Placement& placement : some) {
        const PlacedObject& object = (*objects_)[placement.object];
        for (size_t i = 0; i < 3; ++i) {
            auto& row = placement.to_world[i];
            for (size_t a = 0; a < 3; ++a) row[3] += row[a] * object.origin[a];
            row[3] -= origin_[i];
        }
        placement.object = object.number;
    }
    return some;
}

}  // namespace raypager
