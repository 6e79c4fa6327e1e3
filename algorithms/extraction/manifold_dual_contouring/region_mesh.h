// The quick way to a coarser mesh: cubes of cells become one point each (`merging=regions`).
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/manifold_dual_contouring/edge_polygons.h"
#include "algorithms/extraction/manifold_dual_contouring/file_points.h"

namespace hermesh {

struct RegionMesh {
  std::vector<Eigen::Vector3d> points;  ///< as those of UniformMesh
  std::vector<Triangle> triangles;
  LargeArray<Quad> quads;
};

/// Closed, oriented, manifold and free of self-intersection if the uniform mesh is, and within the tolerance of
/// it both ways, but never farther than RegionShell::kFarthest (region_proof.h). The same bytes for every number
/// of threads.
/// @param points of the uniform mesh: those of cells lie within their cells, and those of fanned edges are
/// behind them
/// @param tolerance by point, those on fanned edges included; voxels
/// @throws Error for more points or polygons than 32 bits can number; Cancelled
RegionMesh merge_regions(const CellBlocks& cells, const EdgePolygons& polygons, const std::vector<Eigen::Vector3d>& points,
                         std::span<const float> tolerance, const FilePoints& file, RunContext& context);

}  // namespace hermesh
