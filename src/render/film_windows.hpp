// Where the film does not fit into the memory of the device, the device holds the film of some rows of the picture at a time, a window: all samples
// of these rows are taken before those of the next window begin. Keeps which samples are left, by window.
#pragma once

#include <cstdint>
#include <vector>

#include "raypager/abi/path.h"
#include "raypager/abi/scene.h"
#include "wavefront/sample_numbers.hpp"

namespace raypager {

class FilmWindows {
public:
    struct Window {
        uint32_t first_row = 0;
        std::vector<SampleRange> ranges;    // that are to begin
        std::vector<rp_path_sample> again;  // whose paths were under way when a checkpoint was written
    };

    FilmWindows() = default;
    // left, again: of the whole picture. REQUIRES: params.film_rows is whole tiles, or all rows.
    FilmWindows(const rp_render_params& params, std::vector<SampleRange> left, std::vector<rp_path_sample> again);

    // The next one in which there is something to do. REQUIRES: some is left.
    Window take();
    // In windows that have not been taken:
    bool any_left() const { return !left_.empty() || !again_.empty(); }
    uint64_t numbers_left() const;
    const std::vector<SampleRange>& left() const { return left_; }
    const std::vector<rp_path_sample>& again() const { return again_; }
    void replace_left(std::vector<SampleRange> left) { left_ = merge_ranges(std::move(left)); }

private:
    rp_sample_order order_ = {};
    uint32_t width_ = 0, height_ = 0, rows_ = 0;  // rows: of a window
    uint32_t next_row_ = 0;
    std::vector<SampleRange> left_;
    std::vector<rp_path_sample> again_;
};

}  // namespace raypager
