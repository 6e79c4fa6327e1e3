// Voxels at the bottom of a crevice narrower than a voxel: they are outside, but no way along grid edges
// leads there.
#pragma once

#include "algorithms/voxelization/distance/triangle_bins.h"
#include "algorithms/voxelization/inside/regions.h"

namespace hermesh {

/// Joins regions of at most 64 voxels to the outside. First come straight ways that meet no triangle, from
/// one of a region's voxels to a voxel at most six off on each axis, which is outside or in a region already
/// joined. Then come ways along the crevice's walls, from triangle to triangle, for one region after another
/// until a fixed number of triangles has been looked at; regions after that stay closed. Walls are followed
/// only if of the triangles next to the region's first voxel no more turn away than face it, for the inside
/// of thin walls is many small regions, too. Large regions are left as they are, and so is a region whose
/// walls lead to a large enclosed one first: a hole narrower than a voxel must not empty a solid. The
/// components of a joined region get the number Regions::kOutside; all other numbers, and `regions.count`,
/// stay.
/// @param blocks those of `bins.blocks()`, by number
/// @param regions find_regions() of the same blocks
/// @throws Cancelled.
void open_pockets(const IndexSoup& soup, const TriangleBins& bins, const std::vector<BlockAt>& blocks,
                  Regions& regions, const RunContext& context);

}  // namespace hermesh
