// The polygons as a soup of triangles in voxels, without a copy: a copy of ten million triangles would
// outweigh the volume that they become.
#pragma once

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// Corners of a triangle: [3 · corner + axis], voxels relative to the mesh's origin.
using TriangleCorners = std::array<double, 9>;

/// A mesh seen as triangles in voxels. It refers to the mesh, which has to outlive it.
class IndexSoup {
 public:
  IndexSoup(const PolygonMesh& mesh, double voxel_size) : mesh_(mesh), scale_(1.0 / voxel_size) {}

  /// Number of triangles, each quad being two; they are numbered as triangulated() numbers them.
  std::size_t size() const { return mesh_.triangle_count(); }
  /// The point numbers of triangle i.
  Triangle triangle(std::size_t i) const {
    if (i < mesh_.triangles.size()) return mesh_.triangles[i];
    const std::size_t half = i - mesh_.triangles.size();
    const Quad& q = mesh_.quads[half / 2];
    return half % 2 == 0 ? Triangle{q[0], q[1], q[2]} : Triangle{q[0], q[2], q[3]};
  }
  /// A point in world units relative to the mesh's origin.
  const Eigen::Vector3f& point(std::uint32_t i) const { return mesh_.points[i]; }
  double scale() const { return scale_; }  ///< voxels a world unit
  /// Corners of triangle i. The product of single precision coordinates and the scale is rounded once, in
  /// double.
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

}  // namespace hermesh
