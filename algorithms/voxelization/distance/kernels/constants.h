// Tolerances that the kernels of all levels and their set-up share.
#pragma once

namespace hermesh::kernels {

/// A triangle whose height is below this, in voxels, is taken as its longest side: the distance errs by no
/// more, and its normal would be noise.
inline constexpr double kThin = 1e-6;

/// A grid line that passes a triangle's border this near, in voxels, is taken as crossing it. Far above the
/// rounding of double precision at any coordinate a grid can have, far below anything that a distance shows.
inline constexpr double kOn = 1e-9;

}  // namespace hermesh::kernels
