// Adaptive contouring with the guarantees of `manifold-dual-contouring`, many times faster but with more
// polygons: cubes of 2³, 4³ and 8³ cells become one vertex each, as in an octree, and vertices stay within
// their cells.
#pragma once

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/variant.h"
#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/hermite/hermite_view.h"

namespace hermesh {

struct CertifiedOctreeOptions {
  /// Bound of the two-sided distance between the mesh and the uniform one, in voxels: larger gives fewer
  /// polygons. 0 gives the uniform mesh itself.
  double tolerance = 0.1;
  double flatness = 0;   ///< largest distance of a cube's vertex from its planes (RegionOptions), in voxels
  int largest_cube = 8;  ///< cells per side: 2, 4 or 8
  DualContouringOptions
      uniform;  ///< placement of the uniform mesh's vertices, whose `reach` is always treated as 0
};

/// Computes the uniform mesh within its cells (uniform_mesh.h), then merges cubes of cells where the result
/// is proved to preserve the topology, to be free of self-intersection and to satisfy the bound
/// (region_mesh.h). The result is identical for any number of threads. The field has the same meaning as for
/// manifold_dual_contouring().
PolygonMesh certified_octree(const HermiteView& grid, const CertifiedOctreeOptions& options,
                             const AdaptivityField* field, RunContext& context);

/// Implements the table's entry.
PolygonMesh certified_octree(const ExtractionInput& input);
std::vector<OptionSpec> certified_octree_options();

}  // namespace hermesh
