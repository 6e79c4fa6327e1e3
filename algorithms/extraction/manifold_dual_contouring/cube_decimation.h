// Decimation within one cube of a round (decimation.h).
#pragma once

#include <span>

#include "algorithms/extraction/manifold_dual_contouring/decimation.h"

namespace hermesh {

struct CubeNumbers;  // cube_mesh.h

struct DecimationCube {
  Eigen::Vector3d lower;
  double side;
  double longest_edge;  ///< that a collapse may make, so that cubes of a round coarsen alike
  bool merges_blocks;   ///< before edges are collapsed
  bool holds(const Eigen::Vector3d& p) const {
    return (p.array() >= lower.array()).all() && (p.array() < lower.array() + side).all();
  }
};

/// `triangles` are those whose boxes touch the cube, ascending. Changes the triangles with all corners in the cube, the
/// points in it and the samples attached to them, and reads no others that anybody changes meanwhile.
void decimate_cube(DecimatedMesh& mesh, const FilePoints& file, const DecimationCube& cube,
                   std::span<const std::uint32_t> triangles, CubeNumbers& numbers, const RunContext& context);

}  // namespace hermesh
