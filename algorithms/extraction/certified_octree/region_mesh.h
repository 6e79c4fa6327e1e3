// Fast adaptive contouring in which each merged cube of cells has one vertex (`certified-octree`).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_octree/cell_regions.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"
#include "algorithms/extraction/embedded_mesh/uniform_mesh.h"

namespace hermesh {

/// A merged mesh; index space relative to the placement's base, counter-clockwise seen from outside.
struct RegionMesh {
  std::vector<Eigen::Vector3d> points;  ///< FilePoints::rounded()
  std::vector<Triangle> triangles;
  LargeArray<Quad> quads;
  std::vector<std::uint8_t> of_cube;  ///< 1 for vertices that represent more than one cell
};

/// Merges cells into cubes. The mesh is closed, oriented, manifold and free of self-intersection if the
/// uniform mesh is, and its two-sided distance to that mesh is within the tolerance (region_proof.h). The
/// result is identical for any number of threads.
/// @param uniform the uniform mesh, whose vertices must not have been computed yet
/// @param in_hulls true if its vertices lie in the convex hulls of their cells' crossings, as means do
/// @param options tolerance and sizes of cubes
/// @param file rounds positions to the file's precision
/// @param context receives the progress, the statistics and the request to cancel
/// @throws Error for more vertices or polygons than 32 bits can number; Cancelled
RegionMesh merge_regions(UniformCells& uniform, bool in_hulls, const RegionOptions& options,
                         const FilePoints& file, RunContext& context);

}  // namespace hermesh
