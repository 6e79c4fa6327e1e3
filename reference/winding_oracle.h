// The generalised winding number of a triangle soup, exact up to rounding (Jacobson, Kavan and
// Sorkine-Hornung, Robust Inside-Outside Segmentation using Generalized Winding Numbers, 2013).
#pragma once

#include <vector>

#include "reference/distance_oracle.h"

namespace hermesh {

/// Sum of all triangles' solid angles (van Oosterom and Strackee, 1983) over 4π: 1 inside a closed surface
/// with its normals outwards, 0 outside, between them near the holes of an open one. Takes ten nanoseconds or
/// so a triangle.
double winding_number(const std::vector<Corners>& triangles, const Eigen::Vector3d& point);

/// The same number, sooner: the soup less the cone over its boundary (every edge as often as it is used in
/// one direction more than in the other) from some apex is closed, so that its winding number is the number
/// of signed crossings of any ray; what the cone adds has as many terms as the boundary has edges, and none
/// if the mesh is closed. Points with the same coordinates are one.
class WindingOracle {
 public:
  /// Keeps a reference to the surface.
  explicit WindingOracle(const DistanceOracle& surface);

  /// The soup's winding number, its sign turned where the soup as a whole is inside out: has a negative
  /// volume, and that about every point of its box. The volume of an open soup depends on the point, and
  /// where even its sign does, as it does for a sheet, the winding that was given stands.
  double operator()(const Eigen::Vector3d& point) const;
  bool inside(const Eigen::Vector3d& point) const { return (*this)(point) > 0.5; }

  /// Whether the surface's triangle bounds the solid where a point lies on it, 1e-3 voxel off on both sides.
  bool differs_across(const Corners& triangle, const Eigen::Vector3d& on_triangle) const;

  /// Whether a point of the surface bounds the solid: one side of it is inside and the other outside. Looks
  /// at both sides of every triangle that has the point, a little way into the triangle and 1e-3 voxel (less
  /// where the triangle is smaller) off its plane.
  bool bounds_solid(const DistanceOracle& surface, const Eigen::Vector3d& on_surface) const;

 private:
  struct ConeTriangle {
    Corners corners;
    int multiplicity;
  };
  int closed_winding(const Eigen::Vector3d& point) const;

  const DistanceOracle& surface_;
  std::vector<ConeTriangle> cone_;
  double orientation_ = 1.0;
};

/// The parts of the triangles that bound the solid: those of which the middle and points near the corners do.
/// A triangle of which only some do is split in four, until the pieces' edges are shorter than `finest`
/// (voxels); so the boundary ends within that of where the surface dives into the solid. What passes between
/// all four points is overlooked: give it triangles that are small beside the features. @throws Cancelled.
std::vector<Corners> solid_boundary(const DistanceOracle& surface, const WindingOracle& solid, double finest,
                                    const RunContext& context);

}  // namespace hermesh
