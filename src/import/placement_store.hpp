// Placements of objects as a scene file names them, however many there are.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/files.hpp"
#include "raypager/scene.hpp"
#include "raypager/status.hpp"

namespace raypager {

// Few stay in memory. From when there are more, all go to a scratch file in the folder for temporary files; twice as many are in memory then.
class PlacementStore {
public:
    using Take = std::function<Status(std::span<Placement>)>;
    static constexpr size_t usually_in_memory = size_t{1} << 16;  // 7.5 MiB

    explicit PlacementStore(size_t in_memory = usually_in_memory) : in_memory_(in_memory) {}
    Status add(const Placement& placement) {
        recent_.push_back(placement);
        return recent_.size() < in_memory_ ? Status() : spill();
    }
    // No more will come. If some are on the disk, none stay in memory.
    Status finish();
    uint64_t count() const { return on_disk_ + recent_.size(); }
    bool is_on_disk() const { return file_ != nullptr; }
    // In the order in which they were added, by pieces that take may change: they are copies. A status that it returns ends the call and is passed
    // on.
    Status for_each_piece(const Take& take) const;

private:
    // Hands those in memory to a thread that writes them, when the one before is done.
    Status spill();
    Status wait_until_written();

    const size_t in_memory_;
    std::vector<Placement> recent_;
    std::shared_ptr<SpillFile> file_;
    std::future<Status> writing_;
    uint64_t on_disk_ = 0;
};

// Instances of those objects of the file that are objects of the scene.
class StoredInstances final : public InstanceSource {
public:
    // What has become of an object of the file.
    struct PlacedObject {
        uint32_t number = RP_NONE;          // in the scene; RP_NONE: its placements are left out
        std::array<double, 3> origin = {};  // of its space in the scene, in that of the file
    };
    // objects: by the numbers that the placements have. count, fingerprint: of those that are not left out. origin: of the space in which they are
    // placed, as of an object's.
    StoredInstances(std::string name, std::shared_ptr<const PlacementStore> store, std::shared_ptr<const std::vector<PlacedObject>> objects,
                    const std::array<double, 3>& origin = {});
    // Looks at all placements once. left_out: told of each that is left out, in order.
    Status prepare(const std::function<Status(const Placement&)>& left_out);

    Status stream(const std::function<Status(std::span<const Placement>)>& take) const override;
    uint64_t count() const override { return count_; }
    std::string name() const override { return name_; }
    uint64_t fingerprint() const override { return fingerprint_; }

private:
    // Moves those that stay to the front and into the spaces of the scene's objects; returns them.
    std::span<const Placement> kept(std::span<Placement> placements) const;

    std::string name_;
    std::shared_ptr<const PlacementStore> store_;
    std::shared_ptr<const std::vector<PlacedObject>> objects_;
    std::array<double, 3> origin_;
    uint64_t count_ = 0, fingerprint_ = 0;
};

}  // namespace raypager
