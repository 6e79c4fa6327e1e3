// Whether a straight way is free of triangles.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "algorithms/voxelization/distance/index_soup.h"

namespace hermesh {

/// A triangle in voxels.
struct Facet {
  Eigen::Vector3d corner[3];

  Facet() = default;
  Facet(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) : corner{a, b, c} {}
  explicit Facet(const TriangleCorners& c)
      : corner{{c[0], c[1], c[2]}, {c[3], c[4], c[5]}, {c[6], c[7], c[8]}} {}

  Eigen::Vector3d low() const { return corner[0].cwiseMin(corner[1]).cwiseMin(corner[2]); }
  Eigen::Vector3d high() const { return corner[0].cwiseMax(corner[1]).cwiseMax(corner[2]); }
  /// Not of unit length.
  Eigen::Vector3d normal() const { return (corner[1] - corner[0]).cross(corner[2] - corner[0]); }
};

/// Where the segment meets the triangle, its border included with a tolerance: 0 at `from` to 1 at `to`;
/// below 0 where it does not, or lies in the triangle's plane. (Möller & Trumbore 1997)
inline double meeting(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Facet& t) {
  const Eigen::Vector3d way = to - from, e1 = t.corner[1] - t.corner[0], e2 = t.corner[2] - t.corner[0];
  const Eigen::Vector3d p = way.cross(e2);
  const double det = e1.dot(p);
  if (det * det <= 1e-24 * e1.squaredNorm() * e2.squaredNorm() * way.squaredNorm()) return -1.0;
  constexpr double kOn = 1e-7;
  const Eigen::Vector3d s = from - t.corner[0];
  const double u = s.dot(p) / det;
  if (u < -kOn || u > 1.0 + kOn) return -1.0;
  const Eigen::Vector3d q = s.cross(e1);
  const double v = way.dot(q) / det;
  if (v < -kOn || u + v > 1.0 + kOn) return -1.0;
  const double along = e2.dot(q) / det;
  return along >= -kOn && along <= 1.0 + kOn ? std::max(along, 0.0) : -1.0;
}

/// A triangle that many ways are tried against, most of which pass it by.
class Obstacle {
 public:
  explicit Obstacle(const Facet& facet)
      : facet_(facet),
        low_(facet.low().array() - kMargin),
        high_(facet.high().array() + kMargin),
        normal_(facet.normal()),
        offset_(normal_.dot(facet.corner[0])),
        slack_(kMargin * normal_.norm()) {}

  /// As meeting() has it.
  double meeting(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
    if ((from.cwiseMin(to).array() > high_.array()).any() || (from.cwiseMax(to).array() < low_.array()).any())
      return -1.0;
    const double a = normal_.dot(from) - offset_, b = normal_.dot(to) - offset_;
    if (std::min(a, b) > slack_ || std::max(a, b) < -slack_) return -1.0;
    return hermesh::meeting(from, to, facet_);
  }
  /// Box, with a margin.
  const Eigen::Vector3d& low() const { return low_; }
  const Eigen::Vector3d& high() const { return high_; }
  /// Whether the triangle's plane, with a margin, meets the cell up from a voxel.
  bool plane_meets_cell(const Eigen::Vector3d& voxel) const {
    const double from_middle = normal_.dot(voxel + Eigen::Vector3d::Constant(0.5)) - offset_;
    return std::abs(from_middle) <= 0.5 * normal_.lpNorm<1>() + slack_;
  }
  /// Whether p is on the side that the triangle is wound counter-clockwise on.
  bool faces(const Eigen::Vector3d& p) const { return normal_.dot(p) > offset_; }

 private:
  static constexpr double kMargin = 5e-6;  ///< above kSideShift, by which ways leave the cells that they are in
  Facet facet_;
  Eigen::Vector3d low_, high_;
  Eigen::Vector3d normal_;  ///< not of unit length
  double offset_, slack_;
};

}  // namespace hermesh
