// Whether two Monte Carlo pictures show the same thing: differences in units of their own standard deviation, by blocks of pixels.
#pragma once

#include <cstdint>
#include <string>

#include "raypager/picture.hpp"

namespace raypager::reference {

// Two independent estimates (other seeds) of one picture with the same number of samples. Their mean is the estimate, and a quarter of
// their squared difference, averaged over the pixels of a block, estimates its variance.
struct ImagePair {
    Image first, second;
};

struct ComparisonOptions {
    uint32_t block_size = 8;  // pixels
    // Differences of this share of the brightness are let pass: for known systematic ones such as quantised normals.
    double relative_tolerance = 0;
};

struct StatisticalComparison {
    // Over the whole picture, of the channel where the difference is least likely.
    double mean_relative_error = 0;  // (candidate - reference) / reference
    double mean_z = 0;               // the same difference in its standard deviations
    // Over blocks and channels.
    double max_block_z = 0;                                // absolute
    double rms_block_z = 0;                                // about 1 (a little less: variances are estimated cautiously) where only noise differs
    uint32_t worst_x = 0, worst_y = 0, worst_channel = 0;  // first pixel of the block of max_block_z
    uint32_t blocks = 0;

    // Noise alone breaks each of the limits in less than one comparison in ten thousand, with pictures of up to some thousand blocks.
    bool agrees(double mean_limit = 4.5, double block_limit = 7, double rms_limit = 1.25) const;
    std::string describe() const;
};

// All images have the same size and three channels.
StatisticalComparison compare_statistically(const ImagePair& candidate, const ImagePair& reference, const ComparisonOptions& options = {});
// One candidate picture, whose variance is taken to be variance_ratio times that of the reference's mean: the reference's samples (both
// halves) over the candidate's, if both sample alike. Less sure where rare bright samples are met.
StatisticalComparison compare_statistically(const Image& candidate, double variance_ratio, const ImagePair& reference,
                                            const ComparisonOptions& options = {});

}  // namespace raypager::reference
