// Adaptive contouring with guarantees: closed, oriented, manifold, free of self-intersection, and within a stated distance
// of the uniform mesh, whatever the input.
#pragma once

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/variant.h"
#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/hermite/hermite_view.h"

namespace hermesh {

struct ManifoldDualContouringOptions {
  /// Bound of the two-sided distance between the mesh and the uniform one, in voxels: larger gives fewer polygons.
  /// 0 gives the uniform mesh itself.
  double tolerance = 0.1;
  DualContouringOptions uniform;  ///< placement of the uniform mesh's points
};

/// Uniform mesh (uniform_mesh.h), then collapses of edges, each tested before it is done (decimation.h), then the bound
/// proved for every triangle (distance_certificate.h). The same bytes for every number of threads.
PolygonMesh manifold_dual_contouring(const HermiteView& grid, const ManifoldDualContouringOptions& options,
                                     RunContext& context);

/// The table's entry.
PolygonMesh manifold_dual_contouring(const ExtractionInput& input);
std::vector<OptionSpec> manifold_dual_contouring_options();

}  // namespace hermesh
