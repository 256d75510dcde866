// What a camera sees of a cloud: culling to its field of view, and filtering to the resolution of its picture.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "clouds/point_order.hpp"
#include "raypager/scene.hpp"

namespace raypager {

class PointView {
public:
    // margin: how far beyond the picture's border points still count, as a share of half the picture's width and height.
    PointView(const Camera& camera, uint32_t width, uint32_t height, double margin);
    // Whether the point lies in front of the camera and within the picture and its margin.
    bool sees(const Float3& position) const;
    // Width of a pixel's footprint at this distance from the eye: the smaller of its sides.
    double footprint(double distance) const { return projection_ == Projection::orthographic ? pixel_ : pixel_ * distance; }
    // Of a cube from the eye.
    double distance(const Float3& lower, double size) const;
    // Whether the cube is no larger than a pixel's footprint at its distance.
    bool is_in_pixel(const Float3& lower, double size) const { return size <= footprint(distance(lower, size)); }

private:
    double eye_[3];
    double across_[3][3];  // position relative to the eye -> (right, up, forward) in units of the camera's axes
    double reach_, pixel_;
    Projection projection_;
    double lens_[2] = {0, 0}, focal_distance_ = 1;  // in units of the camera's axes
};

// The point that stands for all those of a cell: the one nearest to their middle. It gets their mean colour, and a radius that covers what they
// covered: their largest one times the square root of their number, yet no more than reaches across the cell.
// Points come twice, in the same order: first all of them through add(), then all through compare().
class PixelMerge {
public:
    PixelMerge(uint64_t count, double cell_size);
    void add(const CloudPoint& point);
    void compare(const CloudPoint& point, uint32_t number);
    uint32_t number() const { return number_; }  // that it came with
    CloudPoint point() const;

private:
    const double count_, across_;
    std::array<double, 3> middle_ = {0, 0, 0};
    std::array<double, 3> color_ = {0, 0, 0};  // mean of squares: near enough to a mean of light
    float largest_ = 0;
    double least_ = std::numeric_limits<double>::infinity();
    CloudPoint nearest_;
    uint32_t number_ = 0;
};

// Merges the points of each cell of the octree that is no larger than a pixel's footprint at its distance and holds several.
// Returns which points are left, by index. Radii must be set.
// level: of the cell that the points are those of.
std::vector<bool> filter_to_pixels(std::span<CloudPoint> points, const PointOrder& order, const PointView& view, int level = point_grid_levels);

}  // namespace raypager
