// The voxel size of the next attempt of a bounded remeshing, from the positions that the last one left too
// far apart. World units throughout.
#pragma once

#include <span>
#include <vector>

#include "algorithms/remesh/two_sided_proof.h"
#include "algorithms/search/surface_distance.h"

namespace hermesh {

struct NextVoxel {
  double size;
  bool is_smaller;                 ///< false: no smaller voxels are allowed, or none allowed would help
  double thickness = 0.0;          ///< of the part that is too thin if not; 0: unknown
  std::vector<Far> too_thin = {};  ///< positions of that part
};

/// Returns the next voxel size: about the width of the walls and gaps that voxels have to show so that `far`
/// becomes near; `factor` of `size` if there are none.
/// @param smallest voxel size that is allowed
/// @param surface triangles that the positions `far` on the surface belong to
/// @param far positions too far apart, in the frame of `surface`
/// @param least widths below this are rounding, and ignored
NextVoxel next_voxel(double size, double smallest, double factor, const SurfaceDistance& surface,
                     std::span<const Far> far, double error, double least);

}  // namespace hermesh
