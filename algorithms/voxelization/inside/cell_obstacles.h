// Triangles that intersect segments a few voxels long.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <memory>
#include <vector>

#include "algorithms/voxelization/distance/triangle_bins.h"
#include "algorithms/voxelization/inside/regions.h"

namespace hermesh {

/// Returns the cell that contains a point, in voxels.
Voxel cell_of(const Eigen::Vector3d& point);

/// The triangles by the cells that they touch, filed block by block on demand. Each thread has an
/// object of its own. All coordinates are voxels.
class CellObstacles {
 public:
  /// Keeps references.
  CellObstacles(const IndexSoup& soup, const TriangleBins& bins);
  ~CellObstacles();
  CellObstacles(CellObstacles&&) noexcept;

  /// Returns true if no triangle that touches the cell intersects the segment, which lies in the cell.
  bool is_free_in(const Voxel& cell, const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  /// Returns true if no triangle intersects the segment.
  bool is_free(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

  /// A triangle that a segment intersects.
  struct Met {
    double part = 1.0;        ///< of the segment, up to the triangle; 1 if none is met
    bool faces_from = false;  ///< the triangle is wound counter-clockwise seen from the segment's start
    std::uint32_t triangle = 0;
  };
  /// Returns the first triangle that the segment intersects; of several at one point the one with the least
  /// number.
  Met first_met(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

  /// Returns the numbers of the triangles that may touch a cell. Their order depends on earlier queries.
  std::vector<std::uint32_t> triangles_in(const Voxel& cell);

  /// Returns the number of triangles that all queries so far have tested. It depends on their order.
  std::size_t work() const { return work_; }

 private:
  struct Block;
  Block& block_of(const Voxel& cell);

  const IndexSoup& soup_;
  const TriangleBins& bins_;
  std::map<BlockAt, std::unique_ptr<Block>> blocks_;
  Block* last_ = nullptr;  ///< the block of the last query
  BlockAt last_at_{};
  Facet last_met_{TriangleCorners{}};  ///< the last one found, which the next segment often intersects, too
  std::size_t obstacles_ = 0;          ///< number of triangles in `blocks_`, each counted once per block
  std::size_t work_ = 0;
};

}  // namespace hermesh
