// The uniform mesh of a lattice of labels: vertices stay near the boundary between voxels.
#pragma once

#include <array>

#include "algorithms/extraction/embedded_mesh/uniform_mesh.h"

namespace hermesh {

/// Where vertices have to stay.
struct NearVoxels {
  double distance;  ///< largest distance from the boundary between voxels, in voxels
  /// Crossed edges, by block and axis, at which no such boundary passes: their samples were given another
  /// side. Null if there are none.
  const ByBlock<std::array<BlockMask, 3>>* not_on_boundary = nullptr;
};

/// Returns uniform_mesh() with every vertex in its cell and at most `near.distance` from the boundary between
/// the voxels, i.e. the unit cubes around the samples, of different sides. A vertex that would be farther
/// moves towards the middle of its cell, as in constrained surface nets (Gibson, *Constrained Elastic Surface
/// Nets*, 1998). Not bounded by the distance are the vertex of one of several sheets of a cell, which is the
/// mean of its crossings, the vertex of a fanned edge, which is near its crossing, and vertices of cells
/// without a boundary between voxels.
/// @throws as uniform_mesh()
UniformMesh uniform_mesh_near_voxels(const CellGrid& grid, DualContouringOptions options,
                                     const NearVoxels& near, const FilePoints& file, RunContext& context,
                                     PolygonEdges* edges = nullptr);

}  // namespace hermesh
