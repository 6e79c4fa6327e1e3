// How wide the wall or the gap is at a place of a surface.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "algorithms/search/triangle_tree.h"

namespace hermesh {

/// The width of the wall or of the gap that voxels have to show so that a mesh may come within an error of a
/// place of a surface: the largest of those about it that are nearly as near. What is thinner than that, as
/// the edge of a wedge is and a shallow fin, need not be shown. Infinity where something about the place is
/// thicker than four errors.
/// @param tree the surface's triangles; their units
/// @param triangle the one that the place is on
/// @param place in the tree's frame
/// @param error greater than 0
/// @param least widths below this are rounding, and not seen
double width_to_show(const TriangleTree& tree, std::uint32_t triangle, const Eigen::Vector3d& place,
                     double error, double least);

}  // namespace hermesh
