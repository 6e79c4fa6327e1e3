// The view of a camera as a mask (Aldén 2011, §9.2, tables 9.3 and 9.4).
#pragma once

#include <Eigen/Core>

#include "algorithms/core/level_set.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// The part of space that a camera sees, a truncated pyramid; lengths in world units, angles in degrees.
struct Frustum {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d look_at = -Eigen::Vector3d::UnitZ();
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  double field_of_view = 45.0;  ///< vertical, from the lower to the upper plane
  double aspect = 1.0;          ///< width over height
  double near = 0.1, far = 100.0;
};

/// Returns the exact signed distance of a position to the frustum's surface, negative inside.
/// @throws Error for a frustum without volume: a number that is not finite, look-at at the position, up along
/// the view, an angle not between 0 and 180, an aspect not above 0, or planes that are not 0 < near < far.
double signed_distance(const Frustum& frustum, const Eigen::Vector3d& point);

/// Returns the level set of the frustum with a band of three voxels, `resolution` voxels (8 to 4096) along
/// the longest side of its box. Adds a note if the near end is so narrow that the samples may miss it.
/// @throws Error as signed_distance() does, or if the voxels would be smaller than OpenVDB takes; Cancelled.
LevelSet frustum_mask(const Frustum& frustum, int resolution, RunContext& context);

}  // namespace hermesh
