// How far the points of a cloud lie apart, from place to place: what their radii follow where none are given.
#pragma once

#include <span>
#include <vector>

#include "blocks/point_order.hpp"

namespace raypager {

// The spacing around each point, in the order of the points; more than 0. It is that of the smallest cell of the octree around the point
// that holds enough points to tell (24), and one figure a cell: the median distance of its points from their third nearest neighbour in the cell.
// On a surface sampled evenly that is the distance between neighbours. A point far from all others lies in a cell with few or none
// beside it, so it gets the spacing of the next larger cell, which those who lie close together decide: it does not become a balloon.
// As cells do not depend on the rest of the cloud, neither does the spacing in a cell that holds enough.
// Where nothing tells (a single point, or all in one place): 1.
std::vector<float> estimate_point_spacing(std::span<const CloudPoint> points, const PointOrder& order);

// Of a sphere around each point, so that a surface of such points looks closed: a multiple of the spacing. An even grid needs 0.71; points
// strewn at random leave exp(-pi (0.94 * 0.9)^2) of their surface open with 0.9, a tenth. Real scans lie in between.
inline constexpr float point_radius_of_spacing = 0.9f;

}  // namespace raypager
