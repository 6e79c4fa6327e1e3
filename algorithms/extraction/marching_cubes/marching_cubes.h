// Marching cubes (Lorensen & Cline 1987), with face ambiguities resolved identically from both sides.
#pragma once

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/variant.h"
#include "algorithms/hermite/sparse_hermite.h"

namespace hermesh {

/// Crossings are at least this far from the ends of their grid edge, in voxels. Two vertices of the mesh on
/// adjacent edges are thus at least this far apart, which single precision resolves up to 8,192 voxels from
/// the mesh's origin, and no polygon degenerates however close a sample is to the isovalue.
inline constexpr double kCrossingMargin = 1.0 / 1024.0;

/// Computes triangles with one vertex on each crossed edge. The mesh is closed, manifold and oriented for
/// every finite volume; adjacent surface sheets within one cell may touch. No triangle degenerates: three
/// points inside three edges of a cell lie on a line only if one edge contains two of them.
///
/// Vertices interpolate the samples along their edges, or, if there are `crossings`, which must be those of
/// the same level set and isovalue, use their offsets (directed distances, Aldén 2011, §2.7).
PolygonMesh marching_cubes(const LevelSet& level_set, double isovalue, const FloatHermite* crossings,
                           RunContext& context);

/// Runs marching cubes with the options of marching_cubes_options(), as the table of variants calls it.
/// @throws Error for exact crossings if there are no polygons at the isovalue; Cancelled.
PolygonMesh marching_cubes(const ExtractionInput& input);
std::vector<OptionSpec> marching_cubes_options();

}  // namespace hermesh
