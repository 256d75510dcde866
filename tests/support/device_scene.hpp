// A baked scene wholly on a device, and rays traced through it by the engine's own kernels, outside of any render.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "device/device.hpp"
#include "raypager/bake.hpp"
#include "raypager/scene.hpp"
#include "residency/residency.hpp"
#include "store/block_file.hpp"
#include "support/temporary_folder.hpp"
#include "wavefront/block_form.hpp"
#include "wavefront/geometry_buffers.hpp"

namespace raypager::support {

struct ProbeRay {
    Float3 origin;
    float t_max;
    Float3 direction;  // of any length; distances are in units of it
    float unused = 0;
};

struct ProbeHit {
    float t;  // INFINITY: none
    uint32_t primitive, normal, occluded;
    Float3 position;
    uint32_t block_entry;
};

// Bakes into folder / (name + ".rpb") and opens it.
Result<std::shared_ptr<const BlockFile>> bake_and_open(const Scene& scene, const BakeOptions& options, const std::filesystem::path& folder,
                                                       const std::string& name);

// How blocks lie on the default device unless something else is asked for.
BlockForm default_form();
// Ways of tracing that suit the default device: streams are not for all.
std::vector<Traversal> traversals();

class DeviceScene {
public:
    // slab_bytes: of the pool's slabs at most; 0: one slab if the device allows. other: the file's scene with another top tree.
    static Result<std::unique_ptr<DeviceScene>> create(std::shared_ptr<const BlockFile> file, uint64_t slab_bytes = 0,
                                                       Traversal traversal = Traversal::automatic, const BakedScene* other = nullptr);
    // more_definitions: " -D..." for the kernels. Their round is 1.
    Result<std::vector<ProbeHit>> trace(const std::vector<ProbeRay>& rays, const std::string& more_definitions = {});
    const BakedScene& scene() const { return file_->scene(); }
    // For tests with kernels of their own, or a page table that does not have all blocks.
    Device& device() { return *device_; }
    const GeometryBuffers& geometry() const { return *geometry_; }
    size_t slab_count() const { return residency_->slabs().size(); }

private:
    DeviceScene() = default;
    std::shared_ptr<const BlockFile> file_;
    std::unique_ptr<Device> device_;
    std::unique_ptr<Residency> residency_;
    std::unique_ptr<GeometryBuffers> geometry_;
};

}  // namespace raypager::support
