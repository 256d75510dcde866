// What a look at the points of clouds tells about how to show them.
#pragma once

#include <memory>
#include <vector>

#include "import/cloud_file.hpp"
#include "import/framing.hpp"

namespace raypager {

struct CloudSurvey {
    std::vector<Vector> points;  // some of all clouds, strays left out; relative to origin
    Vector lower = {INFINITY, INFINITY, INFINITY}, upper = {-INFINITY, -INFINITY, -INFINITY};  // of these
    double ball = 0;            // radius of the balls that are drawn around them, about; 0 where it does not matter for the frame
    Vector origin = {0, 0, 0};  // the first cloud's; all are shown relative to it
    bool z_up = false;          // a format of surveying, surveyed coordinates, or flat like a landscape
    bool landscape = false;     // z is up, and the points bring their own ground
};

// lower and upper hold the balls, too. An error where a cloud has no point.
Result<CloudSurvey> survey_clouds(const std::vector<std::shared_ptr<const CloudFile>>& clouds);

}  // namespace raypager
