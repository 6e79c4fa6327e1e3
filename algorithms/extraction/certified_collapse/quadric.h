// Sum of squared distances to planes, weighted by area (Garland & Heckbert 1997).
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "algorithms/extraction/certified_collapse/fine_mesh.h"

namespace hermesh {

/// A quadric relative to an anchor that its owner stores, so that single precision is enough. Voxels, weights
/// in square voxels.
struct PlaneQuadric {
  Eigen::Matrix<float, 6, 1> a = Eigen::Matrix<float, 6, 1>::Zero();  ///< xx xy xz yy yz zz
  Eigen::Vector3f b = Eigen::Vector3f::Zero();
  float c = 0;

  /// Adds a plane through the anchor.
  void add_plane(const Eigen::Vector3d& unit_normal, double weight) {
    const Eigen::Vector3f n = unit_normal.cast<float>();
    const float w = static_cast<float>(weight);
    a += w * Eigen::Matrix<float, 6, 1>(n[0] * n[0], n[0] * n[1], n[0] * n[2], n[1] * n[1], n[1] * n[2],
                                        n[2] * n[2]);
  }
};

/// Calls f(unit normal, weight) for the planes of the triangles around a vertex of a fine mesh; each triangle
/// gives a third of its area to each corner.
template <class F>
void for_each_plane_at(const FineMesh& fine, std::uint32_t point, F&& f) {
  for (const std::uint32_t t : fine.around(point)) {
    const Corners at = fine.corners(t);
    const Eigen::Vector3d normal = (at[1] - at[0]).cross(at[2] - at[0]);
    const double size = normal.norm();
    if (size > 0) f(Eigen::Vector3d(normal / size), size / 6.0);
  }
}

/// Returns the quadric of these planes, about the vertex.
inline PlaneQuadric quadric_at(const FineMesh& fine, std::uint32_t point) {
  PlaneQuadric quadric;
  for_each_plane_at(fine, point,
                    [&](const Eigen::Vector3d& n, double weight) { quadric.add_plane(n, weight); });
  return quadric;
}

/// Weight of the pull of a minimiser towards its anchor relative to the planes: enough to decide on a plane.
inline constexpr double kPull = 1e-6;

/// A quadric in double precision about any anchor. The trace of `a` is the sum of the weights, because
/// normals have unit length: the quadric over the trace is a mean squared distance.
struct WideQuadric {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double c = 0;

  /// Adds q, whose anchor lies `shift` from this one's.
  void add(const PlaneQuadric& q, const Eigen::Vector3d& shift) {
    Eigen::Matrix3d m;
    m << q.a[0], q.a[1], q.a[2], q.a[1], q.a[3], q.a[4], q.a[2], q.a[4], q.a[5];
    const Eigen::Vector3d moved = m * shift, v = q.b.cast<double>();
    a += m;
    b += v - moved;
    c += q.c - 2 * v.dot(shift) + shift.dot(moved);
  }
  /// Adds the plane of all x with unit_normal · x + offset = 0, x from this one's anchor.
  void add_plane(const Eigen::Vector3d& unit_normal, double offset, double weight) {
    a += weight * unit_normal * unit_normal.transpose();
    b += weight * offset * unit_normal;
    c += weight * offset * offset;
  }
  double operator()(const Eigen::Vector3d& x) const { return std::max(0.0, x.dot(a * x) + 2 * b.dot(x) + c); }
  /// Returns the quadric about a position relative to the anchor.
  PlaneQuadric about(const Eigen::Vector3d& x) const {
    PlaneQuadric q;
    q.a << float(a(0, 0)), float(a(0, 1)), float(a(0, 2)), float(a(1, 1)), float(a(1, 2)), float(a(2, 2));
    q.b = (b + a * x).cast<float>();
    q.c = static_cast<float>((*this)(x));
    return q;
  }
  /// Returns the minimiser of the quadric and a weak pull (kPull of its trace) towards the anchor, which
  /// decides where planes do not.
  Eigen::Vector3d minimiser() const {
    const double weight = kPull * a.trace() + 1e-12;
    const auto pulled = (a + weight * Eigen::Matrix3d::Identity()).ldlt();
    const Eigen::Vector3d x = pulled.solve(-b);
    // Once more from there: where the planes decide, little of the pull remains.
    return x + pulled.solve(-b - a * x);
  }
};

}  // namespace hermesh
