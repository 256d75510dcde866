#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "raypager/picture.hpp"

namespace raypager {
namespace {

Status check_finite(const Image& image, const char* which) {
    const auto bad = std::ranges::count_if(image.values, [](float v) { return !std::isfinite(v); });
    if (bad == 0) return {};
    return Status::failed(fmt::format("the {} picture has {} values that are not finite; it cannot be compared", which, bad));
}

}  // namespace

Result<ImageDifference> compare_images(const Image& a, const Image& b) {
    if (a.width != b.width || a.height != b.height || a.channels != b.channels)
        return Status::usage(fmt::format("the pictures differ in size: {} x {} with {} channels and {} x {} with {}; compare pictures of one size",
                                         a.width, a.height, a.channels, b.width, b.height, b.channels));
    if (a.values.empty()) return Status::usage("the pictures are empty; there is nothing to compare");
    RAYPAGER_TRY(check_finite(a, "first"));
    RAYPAGER_TRY(check_finite(b, "second"));

    double squares = 0, relative = 0, largest = 0;
    for (size_t i = 0; i < a.values.size(); i++) {
        const double reference = b.values[i];
        const double difference = a.values[i] - reference;
        squares += difference * difference;
        relative += difference * difference / (reference * reference + 0.01);
        largest = std::max(largest, std::abs(difference));
    }
    const auto count = static_cast<double>(a.values.size());
    return ImageDifference{std::sqrt(squares / count), relative / count, largest};
}

}  // namespace raypager
