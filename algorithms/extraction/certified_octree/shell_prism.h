// The prism over a triangle of a merged mesh, and the test that another mesh passes through it once
// (region_shell.h).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>

#include "algorithms/extraction/contact/triangle_overlay.h"

namespace hermesh {

/// The points within a height above and below a triangle, along directions, its *pillars*, that are given at
/// its corners and interpolated between. Linear functions describe the space next to it and above it: a
/// triangle lies there if its corners do. Lengths in voxels.
class ShellPrism {
 public:
  /// Uncertainty of coordinates in voxels, far above the rounding of doubles.
  static constexpr double kRounding = 1e-6;
  using Plane = Eigen::Hyperplane<double, 3>;

  /// Builds a prism over a triangle. `pillars` are unit directions; `height` is its extent up and down.
  ShellPrism(const Corners& corners, const std::array<Eigen::Vector3d, 3>& pillars, double height);

  /// Returns true if all pillars rise over the triangle, and do not intersect. Otherwise the prism is
  /// invalid.
  bool stands() const { return stands_; }

  const OverTriangle& over() const { return over_; }
  const std::array<Eigen::Vector3d, 3>& pillars() const { return pillars_; }
  double height() const { return height_; }
  /// Returns the outward lean of a pillar per voxel of height, by side and end of the side.
  const std::array<std::array<double, 2>, 3>& leans() const { return leans_; }
  /// Returns the planes of lid and bottom, positive outside.
  const Plane& lid() const { return lid_; }
  const Plane& bottom() const { return bottom_; }
  /// Returns a box about all of the prism.
  const Eigen::AlignedBox3d& box() const { return box_; }
  /// Returns the least distance of lid and bottom from the triangle's plane, as a fraction of the height.
  double least_lid() const { return least_lid_; }
  /// Returns the distance of a position beyond a side's wall, or a lower bound: negative if it may be inside.
  double beyond_wall(const OverTriangle::Place& place, std::size_t side) const;

 private:
  double lean(const Eigen::Vector3d& pillar, std::size_t side) const;
  bool is_unfolded(const Corners& corners) const;
  bool keeps_its_corners(const Corners& corners) const;
  Plane through(const Corners& corners, double up) const;

  OverTriangle over_;
  std::array<Eigen::Vector3d, 3> pillars_;
  double height_;
  std::array<std::array<double, 2>, 3> leans_{};
  Plane lid_, bottom_;
  Eigen::AlignedBox3d box_;
  double least_lid_ = 1;
  bool stands_ = false;
};

/// Relation of a triangle and a prism. `good`: its part in the prism faces up along all pillars, and is off
/// the lid and the bottom; `none`: no part is in the prism, or less than kRounding deep.
enum class Meeting { none, good, bad };
/// Classifies a triangle. Its part in the prism is good only within `tolerance` of the prism's triangle,
/// voxels.
Meeting meet(const ShellPrism& prism, const Corners& triangle, double tolerance);

/// Returns true if a part of a triangle that is good, or wholly between lid and bottom, is certainly in the
/// prism.
bool reaches_into(const ShellPrism& prism, const Corners& triangle);

}  // namespace hermesh
