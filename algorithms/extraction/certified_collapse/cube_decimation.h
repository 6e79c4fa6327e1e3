// Collapses within one cube of a round (decimation.h).
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "algorithms/extraction/certified_collapse/decimation.h"

namespace hermesh {

struct CubeNumbers;  // cube_mesh.h

/// A cube of a round; lengths in voxels, index space.
struct DecimationCube {
  /// Place of a cube in the round's lattice: its corner of least coordinates is at start + index * side. The
  /// same rounding says which cube a place is in and which ones a triangle touches, so no place is in two.
  using Index = std::array<std::uint64_t, 3>;
  static Index index_of(const Eigen::Vector3d& p, const Eigen::Vector3d& start, double side) {
    Index index;
    for (int a = 0; a < 3; ++a)
      index[a] = static_cast<std::uint64_t>(std::max(0.0, (p[a] - start[a]) / side));
    return index;
  }

  Eigen::Vector3d start;
  double side;
  Index index;
  double longest_edge;  ///< longest that a collapse may make, so that cubes of a round coarsen alike
  bool holds(const Eigen::Vector3d& p) const { return index_of(p, start, side) == index; }
};

/// What a collapse does to the forest, see MergeForest::join().
struct Join {
  std::uint32_t going;
  MergeForest::Node node;
};

/// Collapses edges in a cube, and returns the joins in order. `triangles` are those whose boxes touch the
/// cube, ascending. The function changes the triangles with all corners in the cube, the points in it and the
/// samples attached to them, and reads of others only what tells it so; different threads may do different
/// cubes of a round at once, each with `numbers` of its own. @throws Cancelled
std::vector<Join> decimate_cube(DecimatedMesh& mesh, Collapses kind, const FilePoints& file,
                                const DecimationCube& cube, std::span<const std::uint32_t> triangles,
                                CubeNumbers& numbers, const RunContext& context);

}  // namespace hermesh
