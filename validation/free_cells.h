// The part of space that certainly hangs together with infinity.
#pragma once

#include <cstdint>
#include <vector>

#include "validation/geometry/triangle_tree.h"

namespace hermesh::validation {

/// A coarse grid of the space about a mesh: cubes of 1/128 of the longest side of the mesh's box, flooded
/// from outside through those cubes that no triangle meets (tested by the boxes of the triangle's parts).
class FreeCells {
 public:
  /// A grid without cells, for which every point is neither free nor enclosed.
  FreeCells() = default;
  explicit FreeCells(const TriangleTree& tree);

  /// Side of a cube, world units.
  double cell() const { return cell_; }
  /// Whether the flood came to the point's cube. Points beyond the box are free.
  bool free(const Eigen::Vector3d& point) const { return state_at(point) == kFree; }
  /// Whether neither the flood came to the point's cube nor a triangle meets it, so that triangles part the
  /// point from infinity but for gaps that are narrower than a cube or two.
  bool enclosed(const Eigen::Vector3d& point) const { return state_at(point) == kUnseen; }

 private:
  void block(const Corners& triangle);
  void flood();
  std::size_t index(const Eigen::Vector3i& at) const {
    return (std::size_t(at.x()) * std::size_t(size_.y()) + std::size_t(at.y())) * std::size_t(size_.z()) +
           std::size_t(at.z());
  }
  Eigen::Vector3i cell_of(const Eigen::Vector3d& point) const;

  double cell_ = 0.0;
  Eigen::Vector3d lower_ = Eigen::Vector3d::Zero();
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
  enum : std::uint8_t { kUnseen, kBlocked, kFree };
  std::uint8_t state_at(const Eigen::Vector3d& point) const {
    return state_.empty() ? std::uint8_t(kBlocked) : state_[index(cell_of(point))];
  }
  std::vector<std::uint8_t> state_;
};

}  // namespace hermesh::validation
