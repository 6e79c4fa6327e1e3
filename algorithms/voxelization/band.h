// Distances and crossed grid edges of every 8³ block of voxels near the triangles; signs come later.
#pragma once

#include <openvdb/openvdb.h>

#include <memory>
#include <vector>

#include "algorithms/voxelization/kernels/kernels.h"
#include "algorithms/voxelization/triangle_bins.h"

namespace hermesh {

using FloatLeaf = openvdb::FloatTree::LeafNodeType;

/// Number of the nearest triangle of each voxel of a leaf, in OpenVDB's order.
using LeafTriangles = std::array<std::int32_t, 512>;

/// Block i is number i of the bins' blocks().
struct Band {
  double voxel_size = 1.0;  ///< world units
  std::vector<BlockAt> blocks;
  /// Distance of each voxel in world units, at most the reach; the active voxels are those below it. Null
  /// where no voxel is.
  std::vector<std::unique_ptr<FloatLeaf>> leaves;
  std::vector<kernels::EdgeBits> crossed;               ///< grid edges that some triangle crosses
  std::vector<std::unique_ptr<LeafTriangles>> nearest;  ///< empty unless asked for
};

/// Exact to some 1e-6 voxel: every triangle that can be nearest to a voxel within `reach` (voxels, at least
/// 1) is looked at. @throws Cancelled.
Band compute_band(const IndexSoup& soup, const TriangleBins& bins, double reach, double voxel_size,
                  bool nearest, RunContext& context);

/// The leaves of some of the band's blocks once more, without some of the triangles (ascending numbers).
/// Leaves that have no voxel left are null; `nearest` is filled if it is not null.
std::vector<std::unique_ptr<FloatLeaf>> recompute_leaves(
    const IndexSoup& soup, const TriangleBins& bins, const Band& band,
    const std::vector<std::uint32_t>& blocks, const std::vector<std::uint32_t>& without, double reach,
    double voxel_size, std::vector<std::unique_ptr<LeafTriangles>>* nearest, RunContext& context);

}  // namespace hermesh
