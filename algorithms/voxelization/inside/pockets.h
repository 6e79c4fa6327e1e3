// Voxels outside that no way along grid edges leads to, at the bottom of a crevice narrower than a voxel.
#pragma once

#include "algorithms/voxelization/inside/regions.h"
#include "algorithms/voxelization/distance/triangle_bins.h"

namespace hermesh {

/// Joins regions of few voxels to the outside: where a straight way leads from one of their voxels to a voxel
/// outside, at most six voxels off on each axis, without meeting a triangle, or to another such region that is
/// joined; and, unless there are very many, where one along the crevice's walls does, from triangle to triangle. The
/// latter only if the triangles around the region face it, for the inside of thin walls is many small regions, too.
/// Large regions are left as they are: a hole narrower than a voxel must not empty a solid. The regions get other
/// numbers only by becoming Regions::kOutside.
/// @throws Cancelled.
void open_pockets(const IndexSoup& soup, const TriangleBins& bins, const std::vector<BlockAt>& blocks,
                  Regions& regions, const RunContext& context);

}  // namespace hermesh
