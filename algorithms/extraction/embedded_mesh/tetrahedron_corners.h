// The corners of the tetrahedra that the uniform mesh is embedded in (uniform_mesh.h): lattice points, some
// of them moved a little.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "algorithms/extraction/embedded_mesh/cell_blocks.h"
#include "algorithms/extraction/embedded_mesh/point_target.h"

namespace hermesh {

/// Positions of the tetrahedra's corners; index space relative to the placement's base, in voxels.
///
/// A vertex that belongs on a face of its cell, as that of a polyhedron with faces in the planes of the
/// lattice, would make tetrahedra without volume. So the lattice points in the plane of that face move out of
/// the cell, by an eighth of CellBlocks::margin() along the face's axis. Nothing in the argument of
/// uniform_mesh.h requires that corners be lattice points: vertices at least 7/8 of the margin off the faces
/// of their cells make positively oriented tetrahedra with corners so near. Corners of cells that may have
/// explicit faces stay, because segments on these lie in the lattice's planes.
class TetrahedronCorners {
 public:
  /// All corners are lattice points. @param cells must outlive this
  explicit TetrahedronCorners(const CellBlocks& cells)
      : cells_(cells), near_face_(cells.size()), has_moved_(cells.size()) {}

  /// Moves the corners of cells whose vertices have a target near a face. `targets` are by block, ascending
  /// by cell, and must outlive this.
  void move(const std::vector<std::vector<PointTarget>>& targets);
  /// Returns false if all corners of cells and ends of edges of a block are lattice points.
  bool has_moved(std::int32_t block) const { return has_moved_[block] != 0; }
  /// Returns the corner at coordinates from 0 to 8 relative to the block's first sample.
  Eigen::Vector3d at(std::int32_t block, int x, int y, int z) const;
  struct Ends {
    Eigen::Vector3d start, along;  ///< along: from the first end to the second
  };
  /// Returns the corners that an edge connects.
  Ends ends(const CellBlocks::Edge& edge) const;

 private:
  const CellBlocks& cells_;
  const std::vector<std::vector<PointTarget>>* targets_ = nullptr;
  ByBlock<BlockMask> near_face_;         ///< samples at cells whose target is near a plane of the lattice
  std::vector<std::uint8_t> has_moved_;  ///< by block: 1 if it or a neighbour has such a cell
};

}  // namespace hermesh
