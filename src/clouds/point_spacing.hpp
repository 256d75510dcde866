// How far the points of a cloud lie apart, from place to place: what their radii follow where none are given.
#pragma once

#include <span>
#include <vector>

#include "clouds/point_order.hpp"
#include "scene/point_distance.hpp"

namespace raypager {

// The spacing around each point, in the order of the points; more than 0. It is that of the smallest cell of the octree around the point
// that holds enough points to tell (24), and one figure a cell: the median distance of its points from their third nearest neighbour in the cell.
// On a surface sampled evenly that is the distance between neighbours. A point far from all others lies in a cell with few or none
// beside it, so it gets the spacing of the next larger cell, which those who lie close together decide: it does not become a balloon.
// As cells do not depend on the rest of the cloud, neither does the spacing in a cell that holds enough.
// Clouds of fewer points are told from as a whole. Where nothing tells (a single point, or all in one place): 1. By all threads.
std::vector<float> estimate_point_spacing(std::span<const CloudPoint> points, const PointOrder& order);

// The same where the cloud is too large to be looked at as a whole, but its cells are not.
// The points are those of one cell of this level. Returns its spacing, 0 if its points do not tell, and sets that of each point, in their order;
// of those of which nothing in the cell tells to 0: they get the spacing of the next larger cell that has one. spacing: one for each point.
float estimate_cell_spacing(std::span<const CloudPoint> points, const PointOrder& order, int level, std::span<float> spacing);
struct CellSpacing {
    float spacing;
    uint64_t points;
};
// Of a cell that is divided: the median over the points of those children that tell; 0 if none does.
// They are sorted on the way.
float divided_cell_spacing(std::span<CellSpacing> children);
// Of a cell of which no part tells, compared_spacing() of every n-th of its points, in order, such that there are at most so many.
inline constexpr size_t most_compared_points = 256;

}  // namespace raypager
