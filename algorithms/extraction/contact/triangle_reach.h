// Tests many points for being within a distance of one triangle.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "algorithms/extraction/contact/triangle_contact.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {

/// Tests whether points are near a triangle, by the triangle's plane and the three planes through its sides
/// perpendicular to it. These decide most points; only those next to the triangle need the exact distance.
class TriangleReach {
 public:
  TriangleReach() = default;
  explicit TriangleReach(const Corners& corners) : corners_(corners) {
    const Eigen::Vector3d n = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    normal_ = n / n.norm();
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d out = (corners[(i + 1) % 3] - corners[i]).cross(normal_);
      sides_.row(i) = out / out.norm();
      offsets_[i] = sides_.row(i).dot(corners[i]);
    }
    // A degenerate triangle has no planes; then every comparison below is false and the exact distance
    // decides.
  }

  /// Returns the distances of p beyond the three sides, along the plane: negative inside.
  Eigen::Vector3d beyond(const Eigen::Vector3d& p) const { return sides_ * p - offsets_; }

  /// Returns true if the distance from p to the triangle is at most `within`.
  bool near(const Eigen::Vector3d& p, double within) const {
    const double height = normal_.dot(p - corners_[0]);
    if (std::abs(height) > within) return false;
    const double beside = beyond(p).maxCoeff();
    if (beside <= 0) return true;
    if (beside * beside + height * height > within * within) return false;
    return squared_distance(p, corners_[0], corners_[1], corners_[2]) <= within * within;
  }

 private:
  Corners corners_ = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  Eigen::Vector3d normal_ = Eigen::Vector3d::Zero(), offsets_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d sides_ = Eigen::Matrix3d::Zero();
};

}  // namespace hermesh
