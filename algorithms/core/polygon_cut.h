// Polygons of more than four corners, cut into triangles.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// Whether the fan about the first corner covers the polygon: each of its triangles has an area and faces as
/// the polygon does, seen along its mean normal (Newell's: Tampieri 1992). The fan of every strictly convex
/// polygon does.
bool is_fan(std::span<const Eigen::Vector3d> corners);

/// Triangles, two fewer than corners and by their numbers among these, that cover a polygon once, seen along
/// its mean normal: an ear is cut off until three corners are left (Meisters 1975). Corners in a straight
/// line, and a border that touches itself at points or runs there and back as a bridge to a hole does, are
/// allowed. Empty if no ear is found, as where the border crosses itself. A polygon of a hundred thousand
/// corners takes some tenths of a second. @throws Cancelled.
std::vector<Triangle> clip_ears(std::span<const Eigen::Vector3d> corners, const RunContext& context);

}  // namespace hermesh
