// Polygons of a mesh that nothing but a test keeps from meeting others.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

struct LoosePolygon {
  std::uint32_t number;
  bool is_quad;  ///< a number of the mesh's quads, else of its triangles
};

/// Which of them meet another polygon in more than the corners and the edge that they share, or may do so, or
/// themselves where they are quads; ascending.
/// @param quads each is cut from its first corner to its third
/// @throws Cancelled
std::vector<std::size_t> loose_polygons_that_meet(const std::vector<Eigen::Vector3d>& points,
                                                  const LargeArray<Quad>& quads,
                                                  const std::vector<Triangle>& triangles,
                                                  const std::vector<LoosePolygon>& loose,
                                                  RunContext& context);

}  // namespace hermesh
