// A baked scene of which nobody reads the blocks: for what looks at its figures alone.
#pragma once

#include <memory>
#include <utility>

#include "store/block_source.hpp"

namespace raypager::support {

class SceneOnly final : public BlockSource {
public:
    explicit SceneOnly(BakedScene scene) : scene_(std::move(scene)) {}
    const BakedScene& scene() const override { return scene_; }

private:
    Status fetch(uint32_t, std::span<std::byte>) const override { return Status::failed("there are no blocks"); }
    Status damaged(uint32_t, const std::string& what) const override { return Status::failed(what); }
    BakedScene scene_;
};

inline Blocks blocks_of(BakedScene scene) { return Blocks(std::make_shared<SceneOnly>(std::move(scene))); }

}  // namespace raypager::support
