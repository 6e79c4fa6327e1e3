// On which side of the surface each voxel is: by flooding, or by winding numbers.
#pragma once

#include <map>
#include <vector>

#include "algorithms/voxelization/distance/band.h"
#include "algorithms/voxelization/inside/regions.h"
#include "algorithms/voxelization/sign_rule.h"

namespace hermesh {

/// The sides of all voxels near the surface. A block is one of the bins' blocks().
struct Signs {
  /// Voxels inside, by number of the block.
  std::vector<BlockMask> inside;
  /// False where no rule can tell; `inside` is empty then.
  bool usable = true;
  /// What closes the holes, if the signs are those of winding numbers: the surface on which the number is ½
  /// without a triangle there, as triangles in voxels relative to the mesh's origin. Empty for a closed mesh.
  std::vector<TriangleCorners> caps;
  /// Voxels inside for the blocks near the caps that the table does not have.
  std::map<BlockAt, BlockMask> beyond;
};

/// Finds the side of every voxel of the band, which reaches `reach` voxels. A note says when `rule` is
/// automatic and the flood leaked in, and when the polygons give no inside at all.
/// @throws Cancelled.
Signs find_signs(const IndexSoup& soup, SignRule rule, const TriangleBins& bins, const Band& band,
                 double reach, RunContext& context);

}  // namespace hermesh
