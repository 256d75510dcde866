// What fixtures of tests that render one scene again and again have in common.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>

#include "support/device_scene.hpp"
#include "support/small_scene.hpp"
#include "support/temporary_folder.hpp"

namespace raypager::support {

// A small scene, baked as scene.rpb into blocks of so few bytes that there are several.
class SmallSceneFile : public testing::Test {
protected:
    // Throws if it cannot be baked, which ends the test.
    SmallSceneFile() {
        BakeOptions options;
        options.block_bytes = 16 << 10;
        auto file = bake_and_open(small_scene(40), options, folder_.path(), "scene");
        if (!file) throw std::runtime_error(file.status().message());
        file_ = *file;
    }

    TemporaryFolder folder_;
    std::shared_ptr<const BlockFile> file_;
};

}  // namespace raypager::support
