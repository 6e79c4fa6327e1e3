// The voxel size for which hardly any visible wall or gap is too thin.
//
// **The rule.** A wall is thickened if it is thinner than 1.2 voxels (2 kShellRadius), and a gap is filled if
// it is thinner than a voxel. At each of 10,000 points, evenly distributed over the polygons' area, the wall
// behind the polygon and the gap in front of it are measured along its normal, as in thin_parts.h: up to the
// next polygon, if that is roughly parallel and its outside faces away from the point, or towards it. A point
// is visible if two of 16 rays from one of its sides leave the polygons; other points do not count. The voxel
// size is the largest for which at most the given share of the visible points is at a wall or gap that is too
// thin, within limits. Open surfaces have no thickness that smaller voxels could show.
#pragma once

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

struct AutoVoxelLimits {
  double share = 0.01;           ///< of the visible surface that may be thickened or filled
  double fewest_voxels = 200.0;  ///< along the longest side
  double most_voxels = 2000.0;   ///< along the longest side
  // Of the estimates below; these take precedence over the fewest voxels.
  double most_bytes = double(1 << 30), most_seconds = 10.0;
};

struct AutoVoxel {
  double voxel_size = 0.0;  ///< world units; 0 for polygons without extent
  double bytes = 0.0;       ///< estimated peak memory of remesh()
  double seconds = 0.0;     ///< estimated time of remesh(), summed over the cores
  /// Share of the visible surface at walls and gaps that are too thin for the voxels.
  double thin_share = 0.0;
  double wanted = 0.0;  ///< voxel size that the share requires, without the other limits; world units
};

/// Returns the voxel size of the rule above. The same for every number of threads. @throws Cancelled
AutoVoxel auto_voxel(const PolygonMesh& mesh, const AutoVoxelLimits& limits, RunContext& context);

}  // namespace hermesh
