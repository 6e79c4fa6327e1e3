// Adaptive contouring with guarantees: closed, oriented, manifold, free of self-intersection, and within a
// stated distance of the uniform mesh, for every input. Of the two certified extractors this one makes the
// fewest polygons, because any vertices of the uniform mesh may be merged.
#pragma once

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/variant.h"
#include "algorithms/extraction/certified_collapse/certified_decimation.h"
#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/hermite/hermite_view.h"
#include "algorithms/lattice/part_placement.h"

namespace hermesh {

struct ManifoldDualContouringOptions {
  /// Bound of the two-sided distance between the mesh and the uniform one, in voxels: larger gives fewer
  /// polygons, 0 the uniform mesh itself.
  double tolerance = 0.1;
  Nearness nearness = {};
  int tile = 0;          ///< side in cells of the tiles that are decimated one by one (tile_mesh.h); 0: none
  SampleBox whole = {};  ///< with tiles: UniformTiling::whole
  DualContouringOptions uniform;  ///< placement of the uniform mesh's vertices
};

/// Returns the uniform mesh (uniform_mesh.h), decimated as far as that is certified (certified_decimation.h).
/// The same bytes for any number of threads. `field`, which may be null, scales the tolerance by the
/// positions of the uniform mesh's vertices. If it excludes the outside of its mask, vertices outside are not
/// merged, and triangles whose middle lies outside are omitted, unless they represent vertices inside; the
/// mesh is open there.
/// @throws Error for tiles with a field, or if join_tiles() does; as uniform_mesh() and FineMesh; Cancelled
PolygonMesh manifold_dual_contouring(const HermiteView& grid, const ManifoldDualContouringOptions& options,
                                     const AdaptivityField* field, RunContext& context);

/// Implements the table's entry.
PolygonMesh manifold_dual_contouring(const ExtractionInput& input);
std::vector<OptionSpec> manifold_dual_contouring_options();

/// Returns the options given for the entry, with the tolerance in voxels of a lattice. @throws Error for an
/// invalid side of tiles
ManifoldDualContouringOptions read_manifold_dual_contouring_options(const ExtractionInput& input,
                                                                    const IndexToWorld& placement);

}  // namespace hermesh
