// Whether a straight segment is free of triangles.
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
  /// A triangle of an IndexSoup.
  explicit Facet(const TriangleCorners& c)
      : corner{{c[0], c[1], c[2]}, {c[3], c[4], c[5]}, {c[6], c[7], c[8]}} {}

  /// Lower and upper corner of the bounding box.
  Eigen::Vector3d low() const { return corner[0].cwiseMin(corner[1]).cwiseMin(corner[2]); }
  Eigen::Vector3d high() const { return corner[0].cwiseMax(corner[1]).cwiseMax(corner[2]); }
  /// Normal on the side from which the corners run counter-clockwise; its length is twice the area.
  Eigen::Vector3d normal() const { return (corner[1] - corner[0]).cross(corner[2] - corner[0]); }
};

/// Where the segment meets the triangle, its border included with a tolerance: a parameter from 0 at `from`
/// to 1 at `to`, or −1 where it does not, or lies in the triangle's plane. All in voxels. (Möller & Trumbore
/// 1997)
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

/// A triangle that is prepared for tests against many segments, most of which pass it by.
class Obstacle {
 public:
  explicit Obstacle(const Facet& facet)
      : facet_(facet),
        low_(facet.low().array() - kMargin),
        high_(facet.high().array() + kMargin),
        normal_(facet.normal()),
        offset_(normal_.dot(facet.corner[0])),
        slack_(kMargin * normal_.norm()) {}

  /// The parameter that hermesh::meeting() gives, after tests against the box and the plane that reject most
  /// segments.
  double meeting(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
    if ((from.cwiseMin(to).array() > high_.array()).any() || (from.cwiseMax(to).array() < low_.array()).any())
      return -1.0;
    const double a = normal_.dot(from) - offset_, b = normal_.dot(to) - offset_;
    if (std::min(a, b) > slack_ || std::max(a, b) < -slack_) return -1.0;
    return hermesh::meeting(from, to, facet_);
  }
  /// Lower corner of the bounding box, grown by the margin.
  const Eigen::Vector3d& low() const { return low_; }
  /// Upper corner of the bounding box, grown by the margin.
  const Eigen::Vector3d& high() const { return high_; }
  /// Whether the triangle's plane, with a margin, meets the cell whose lowest corner is the sample `voxel`.
  bool plane_meets_cell(const Eigen::Vector3d& voxel) const {
    const double from_middle = normal_.dot(voxel + Eigen::Vector3d::Constant(0.5)) - offset_;
    return std::abs(from_middle) <= 0.5 * normal_.lpNorm<1>() + slack_;
  }
  /// Whether the corners run counter-clockwise seen from p.
  bool faces(const Eigen::Vector3d& p) const { return normal_.dot(p) > offset_; }

 private:
  static constexpr double kMargin = 5e-6;  ///< voxels; above kSideShift, by which segments leave their cells
  Facet facet_;
  Eigen::Vector3d low_, high_;
  Eigen::Vector3d normal_;  ///< not of unit length
  double offset_, slack_;
};

}  // namespace hermesh
