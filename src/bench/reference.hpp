// The picture that others are compared with: the same scene with many samples and another seed. Made once and kept in a folder, under a
// name that follows from everything that decides it.
#pragma once

#include <cstdint>
#include <filesystem>

#include "raypager/picture.hpp"
#include "render/render.hpp"
#include "store/block_source.hpp"

namespace raypager::bench {

struct ReferenceSettings {
    uint32_t spp = 1024;
    std::filesystem::path folder;  // where references are kept
};

struct Reference {
    Image image;
    std::filesystem::path path;
    uint32_t spp = 0, seed = 0;
    bool was_there = false;  // it was found, not made
};

// options: of the renders that will be compared with it; size and camera are filled in. Renders it with all the memory there is.
Result<Reference> find_or_make_reference(const BlockSource& file, const RenderOptions& options, const ReferenceSettings& settings);
// Where it lies, or will lie.
std::filesystem::path reference_path(const BakedScene& scene, const RenderOptions& options, const ReferenceSettings& settings);

}  // namespace raypager::bench
