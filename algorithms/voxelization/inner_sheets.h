// Parts of the mesh that do not bound the solid because the solid is on both of their sides: where parts of a
// model intersect, and walls of a cavity that was filled. Distances to them would be wrong, and voxels near
// them stray. (Aldén 2011, §5.4, deletes the voxels instead.)
#pragma once

#include <vector>

#include "algorithms/voxelization/band.h"
#include "algorithms/voxelization/regions.h"

namespace hermesh {

struct InnerSheets {
  /// Triangles that are inner, in part or altogether, ascending.
  std::vector<std::uint32_t> triangles;
  /// Of those that are inner in part, the outer pieces, and the triangle that each is of.
  PolygonMesh pieces;
  std::vector<std::uint32_t> parents;
  /// Blocks with a voxel that may be near one of them, by number, ascending.
  std::vector<std::uint32_t> blocks;
};

/// A piece of a triangle counts as inner only where that is certain: from just off either of its sides a
/// straight way leads to a voxel inside without meeting a triangle. Everything else stays. Triangles that are
/// inner in part are cut into pieces of at most a tenth of a voxel along the seam. `inside` are the voxels
/// inside each block, and `reach` is how far distances matter, in voxels. @throws Cancelled.
InnerSheets find_inner_sheets(const IndexSoup& soup, const TriangleBins& bins, const Band& band,
                              const std::vector<VoxelBits>& inside, double reach, double voxel_size,
                              RunContext& context);

}  // namespace hermesh
