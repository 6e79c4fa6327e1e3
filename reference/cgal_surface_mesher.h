// Delaunay refinement of an isosurface: CGAL's 3D surface mesher (Boissonnat & Oudot, "Provably good sampling
// and meshing of surfaces", Graphical Models 67, 2005).
#pragma once

#include "algorithms/core/variant.h"

namespace hermesh {

/// Meshes the isosurface of the trilinear interpolation of the samples. Options: `angle_bound` (degrees,
/// smallest angle of a facet), `facet_size` and `facet_distance` (voxels: largest radius of a facet's surface
/// Delaunay ball, and its largest distance to the facet's circumcentre), `seed_spacing` (voxels between the
/// points that the refinement starts from, on every component of the isosurface), `max_points`.
///
/// The facets separate the inner from the outer cells of a Delaunay triangulation whose vertices are the
/// output's own single-precision points. So whenever the refinement ends, the mesh is closed, manifold
/// (refinement goes on until it is), oriented and free of intersections. The refinement need not end on a
/// surface that is not smooth; an Error is thrown then. A component that no seed catches is missed: so it is
/// with this method.
/// @throws Cancelled; Error when the refinement does not end within max_points or CGAL gives up
PolygonMesh cgal_surface_mesher(const ExtractionInput& input);

}  // namespace hermesh
