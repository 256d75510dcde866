#include "support/device_scene.hpp"

#include <algorithm>
#include <cmath>

#include "support/probe_kernels.hpp"

namespace raypager::support {

Result<std::shared_ptr<const BlockFile>> bake_and_open(const Scene& scene, const BakeOptions& options, const std::filesystem::path& folder,
                                                       const std::string& name) {
    const std::filesystem::path path = folder / (name + ".rpb");
    auto summary = bake(scene, options, path);
    if (!summary) return summary.status();
    return BlockFile::open(path);
}

BlockForm default_form() {
    const auto device = Device::open("", 0);
    return block_form(Traversal::automatic, device.ok() ? (*device)->info() : DeviceInfo(), 0);
}

std::vector<Traversal> traversals() {
    if (default_form() == BlockForm::stored) return {Traversal::ray};
    return {Traversal::ray, Traversal::stream};
}

Result<std::unique_ptr<DeviceScene>> DeviceScene::create(std::shared_ptr<const BlockFile> file, uint64_t slab_bytes, Traversal traversal,
                                                         const BakedScene* other) {
    std::unique_ptr<DeviceScene> result(new DeviceScene);
    result->file_ = std::move(file);
    auto device = Device::open("", 0);
    if (!device) return device.status();
    result->device_ = std::move(*device);
    const BakedScene& scene = result->scene();
    const BlockForm form = block_form(traversal, result->device_->info(), scene.instance_levels());
    ResidencySettings settings;
    settings.form = form;
    settings.slab_bytes = slab_bytes;
    // Slabs have ends that no block fits into.
    const uint64_t spare = slab_bytes ? scene.memory_bytes(form) / slab_bytes * scene.largest_pageable(form) * 2 + slab_bytes : 0;
    settings.pool_bytes = scene.memory_bytes(form) + spare;
    settings.policy = default_settings(PolicyKind::lru);
    auto residency = Residency::create(*result->device_, *result->file_, settings);
    if (!residency) return residency.status();
    result->residency_ = std::move(*residency);
    auto geometry =
        GeometryBuffers::create(*result->device_, other ? *other : scene, form, result->residency_->slabs(), result->residency_->page_table());
    if (!geometry) return geometry.status();
    result->geometry_ = std::make_unique<GeometryBuffers>(std::move(*geometry));
    RAYPAGER_TRY(result->residency_->load_all(result->device_->kernels()));
    return result;
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

Result<std::vector<ProbeHit>> DeviceScene::trace(const std::vector<ProbeRay>& rays_of_any_length, const std::string& more_definitions) {
    static_assert(sizeof(ProbeRay) == 32 && sizeof(ProbeHit) == 32);
    std::vector<ProbeRay> rays = rays_of_any_length;
    std::vector<int> exponents;
    for (ProbeRay& ray : rays) exponents.push_back(normalise(ray));
    device_->use_more_sources(probe_sources());
    auto kernel = device_->kernel(geometry_->kernel_name(*device_, "probe", device_->profile().closest_hit_registers, more_definitions));
    if (!kernel) return kernel.status();
    auto input = device_->upload(bytes_of(rays), "rays");
    if (!input) return input.status();
    auto output = device_->allocate(rays.size() * sizeof(ProbeHit), "hits");
    if (!output) return output.status();
    RAYPAGER_TRY(geometry_->set(*kernel, *input, static_cast<uint32_t>(rays.size()), *output));
    if (geometry_->form() == BlockForm::wide)
        RAYPAGER_TRY(geometry_->launch(*device_, device_->kernels(), *kernel, rays.size(), nullptr));
    else
        RAYPAGER_TRY(device_->kernels().launch(*kernel, rays.size(), device_->group_size()));
    std::vector<ProbeHit> hits(rays.size());
    RAYPAGER_TRY(device_->kernels().read_now(*output, 0, std::as_writable_bytes(std::span(hits))));
    for (size_t i = 0; i < hits.size(); i++) hits[i].t = std::ldexp(hits[i].t, -exponents[i]);
    return hits;
}

}  // namespace raypager::support
