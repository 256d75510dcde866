// A camera and light for scenes that have none, as bare meshes get them.
#pragma once

#include <vector>

#include "import/framing.hpp"
#include "raypager/import.hpp"
#include "raypager/scene.hpp"

namespace raypager {

class SceneFraming {
public:
    // Without a camera the picture gets the size of the look. REQUIRES: all three stay while this is in use.
    SceneFraming(const Axes& axes, const BareLook& look, bool has_camera, Scene& scene);
    // Some of what is seen, and where it stands.
    void add(std::vector<Vector> points, const std::vector<Transform>& places);
    // Sets what there is not. The error names no file.
    Status finish(bool has_light, uint32_t ground_material);

private:
    std::vector<Vector> corners_of(const std::vector<Vector>& points) const;

    const Axes& axes_;
    const BareLook& look_;
    const bool has_camera_;
    Scene& scene_;
    Framing framing_;
    Vector lower_ = {INFINITY, INFINITY, INFINITY}, upper_ = {-INFINITY, -INFINITY, -INFINITY};
    uint64_t points_ = 0;
};

}  // namespace raypager
