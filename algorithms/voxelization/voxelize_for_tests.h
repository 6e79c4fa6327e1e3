// Solids for the tests of voxelize(), with faces that look outwards, and functions that check its result.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/search/triangle_tree.h"
#include "algorithms/voxelization/voxelize.h"

namespace hermesh::voxelize_for_tests {

using Eigen::Vector3d;

inline void add_triangle(PolygonMesh& mesh, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const std::uint32_t n = std::uint32_t(mesh.points.size());
  for (const Vector3d& p : {a, b, c}) mesh.points.push_back(p.cast<float>());
  mesh.triangles.push_back({n, n + 1, n + 2});
}

/// Returns a sphere of latitudes and longitudes, the faces outwards.
inline PolygonMesh sphere(const Vector3d& centre, double radius, int n = 24) {
  PolygonMesh mesh;
  const auto at = [&](int i, int j) {
    const double theta = std::numbers::pi * i / n, phi = std::numbers::pi * (j % (2 * n)) / n;
    // Both poles exactly on the axis, so that the mesh is closed.
    const double r = i == 0 || i == n ? 0.0 : std::sin(theta);
    return Vector3d(centre +
                    radius * Vector3d(r * std::cos(phi), r * std::sin(phi), i == n ? -1.0 : std::cos(theta)));
  };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < 2 * n; ++j) {
      if (i > 0) add_triangle(mesh, at(i, j), at(i + 1, j), at(i, j + 1));
      if (i < n - 1) add_triangle(mesh, at(i, j + 1), at(i + 1, j), at(i + 1, j + 1));
    }
  return mesh;
}

inline PolygonMesh box(const Vector3d& low, const Vector3d& high) {
  PolygonMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.points.push_back(
        Vector3d(i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(), i & 4 ? high.z() : low.z())
            .cast<float>());
  mesh.quads = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  return mesh;
}

/// Returns the exact signed distance from p to a box, negative inside.
inline double to_box(const Vector3d& p, const Vector3d& low, const Vector3d& high) {
  const Vector3d out = (low - p).cwiseMax(p - high);
  return out.cwiseMax(0.0).norm() + std::min(out.maxCoeff(), 0.0);
}

inline void append(PolygonMesh& mesh, const PolygonMesh& other, bool turned = false) {
  const std::uint32_t n = std::uint32_t(mesh.points.size());
  mesh.points.insert(mesh.points.end(), other.points.begin(), other.points.end());
  for (const Triangle& t : triangulated(other))
    mesh.triangles.push_back(turned ? Triangle{t[0] + n, t[2] + n, t[1] + n}
                                    : Triangle{t[0] + n, t[1] + n, t[2] + n});
}

inline Voxelization run(const PolygonMesh& mesh, VoxelizeOptions options = {}) {
  RunContext context;
  return voxelize(mesh, options, context);
}

inline double at(const Voxelization& v, int x, int y, int z) {
  return v.distance->tree().getValue(openvdb::Coord(x, y, z));
}

struct Errors {
  double worst = 0;        ///< largest error of a magnitude, voxels
  std::size_t active = 0;  ///< voxels whose state is wrong by more than the tolerance
  std::size_t checked = 0;
};

/// Compares every voxel of the box with the tree of triangles, which is exact in double precision, and
/// independent of blocks and vector code.
inline Errors compare(const PolygonMesh& mesh, const Voxelization& v, double voxel_size, double band,
                      int margin) {
  const std::vector<Triangle> triangles = triangulated(mesh);
  const TriangleTree tree(mesh.points, triangles, 1.0 / voxel_size);
  const Bounds bounds = hermesh::bounds(mesh);
  Errors errors;
  const auto accessor = v.distance->getConstAccessor();
  Eigen::Vector3i low, high;
  for (int a = 0; a < 3; ++a) {
    low[a] = int(std::floor((bounds.lower[a] - mesh.origin[a]) / voxel_size)) - margin;
    high[a] = int(std::ceil((bounds.upper[a] - mesh.origin[a]) / voxel_size)) + margin;
  }
  for (int x = low[0]; x <= high[0]; ++x)
    for (int y = low[1]; y <= high[1]; ++y)
      for (int z = low[2]; z <= high[2]; ++z) {
        const double truth = std::sqrt(tree.nearest(Vector3d(x, y, z)).squared);
        float value;
        const bool on = accessor.probeValue({x, y, z}, value);
        ++errors.checked;
        if (on) errors.worst = std::max(errors.worst, std::abs(std::abs(value) / voxel_size - truth));
        errors.active += on ? truth > band + 1e-4 : truth < band - 1e-4;
      }
  return errors;
}

/// Returns a sphere without its cap above z = `cut`.
inline PolygonMesh opened(double radius, double cut) {
  PolygonMesh mesh = sphere({0, 0, 0}, radius, 48);
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    return mesh.points[t[0]].z() > cut && mesh.points[t[1]].z() > cut && mesh.points[t[2]].z() > cut;
  });
  return mesh;
}

/// Returns the winding number at p, in voxels, as a sum over all triangles by the formula of van Oosterom &
/// Strackee in double precision; `scale` is in voxels per unit of the points.
inline double exact_winding_number(std::span<const Eigen::Vector3f> points,
                                   std::span<const Triangle> triangles, double scale,
                                   const Eigen::Vector3d& p) {
  double half = 0.0;
  for (const Triangle& t : triangles) {
    const Eigen::Vector3d a = points[t[0]].cast<double>() * scale - p;
    const Eigen::Vector3d b = points[t[1]].cast<double>() * scale - p;
    const Eigen::Vector3d c = points[t[2]].cast<double>() * scale - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    half +=
        std::atan2((b - a).cross(c - a).dot(a), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return half * 0.5 * std::numbers::inv_pi;
}

}  // namespace hermesh::voxelize_for_tests
