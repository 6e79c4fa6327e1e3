// Triangulation of polygons of more than four corners.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// Returns true if the fan about the first corner covers the polygon: each of its triangles has an area and
/// faces as the polygon does, seen along its mean normal (Newell's: Tampieri 1992), as in every strictly
/// convex polygon.
bool is_fan(std::span<const Eigen::Vector3d> corners);

/// Triangulates a polygon by ear clipping (Meisters 1975): n − 2 triangles, by the indices of their corners,
/// cover it once, seen along its mean normal. Corners in a straight line, and a border that touches itself at
/// points or runs there and back as a bridge to a hole, are allowed. Empty if no ear is found, e.g. where the
/// border crosses itself. A polygon of a hundred thousand corners takes some tenths of a second. @throws
/// Cancelled.
std::vector<Triangle> clip_ears(std::span<const Eigen::Vector3d> corners, const RunContext& context);

}  // namespace hermesh
