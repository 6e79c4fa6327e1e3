// What is on either side of a place of the surface, as far as straight ways that meet no triangle tell.
#pragma once

#include <vector>

#include "algorithms/voxelization/inside/cell_obstacles.h"
#include "algorithms/voxelization/inside/regions.h"

namespace hermesh {

/// What is certain about a place of the surface, or just off it: the outside is next to it, only the inside
/// is, or neither can be told, as in a crevice too narrow to lead to a voxel.
enum class Side { outer, inner, unknown };

/// Looks around among the triangles; each thread has its own, since it keeps what it looked up.
class SurfaceProbe {
 public:
  /// Keeps references. `inside` has the voxels inside each block of the bins, by number.
  SurfaceProbe(const IndexSoup& soup, const TriangleBins& bins, const std::vector<BlockMask>& inside);

  /// What is around a place off the surface, in voxels, by straight ways to the corners of the cell that it
  /// is in.
  Side seen_from(const Eigen::Vector3d& p);
  /// What is around a place next to a sheet with this unit normal from which nothing is seen: follows the
  /// narrow space to where it is wider, as long as it widens.
  Side followed_from(Eigen::Vector3d p, const Eigen::Vector3d& normal);

 private:
  using Voxel = CellObstacles::Voxel;

  int inside_at(const Voxel& voxel);
  void enter(const Voxel& cell);
  double centre(Eigen::Vector3d& p, const Eigen::Vector3d& normal);

  const std::vector<BlockMask>& inside_;
  BlockFinder finder_;
  CellObstacles obstacles_;
  /// The cell that was looked into last.
  Voxel cell_{};
  bool has_cell_ = false;
  unsigned inside_corners_ = 0, outside_corners_ = 0;  ///< a bit each; neither where there is no block
};

}  // namespace hermesh
