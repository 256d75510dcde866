#include "render/film_windows.hpp"

#include <algorithm>
#include <utility>

#include "base/check.hpp"
#include "wavefront/sample_order.hpp"

namespace raypager {

FilmWindows::FilmWindows(const rp_render_params& params, std::vector<SampleRange> left, std::vector<rp_path_sample> again)
    : order_(params.order),
      width_(params.width),
      height_(params.height),
      rows_(params.film_rows),
      left_(merge_ranges(std::move(left))),
      again_(std::move(again)) {
    RAYPAGER_CHECK(rows_ >= height_ || rows_ % order_.tile_size == 0);
}

FilmWindows::Window FilmWindows::take() {
    RAYPAGER_CHECK(any_left());
    Window window;
    do {
        RAYPAGER_CHECK(next_row_ < height_);
        const uint64_t end_row = std::min<uint64_t>(height_, uint64_t{next_row_} + rows_), limit = left_.empty() ? 0 : left_.back().end;
        window.first_row = next_row_;
        const std::vector<SampleRange> numbers =
            numbers_of_places(order_, uint64_t{next_row_} * width_, end_row * width_, uint64_t{width_} * height_, limit);
        window.ranges = ranges_of_both(left_, numbers);
        left_ = ranges_without(left_, numbers);
        const auto here = std::partition(again_.begin(), again_.end(), [&](const rp_path_sample& s) { return s.pixel / width_ >= end_row; });
        window.again.assign(here, again_.end());
        again_.erase(here, again_.end());
        next_row_ = static_cast<uint32_t>(end_row);
    } while (window.ranges.empty() && window.again.empty());
    return window;
}

uint64_t FilmWindows::numbers_left() const {
    uint64_t numbers = 0;
    for (const SampleRange& range : left_) numbers += range.size();
    return numbers;
}

}  // namespace raypager
