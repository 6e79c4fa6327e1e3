// What stands over a triangle of a merged mesh, and whether another mesh passes through it once
// (region_shell.h).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>

#include "algorithms/extraction/contact/triangle_overlay.h"

namespace hermesh {

/// The places within a height above and below a triangle, along directions, its *pillars*, that are given at
/// its corners and interpolated between. Parts of space beside or above it are known by linear functions: a
/// triangle is there if its corners are. Lengths in voxels.
class ShellPrism {
 public:
  /// What coordinates are uncertain by, in voxels: far above what doubles make of them.
  static constexpr double kRounding = 1e-6;
  using Plane = Eigen::Hyperplane<double, 3>;

  /// Stands a prism on a triangle. `pillars` are unit directions; `height` is how far it reaches up and down.
  ShellPrism(const Corners& corners, const std::array<Eigen::Vector3d, 3>& pillars, double height);

  /// Whether all pillars rise over the triangle, and do not meet or cross. Nothing else may be asked if not.
  bool stands() const { return stands_; }

  const OverTriangle& over() const { return over_; }
  const std::array<Eigen::Vector3d, 3>& pillars() const { return pillars_; }
  double height() const { return height_; }
  /// How far a pillar leans out with each voxel of height, for each side and each of the side's ends.
  const std::array<std::array<double, 2>, 3>& leans() const { return leans_; }
  /// The planes of lid and bottom, positive outside.
  const Plane& lid() const { return lid_; }
  const Plane& bottom() const { return bottom_; }
  /// A box about all of the prism.
  const Eigen::AlignedBox3d& box() const { return box_; }
  /// How far lid and bottom are from the triangle's plane at least, as a share of the height.
  double least_lid() const { return least_lid_; }
  /// How far a place is beyond a side's wall, wherever between its two pillars that is: negative if it may be
  /// inside.
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

/// How a triangle meets a prism. `good`: what of the triangle is in the prism faces up along all pillars, and
/// is off the lid and the bottom; `none`: nothing is, or less than kRounding deep.
enum class Meeting { none, good, bad };
/// Tells how a triangle meets a prism. What of it is in the prism is only good within `tolerance` of the
/// prism's triangle, voxels.
Meeting meet(const ShellPrism& prism, const Corners& triangle, double tolerance);

/// Whether some of a triangle that meets the prism and is good, or is wholly between lid and bottom, is
/// certainly in it.
bool reaches_into(const ShellPrism& prism, const Corners& triangle);

}  // namespace hermesh
