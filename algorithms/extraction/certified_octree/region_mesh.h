// The quick way to a coarser mesh: cubes of cells become one point each (`certified-octree`).
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
  std::vector<std::uint8_t> of_cube;  ///< 1 for points that stand for more than one cell
};

/// Merges cells by cubes. The mesh is closed, oriented, manifold and free of self-intersection if the uniform
/// mesh is, and within the tolerance of it both ways (region_proof.h). The same bytes for every number of
/// threads.
/// @param uniform with no points made yet
/// @param in_hulls whether its points lie in the hull of their cells' crossings, as means do
/// @param options tolerance and sizes of cubes
/// @param file rounds places to the file's precision
/// @param context told of progress and figures, and asked whether to stop
/// @throws Error for more points or polygons than 32 bits can number; Cancelled
RegionMesh merge_regions(UniformCells& uniform, bool in_hulls, const RegionOptions& options,
                         const FilePoints& file, RunContext& context);

}  // namespace hermesh
