// Voids of a solid that no flood from infinity reaches: shells that face inwards bound them.
#pragma once

#include <functional>

#include "algorithms/voxelization/distance/band.h"
#include "algorithms/voxelization/inside/oriented_winding.h"
#include "algorithms/voxelization/inside/regions.h"

namespace hermesh {

/// Joins cavities to the outside: their components get the number Regions::kOutside. A region is a cavity if
/// a closed shell of faces that agree and face inwards goes around it, its winding number is 0, and that of
/// every region next to it is 1, so that there is a wall with samples all around it. Other voids, which parts
/// of a model enclose between them, stay filled. A note names the first void within an inward shell that
/// stays filled.
/// @param bins, band of the soup; `regions` is find_regions() of their blocks, after open_pockets()
/// @param winding called only if there may be a cavity
/// @throws Cancelled
void open_cavities(const IndexSoup& soup, const TriangleBins& bins, const Band& band,
                   const std::function<const OrientedWinding&()>& winding, Regions& regions,
                   RunContext& context);

}  // namespace hermesh
