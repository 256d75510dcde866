#include "lights/steps.hpp"

#include <algorithm>
#include <cmath>

namespace raypager {

std::vector<uint32_t> steps_of(std::span<const double> probabilities) {
    constexpr double all = 4294967296.0;
    std::vector<uint32_t> steps;
    double sum = 0, before = 0;
    const double left_for_others = static_cast<double>(probabilities.size());
    for (size_t i = 0; i < probabilities.size(); i++) {
        sum += probabilities[i];
        // Room is kept for those that follow.
        const double most = all - (left_for_others - static_cast<double>(i) - 1);
        const double end = i + 1 == probabilities.size() ? all : std::clamp(std::floor(sum * all), before + 1, most);
        steps.push_back(static_cast<uint32_t>(end - 1));
        before = end;
    }
    return steps;
}

float share_of_step(std::span<const uint32_t> steps, size_t i) {
    const double before = i ? steps[i - 1] + 1.0 : 0.0;
    return static_cast<float>((steps[i] + 1.0 - before) * 0x1p-32);
}

}  // namespace raypager
