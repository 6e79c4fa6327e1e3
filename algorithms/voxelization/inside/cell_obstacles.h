// Whether straight ways of some voxels are free of triangles.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "algorithms/voxelization/distance/segment.h"
#include "algorithms/voxelization/distance/triangle_bins.h"

namespace hermesh {

/// The triangles by the cell up from each voxel that they touch, block by block as they are asked for. Each
/// thread has an object of its own. All coordinates are voxels.
class CellObstacles {
 public:
  /// Coordinates of a voxel, and of the cell up from it.
  using Voxel = std::array<std::int32_t, 3>;

  /// Keeps references, and the cells of `kept` blocks, or of more where there are few triangles.
  CellObstacles(const IndexSoup& soup, const TriangleBins& bins, std::size_t kept);
  ~CellObstacles();
  CellObstacles(CellObstacles&&) noexcept;

  /// Whether no triangle that touches the cell is in the way, which is enough for ways that do not leave it.
  bool is_free_in(const Voxel& cell, const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  /// Whether no triangle is in the way. The search ends at the first that is.
  bool is_free(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  /// The part of the way, which may be some voxels long, that no triangle is in: 1 if none is.
  double free_part(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return first_met(from, to).part;
  }

  /// A triangle in a way.
  struct Met {
    double part = 1.0;        ///< of the way, up to the triangle
    bool faces_from = false;  ///< the triangle is wound counter-clockwise seen from where the way begins
    std::uint32_t triangle = 0;
  };
  /// The first triangle in the way; of several at one place the one with the least number.
  Met first_met(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

  /// Numbers of the triangles that may touch a cell, in an order that depends on earlier questions. Valid
  /// until the next question.
  const std::vector<std::uint32_t>& triangles_in(const Voxel& cell);

  /// Triangles that all questions so far have looked at, which is what they cost; it depends on their order.
  std::size_t work() const { return work_; }

 private:
  struct Block;
  Block& block_of(const Voxel& cell);
  void remember(const Obstacle& met);

  const IndexSoup& soup_;
  const TriangleBins& bins_;
  std::size_t kept_;
  std::map<BlockAt, std::unique_ptr<Block>> blocks_;
  std::size_t obstacles_ = 0;  ///< number of triangles in `blocks_`, each counted in every block that has it
  std::size_t work_ = 0;
  std::vector<std::uint32_t> found_;  ///< the answer of triangles_in()
  Block* last_ = nullptr;
  BlockAt last_at_{};
  /// Triangles that were in a way lately, which are often in the next way, too.
  std::vector<Obstacle> met_;
  std::size_t oldest_ = 0;
};

}  // namespace hermesh
