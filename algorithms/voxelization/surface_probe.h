// What is on either side of a place of the surface, as far as straight ways that meet no triangle tell.
#pragma once

#include <vector>

#include "algorithms/voxelization/cell_obstacles.h"
#include "algorithms/voxelization/regions.h"
#include "algorithms/voxelization/winding_number.h"

namespace hermesh {

/// What is certain about a place of the surface, or just off it: the outside is next to it, only the inside
/// is, or neither can be told, as in a crevice too narrow to lead to a voxel.
enum class Side { outer, inner, unknown };

/// Looks around among the triangles; each thread has its own, since it keeps what it looked up.
class SurfaceProbe {
 public:
  /// Keeps references. `inside`: the voxels inside each block of the bins. A thorough probe follows narrow
  /// spaces to where they are wider, and asks `winding`, unless that is null, about those that do not widen.
  SurfaceProbe(const IndexSoup& soup, const TriangleBins& bins, const std::vector<VoxelBits>& inside,
               bool thorough, const WindingNumber* winding);

  /// Whether the solid is on both sides of the surface at q with this unit normal.
  Side side(const Eigen::Vector3d& q, const Eigen::Vector3d& normal);

 private:
  using Voxel = CellObstacles::Voxel;

  int inside_at(const Voxel& voxel);
  void enter(const Voxel& cell);
  Side seen_from(const Eigen::Vector3d& p);
  double centre(Eigen::Vector3d& p, const Eigen::Vector3d& normal);
  Side follow(Eigen::Vector3d p, const Eigen::Vector3d& normal);
  bool is_wound_about(const Eigen::Vector3d& p) const;

  const std::vector<VoxelBits>& inside_;
  bool thorough_;
  const WindingNumber* winding_;
  BlockFinder finder_;
  CellObstacles obstacles_;
  /// The cell that was looked into last.
  Voxel cell_{};
  bool has_cell_ = false;
  unsigned inside_corners_ = 0, outside_corners_ = 0;  ///< a bit each; neither where there is no block
};

}  // namespace hermesh
