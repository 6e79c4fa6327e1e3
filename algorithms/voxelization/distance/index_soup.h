// A mesh as a soup of triangles in voxels, without a copy: a copy of ten million triangles would take more
// memory than the volume.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// Corners of a triangle: [3 · corner + axis], voxels relative to the mesh's origin.
using TriangleCorners = std::array<double, 9>;

/// A view of a mesh as triangles in voxels. It refers to the mesh, which must outlive it.
class IndexSoup {
 public:
  IndexSoup(const PolygonMesh& mesh, double voxel_size) : mesh_(mesh), scale_(1.0 / voxel_size) {}

  /// Returns the number of triangles, two for a quad; they are numbered as triangulated() numbers them.
  std::size_t size() const { return mesh_.triangle_count(); }
  /// Returns the point numbers of triangle i.
  Triangle triangle(std::size_t i) const {
    if (i < mesh_.triangles.size()) return mesh_.triangles[i];
    const std::size_t half = i - mesh_.triangles.size();
    const Quad& q = mesh_.quads[half / 2];
    return half % 2 == 0 ? Triangle{q[0], q[1], q[2]} : Triangle{q[0], q[2], q[3]};
  }
  /// Returns a point in world units relative to the mesh's origin.
  const Eigen::Vector3f& point(std::uint32_t i) const { return mesh_.points[i]; }
  double scale() const { return scale_; }  ///< voxels per world unit
  /// Returns the corners of triangle i. The product of single precision coordinates and the scale is rounded
  /// once, in double.
  TriangleCorners corners(std::size_t i) const {
    const Triangle t = triangle(i);
    TriangleCorners corners;
    for (std::size_t c = 0; c < 3; ++c)
      for (int axis = 0; axis < 3; ++axis) corners[3 * c + axis] = double(mesh_.points[t[c]][axis]) * scale_;
    return corners;
  }
  const PolygonMesh& mesh() const { return mesh_; }

 private:
  const PolygonMesh& mesh_;
  double scale_;
};

/// A triangle in voxels.
struct Facet {
  Eigen::Vector3d corner[3];

  Facet(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) : corner{a, b, c} {}
  explicit Facet(const TriangleCorners& c)
      : corner{{c[0], c[1], c[2]}, {c[3], c[4], c[5]}, {c[6], c[7], c[8]}} {}

  /// Returns the lower and upper corner of the bounding box.
  Eigen::Vector3d low() const { return corner[0].cwiseMin(corner[1]).cwiseMin(corner[2]); }
  Eigen::Vector3d high() const { return corner[0].cwiseMax(corner[1]).cwiseMax(corner[2]); }
  /// Returns the normal on the side from which the corners run counter-clockwise; its length is twice the
  /// area.
  Eigen::Vector3d normal() const { return (corner[1] - corner[0]).cross(corner[2] - corner[0]); }
};

/// Returns the parameter, from 0 at `from` to 1 at `to`, at which the segment intersects the triangle, its
/// boundary included with a tolerance; −1 if it does not, or lies in the triangle's plane. All in voxels.
/// (Möller & Trumbore 1997)
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

}  // namespace hermesh
