// Distances and crossed grid edges of every 8³ block of voxels near the triangles; signs come later.
#pragma once

#include <openvdb/openvdb.h>

#include <functional>
#include <memory>
#include <vector>

#include "algorithms/voxelization/distance/kernels/kernels.h"
#include "algorithms/voxelization/distance/triangle_bins.h"

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
  std::vector<kernels::EdgeBits> crossed;               ///< grid edges that some triangle crosses, as sample_side.h places their ends
  std::vector<std::unique_ptr<LeafTriangles>> nearest;  ///< empty unless asked for
};

/// One block's share.
struct FoundLeaf {
  std::uint32_t block = 0;  ///< number
  bool any = false;         ///< whether a voxel is within reach; without, nothing below but `crossed` counts
  alignas(64) float values[512];
  std::uint64_t active[8];
  kernels::EdgeBits crossed;
  LeafTriangles nearest;  ///< where asked for
};

struct BandWork {
  double reach = 3.0;  ///< voxels, at least 1
  double voxel_size = 1.0;
  bool nearest = false;                                 ///< the nearest triangles, too
  const std::vector<std::uint32_t>* blocks = nullptr;   ///< numbers of those to do; null for all
  const std::vector<std::uint32_t>* without = nullptr;  ///< triangles to leave out, ascending; may be null
};

/// Calls found(leaf) once for each block, in any order and from several threads at once. Distances are exact
/// to some 1e-6 voxel: every triangle that can be nearest to a voxel within reach is looked at.
/// @throws Cancelled.
void find_leaves(const IndexSoup& soup, TriangleBins& bins, const BandWork& work, RunContext& context,
                 const std::function<void(const FoundLeaf&)>& found);

/// All leaves. @throws Cancelled.
Band compute_band(const IndexSoup& soup, TriangleBins& bins, const BandWork& work, RunContext& context);

}  // namespace hermesh
