// Regions outside the solid that the flood from infinity does not reach: bottoms of narrow crevices, and
// cavities.
#pragma once

#include <functional>

#include "algorithms/voxelization/distance/band.h"
#include "algorithms/voxelization/inside/regions.h"
#include "algorithms/voxelization/inside/winding_number.h"

namespace hermesh {

/// Joins pockets to the outside: regions of at most 64 voxels in a crevice narrower than a voxel, to which no
/// path along grid edges leads. They are
/// - those with a voxel from which a segment of at most six voxels along each axis leads to the outside, or
///   to a region joined before, without intersecting a triangle;
/// - those from which a path along the walls of the crevice, from triangle to triangle, leads there. These
/// are
///   searched one region after another until a fixed number of triangles has been tested; later regions stay
///   enclosed. Walls are followed only if, of the triangles next to the region's first voxel, no more face
///   away than face it, for the inside of thin walls consists of many small regions, too.
/// Larger regions stay enclosed, and so does a region whose walls lead to a large enclosed one first: a hole
/// narrower than a voxel must not empty a solid. The components of a joined region get the number
/// Regions::kOutside; all other numbers, and `regions.count`, stay.
/// @param blocks those of `bins.blocks()`, by number
/// @param regions find_regions() of the same blocks
/// @throws Cancelled.
void open_pockets(const IndexSoup& soup, const TriangleBins& bins, const std::vector<BlockAt>& blocks,
                  Regions& regions, const RunContext& context);

/// Joins cavities to the outside, as open_pockets() does. A region is a cavity if a closed shell of faces
/// that agree and face inwards goes around it, its winding number is 0, and that of every region next to it
/// is 1, so there is a wall with samples all around it. Other voids, which parts of a model enclose between
/// them, stay filled. A note names the first void within an inward shell that stays filled.
/// @param winding called only if there may be a cavity
/// @throws Cancelled
void open_cavities(const IndexSoup& soup, const TriangleBins& bins, const Band& band,
                   const std::function<const OrientedWinding&()>& winding, Regions& regions,
                   RunContext& context);

}  // namespace hermesh
