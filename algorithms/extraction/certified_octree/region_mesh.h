// The quick way to a coarser mesh: cubes of cells become one point each (`certified-octree`).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"
#include "algorithms/extraction/certified_octree/cell_regions.h"
#include "algorithms/extraction/embedded_mesh/uniform_mesh.h"

namespace hermesh {

struct RegionMesh {
  std::vector<Eigen::Vector3d> points;  ///< as those of UniformMesh
  std::vector<Triangle> triangles;
  LargeArray<Quad> quads;
  std::vector<std::uint8_t> of_cube;  ///< by point: whether it stands for more than one cell
};

/// Closed, oriented, manifold and free of self-intersection if the uniform mesh is, and within the tolerance
/// of it both ways (region_proof.h). The same bytes for every number of threads.
/// @param uniform with no points made yet
/// @param in_hulls whether its points lie in the hull of their cells' crossings, as means do
/// @throws Error for more points or polygons than 32 bits can number; Cancelled
RegionMesh merge_regions(UniformCells& uniform, bool in_hulls, const RegionOptions& options,
                         const FilePoints& file, RunContext& context);

}  // namespace hermesh
