// Distances without sign, and crossed grid edges, of every 8³ block of voxels near the triangles.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "algorithms/core/openvdb_leaf.h"
#include "algorithms/voxelization/distance/kernels/kernels.h"
#include "algorithms/voxelization/distance/triangle_bins.h"

namespace hermesh {

/// Number of the nearest triangle of each voxel of a leaf, in OpenVDB's order, x slowest; undefined for a
/// voxel out of reach.
using LeafTriangles = std::array<std::int32_t, 512>;

/// Distances around the triangles, without signs. Block i is number i of `TriangleBins::blocks()`.
struct Band {
  double voxel_size = 1.0;  ///< world units
  std::vector<BlockAt> blocks;
  /// Distance of each voxel in world units, at most the reach; the active voxels are those below it. Null
  /// where no voxel is.
  std::vector<std::unique_ptr<FloatLeaf>> leaves;
  std::vector<kernels::EdgeBits> crossed;  ///< edges between side_place()s that a triangle crosses
  std::vector<std::unique_ptr<LeafTriangles>> nearest;  ///< empty unless requested
};

/// The result for one block.
struct FoundLeaf {
  std::uint32_t block = 0;  ///< number of the block
  bool any = false;         ///< true if a voxel is within reach; if not, only `crossed` is valid
  /// World units, in OpenVDB's order, at most the reach.
  alignas(64) float values[512];
  /// Voxels below the reach, bit (y, z) of word x.
  std::uint64_t active[8];
  kernels::EdgeBits crossed;
  LeafTriangles nearest;  ///< only on request
};

/// Options of find_leaves().
struct BandWork {
  double reach = 3.0;  ///< voxels, at least 1
  double voxel_size = 1.0;
  bool nearest = false;                                 ///< finds the nearest triangles, too
  const std::vector<std::uint32_t>* blocks = nullptr;   ///< numbers of the blocks to compute; null for all
  const std::vector<std::uint32_t>* without = nullptr;  ///< triangles to leave out, ascending; may be null
};

/// Calls found(leaf) once for each block, in any order and from several threads at once; `leaf` does not
/// depend on either. Distances are exact to about 1e-6 voxel: every triangle that can be nearest to a voxel
/// within reach is tested. Afterwards the bins have no clusters, unless they have one slab.
/// @throws Cancelled.
void find_leaves(const IndexSoup& soup, TriangleBins& bins, const BandWork& work, RunContext& context,
                 const std::function<void(const FoundLeaf&)>& found);

/// Returns the distances of all blocks, as find_leaves() finds them.
/// @throws Cancelled.
Band compute_band(const IndexSoup& soup, TriangleBins& bins, const BandWork& work, RunContext& context);

}  // namespace hermesh
