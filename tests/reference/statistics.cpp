#include "reference/statistics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/check.hpp"

namespace raypager::reference {
namespace {

constexpr uint32_t channels = 3;

// Of a block of pixels: the mean, and the estimated variance of that mean.
struct BlockEstimate {
    double mean = 0, variance = 0;
};

// Blocks of one channel, row by row.
struct BlockGrid {
    uint32_t columns = 0, rows = 0;
    std::vector<BlockEstimate> blocks{};
    std::vector<uint32_t> pixels{};
};

bool same_size(const Image& a, const Image& b) {
    return a.width == b.width && a.height == b.height && a.channels == channels && b.channels == channels && a.values.size() == b.values.size();
}

BlockGrid estimate_blocks(const Image& first, const Image& second, uint32_t channel, uint32_t size) {
    BlockGrid grid{.columns = (first.width + size - 1) / size, .rows = (first.height + size - 1) / size};
    grid.blocks.resize(size_t{grid.columns} * grid.rows);
    grid.pixels.resize(grid.blocks.size());
    for (uint32_t y = 0; y < first.height; y++) {
        for (uint32_t x = 0; x < first.width; x++) {
            const size_t at = channels * (size_t{y} * first.width + x) + channel, block = size_t{y / size} * grid.columns + x / size;
            const double a{first.values[at]}, b{second.values[at]};
            grid.blocks[block].mean += (a + b) / 2;
            grid.blocks[block].variance += (a - b) * (a - b) / 4;
            grid.pixels[block]++;
        }
    }
    for (size_t i = 0; i < grid.blocks.size(); i++) {
        const double n = grid.pixels[i];
        grid.blocks[i].mean /= n;
        grid.blocks[i].variance /= n * n;
    }
    return grid;
}

// Rare bright samples may be missing from both halves in one block and yet be seen in the candidate. So a block is granted at least
// the average variance of the blocks around it.
double cautious_variance(const BlockGrid& grid, uint32_t column, uint32_t row) {
    double sum = 0;
    uint32_t count = 0;
    for (uint32_t y = row - (row > 0); y <= std::min(row + 1, grid.rows - 1); y++) {
        for (uint32_t x = column - (column > 0); x <= std::min(column + 1, grid.columns - 1); x++) {
            sum += grid.blocks[size_t{y} * grid.columns + x].variance;
            count++;
        }
    }
    return std::max(grid.blocks[size_t{row} * grid.columns + column].variance, sum / count);
}

// What rounding to float and summing in fixed point may add where a block has no noise at all.
double rounding_variance(double mean) {
    const double error = 1e-5 * std::abs(mean) + 1e-7;
    return error * error;
}

// Signed, and zero within the tolerance.
double beyond_tolerance(double difference, double tolerance) { return std::copysign(std::max(0.0, std::abs(difference) - tolerance), difference); }

double z_value(double difference, double variance) {
    const double z = difference / std::sqrt(variance);
    return std::isfinite(z) ? z : std::numeric_limits<double>::infinity();  // a NaN in a picture is no agreement
}

// Accumulates over the channels; the candidate's variance is its own plus borrowed times the reference's.
class Comparison {
public:
    Comparison(const ComparisonOptions& options, double borrowed) : options_(options), borrowed_(borrowed) {}

    void add_channel(uint32_t channel, const BlockGrid& candidate, const BlockGrid& reference) {
        double difference = 0, variance = 0, total = 0, pixels = 0;
        for (uint32_t row = 0; row < reference.rows; row++) {
            for (uint32_t column = 0; column < reference.columns; column++) {
                const size_t i = size_t{row} * reference.columns + column;
                const BlockEstimate &c = candidate.blocks[i], &r = reference.blocks[i];
                add_block(channel, column, row, candidate, reference);
                const double n = reference.pixels[i];
                difference += n * (c.mean - r.mean);
                variance += n * n * (c.variance + r.variance * (1 + borrowed_));
                total += n * r.mean;
                pixels += n;
            }
        }
        const double mean = total / pixels;
        const double z = z_value(beyond_tolerance(difference / pixels, options_.relative_tolerance * std::abs(mean)),
                                 variance / (pixels * pixels) + rounding_variance(mean));
        if (channel == 0 || std::abs(z) > std::abs(result_.mean_z)) {
            result_.mean_z = z;
            result_.mean_relative_error = total != 0 ? difference / total : 0;
        }
    }

    StatisticalComparison finish() {
        result_.rms_block_z = std::sqrt(sum_z2_ / result_.blocks);
        result_.blocks /= channels;
        return result_;
    }

private:
    void add_block(uint32_t channel, uint32_t column, uint32_t row, const BlockGrid& candidate, const BlockGrid& reference) {
        const size_t i = size_t{row} * reference.columns + column;
        const double mean = reference.blocks[i].mean;
        const double variance = cautious_variance(candidate, column, row) + cautious_variance(reference, column, row) * (1 + borrowed_);
        const double z = std::abs(z_value(beyond_tolerance(candidate.blocks[i].mean - mean, options_.relative_tolerance * std::abs(mean)),
                                          variance + rounding_variance(mean)));
        sum_z2_ += z * z;
        result_.blocks++;
        if (z <= result_.max_block_z) return;
        result_.max_block_z = z;
        result_.worst_x = column * options_.block_size;
        result_.worst_y = row * options_.block_size;
        result_.worst_channel = channel;
    }

    ComparisonOptions options_;
    double borrowed_, sum_z2_ = 0;
    StatisticalComparison result_;
};

StatisticalComparison compare(const Image& candidate, const Image& candidate2, double borrowed, const ImagePair& reference,
                              const ComparisonOptions& options) {
    RAYPAGER_CHECK(same_size(reference.first, reference.second) && same_size(reference.first, candidate) && same_size(candidate, candidate2));
    RAYPAGER_CHECK(options.block_size > 0 && !candidate.values.empty());
    Comparison comparison(options, borrowed);
    for (uint32_t channel = 0; channel < channels; channel++) {
        comparison.add_channel(channel, estimate_blocks(candidate, candidate2, channel, options.block_size),
                               estimate_blocks(reference.first, reference.second, channel, options.block_size));
    }
    return comparison.finish();
}

}  // namespace

StatisticalComparison compare_statistically(const ImagePair& candidate, const ImagePair& reference, const ComparisonOptions& options) {
    return compare(candidate.first, candidate.second, 0, reference, options);
}

StatisticalComparison compare_statistically(const Image& candidate, double variance_ratio, const ImagePair& reference,
                                            const ComparisonOptions& options) {
    return compare(candidate, candidate, variance_ratio, reference, options);
}

bool StatisticalComparison::agrees(double mean_limit, double block_limit, double rms_limit) const {
    return std::abs(mean_z) <= mean_limit && max_block_z <= block_limit && rms_block_z <= rms_limit;
}

std::string StatisticalComparison::describe() const {
    return fmt::format("mean {:+.3f} % ({:+.2f} sigma), {} blocks: rms {:.3f} sigma, worst {:.2f} sigma at pixel ({}, {}) channel {}",
                       100 * mean_relative_error, mean_z, blocks, rms_block_z, max_block_z, worst_x, worst_y, worst_channel);
}

}  // namespace raypager::reference
