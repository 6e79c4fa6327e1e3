// The surface that the bound of a remeshing is about: the boundary of the solid that polygons describe.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/voxelization/distance/wide_band.h"

namespace hermesh {

/// The surface that the bound is about, relative to the mesh's origin.
struct SolidSurface {
  std::vector<Eigen::Vector3f> points;
  std::vector<Triangle> triangles;
  std::vector<Triangle> caps;         ///< what closes holes
  double area = 0.0, cap_area = 0.0;  ///< of the polygons, and of the caps; world units²
};

/// The polygons' surface as a voxelization found it.
/// @param boundary relative to the mesh's origin, with the caps of holes
/// @param turns those of orient_faces(), or empty; what it leaves out is no part of the surface
/// @param over_holes whether the caps are
SolidSurface surface_of(BoundaryTriangles boundary, std::span<const std::int8_t> turns, bool over_holes);

/// The area of a triangle, in the points' units squared.
double area(const std::vector<Eigen::Vector3f>& points, const Triangle& t);

/// The centroid of a triangle of the surface.
Eigen::Vector3d middle(const SolidSurface& surface, std::uint32_t triangle);

}  // namespace hermesh
