// Triangulation of polygons of more than four corners.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// Returns true if the fan about the first corner covers the polygon, i.e. each of its triangles has positive
/// area and the polygon's orientation, seen along the mean normal (Newell's method, Tampieri 1992). This
/// holds for every strictly convex polygon.
bool is_fan(std::span<const Eigen::Vector3d> corners);

/// Triangulates a polygon by ear clipping (Meisters 1975). Returns n − 2 triangles of corner indices that
/// cover it once, seen along its mean normal. Collinear corners are allowed, and so is a boundary that
/// touches itself at points or passes twice along a bridge to a hole. Returns an empty vector if no ear is
/// found, e.g. because the boundary intersects itself, and if many corners repeat the same points, which would
/// take quadratic time. A polygon of a hundred thousand corners takes a few tenths of a second. @throws
/// Cancelled.
std::vector<Triangle> clip_ears(std::span<const Eigen::Vector3d> corners, const RunContext& context);

}  // namespace hermesh
