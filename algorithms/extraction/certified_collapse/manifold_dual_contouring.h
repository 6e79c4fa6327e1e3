// Adaptive contouring with guarantees: closed, oriented, manifold, free of self-intersection, and within a
// stated distance of the uniform mesh, whatever the input. Of the two ways to it this is the one with the
// fewest polygons: any points of the uniform mesh may be merged.
#pragma once

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/variant.h"
#include "algorithms/extraction/certified_collapse/certified_decimation.h"
#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/hermite/hermite_view.h"

namespace hermesh {

struct ManifoldDualContouringOptions {
  /// Bound of the two-sided distance between the mesh and the uniform one, in voxels: larger gives fewer
  /// polygons. 0 gives the uniform mesh itself.
  double tolerance = 0.1;
  /// What is done for the root mean square distance (certified_decimation.h).
  Nearness nearness = {};
  DualContouringOptions uniform;  ///< placement of the uniform mesh's points
};

/// Uniform mesh (uniform_mesh.h), then merges of its points, of which those stay that are proved to keep the
/// topology, the freedom from self-intersection and the bound (certified_decimation.h). The same bytes for
/// every number of threads.
/// `field` scales the tolerance by the place of the uniform mesh's points, and may be null. Where it asks
/// for no mesh outside of its mask, triangles whose middle lies outside are left out, and the mesh is open
/// there, but for those that stand for points within; points outside are not merged.
PolygonMesh manifold_dual_contouring(const HermiteView& grid, const ManifoldDualContouringOptions& options,
                                     const AdaptivityField* field, RunContext& context);

/// The table's entry.
PolygonMesh manifold_dual_contouring(const ExtractionInput& input);
std::vector<OptionSpec> manifold_dual_contouring_options();

}  // namespace hermesh
