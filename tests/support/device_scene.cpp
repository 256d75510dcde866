#include "support/device_scene.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "raypager/abi/path.h"

namespace raypager::support {

TemporaryFolder::TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "raypager-test-XXXXXX").string();
    path_ = ::mkdtemp(pattern.data());
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

Result<std::shared_ptr<const BlockFile>> bake_and_open(const Scene& scene, const BakeOptions& options, const std::filesystem::path& folder,
                                                       const std::string& name) {
    const std::filesystem::path path = folder / (name + ".rpb");
    auto summary = bake(scene, options, path);
    if (!summary) return summary.status();
    return BlockFile::open(path);
}

Result<std::unique_ptr<DeviceScene>> DeviceScene::create(std::shared_ptr<const BlockFile> file, uint64_t slab_bytes) {
    std::unique_ptr<DeviceScene> result(new DeviceScene);
    result->file_ = std::move(file);
    auto device = Device::open("", 0);
    if (!device) return device.status();
    result->device_ = std::move(*device);
    const BakedScene& scene = result->scene();
    ResidencySettings settings;
    settings.slab_bytes = slab_bytes;
    // Slabs have ends that no block fits into.
    const uint64_t spare = slab_bytes ? scene.geometry_bytes() / slab_bytes * scene.largest_block() * 2 + slab_bytes : 0;
    settings.pool_bytes = scene.geometry_bytes() + spare;
    settings.policy = default_settings(PolicyKind::lru);
    auto residency = Residency::create(*result->device_, *result->file_, settings);
    if (!residency) return residency.status();
    result->residency_ = std::move(*residency);
    struct Part {
        Buffer& buffer;
        std::span<const std::byte> contents;
    };
    const std::vector<uint32_t> demand(std::max<size_t>(1, scene.blocks.size() * RP_DEMAND_ARRAYS));
    const Part parts[] = {{result->top_grid_, std::as_bytes(std::span(&scene.top_grid, 1))},
                          {result->top_nodes_, bytes_of(scene.top_nodes)},
                          {result->portals_, bytes_of(scene.portals)},
                          {result->portal_paths_, bytes_of(scene.portal_paths)},
                          {result->demand_, bytes_of(demand)}};
    for (const Part& part : parts) {
        auto buffer = result->device_->upload(part.contents, "a test's scene");
        if (!buffer) return buffer.status();
        part.buffer = std::move(*buffer);
    }
    RAYPAGER_TRY(result->load_all_blocks());
    return result;
}

Status DeviceScene::load_all_blocks() {
    const size_t count = scene().blocks.size();
    std::vector<uint32_t> demand(count * RP_DEMAND_ARRAYS);
    for (uint32_t round = 1;; round++) {
        size_t absent = 0;
        for (size_t i = 0; i < count; i++) {
            const bool resident = residency_->blocks()[i].state == PageState::resident;
            demand[RP_DEMAND_WANTS * count + i] = resident ? 0 : 1;
            absent += !resident;
        }
        if (absent == 0) break;
        RAYPAGER_TRY(residency_->after_round(round, demand, 0, 1));
        auto arrived = residency_->wait_for_block(round);
        if (!arrived) return arrived.status();
        if (!*arrived) return Status::failed("a block never came");
    }
    if (residency_->statistics().evictions) return Status::failed("the pool is too small for all blocks at once");
    return residency_->publish(device_->kernels());
}

namespace {

// Kernels expect directions of about unit length: scales by a power of two, which changes no digit. Returns the exponent.
int normalise(ProbeRay& ray) {
    int exponent = 0;
    std::frexp(std::max({std::abs(ray.direction.x), std::abs(ray.direction.y), std::abs(ray.direction.z)}), &exponent);
    for (float* v : {&ray.direction.x, &ray.direction.y, &ray.direction.z}) *v = std::ldexp(*v, -exponent);
    ray.t_max = std::ldexp(ray.t_max, exponent);
    return exponent;
}

}  // namespace

Result<std::vector<ProbeHit>> DeviceScene::trace(const std::vector<ProbeRay>& rays_of_any_length) {
    static_assert(sizeof(ProbeRay) == 32 && sizeof(ProbeHit) == 32);
    std::vector<ProbeRay> rays = rays_of_any_length;
    std::vector<int> exponents;
    for (ProbeRay& ray : rays) exponents.push_back(normalise(ray));
    const std::vector<Buffer>& slabs = residency_->slabs();
    auto kernel = device_->kernel("probe", "rp_probe", fmt::format("-DRP_SLABS={} -DRP_STACK_SIZE=96", slabs.size() == 1 ? 1 : RP_MAX_SLABS));
    if (!kernel) return kernel.status();
    auto input = device_->upload(bytes_of(rays), "rays");
    if (!input) return input.status();
    auto output = device_->allocate(rays.size() * sizeof(ProbeHit), "hits");
    if (!output) return output.status();
    const auto block_count = static_cast<uint32_t>(scene().blocks.size());
    const auto ray_count = static_cast<uint32_t>(rays.size());
    const auto slab = [&](size_t i) -> const Buffer& { return slabs[i < slabs.size() ? i : 0]; };
    const Buffer& pages = residency_->page_table();
    if (slabs.size() == 1)
        RAYPAGER_TRY(kernel->set(top_grid_, top_nodes_, portals_, portal_paths_, pages, demand_, slab(0), block_count, *input, ray_count, *output));
    else
        RAYPAGER_TRY(kernel->set(top_grid_, top_nodes_, portals_, portal_paths_, pages, demand_, slab(0), slab(1), slab(2), slab(3), slab(4), slab(5),
                                 slab(6), slab(7), block_count, *input, ray_count, *output));
    RAYPAGER_TRY(device_->kernels().launch(*kernel, rays.size(), device_->group_size()));
    std::vector<ProbeHit> hits(rays.size());
    RAYPAGER_TRY(device_->kernels().read_now(*output, 0, std::as_writable_bytes(std::span(hits))));
    for (size_t i = 0; i < hits.size(); i++) hits[i].t = std::ldexp(hits[i].t, -exponents[i]);
    return hits;
}

}  // namespace raypager::support
