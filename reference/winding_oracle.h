// The generalised winding number of a triangle soup, exact up to rounding (Jacobson, Kavan and
// Sorkine-Hornung, Robust Inside-Outside Segmentation using Generalized Winding Numbers, 2013).
#pragma once

#include <vector>

#include "reference/distance_oracle.h"

namespace hermesh {

/// Returns the sum of all triangles' solid angles (van Oosterom and Strackee, 1983) over 4π: 1 inside a
/// closed surface with its normals outwards, 0 outside, between them near the holes of an open one. The sum
/// takes about ten nanoseconds per triangle.
double winding_number(const std::vector<Corners>& triangles, const Eigen::Vector3d& point);

/// Computes winding_number() sooner. The soup less a cone over its boundary (every edge as often as it is
/// used in one direction more than in the other), from some apex, is closed, so the winding number of the two
/// is the number of signed crossings of any ray. The cone's own share has as many terms as the boundary has
/// edges, and none if the mesh is closed. Points with the same coordinates count as one.
class WindingOracle {
 public:
  /// Keeps a reference to the surface.
  explicit WindingOracle(const DistanceOracle& surface);

  /// Returns the soup's winding number at a point, with its sign reversed if the soup as a whole is inside
  /// out, that is, if its volume is negative about every point of its box. The volume of an open soup depends
  /// on that point; if even the sign of the volume does, as for a sheet, the winding is taken as it was
  /// given.
  double operator()(const Eigen::Vector3d& point) const;
  /// Returns true if the winding number is above one half.
  bool inside(const Eigen::Vector3d& point) const { return (*this)(point) > 0.5; }

  /// Returns true if a triangle of the surface bounds the solid at a point on it: one of the two points 1e-3
  /// voxel off on its two sides is inside and the other outside.
  bool differs_across(const Corners& triangle, const Eigen::Vector3d& on_triangle) const;

  /// Returns true if a point of the surface bounds the solid: one side of it is inside and the other outside.
  /// Both sides of every triangle that contains the point are tested, at a short distance into the triangle
  /// and 1e-3 voxel (less where the triangle is smaller) off its plane.
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

/// Returns the parts of the triangles that bound the solid. A triangle is one if its middle and three points
/// near its corners bound it. A triangle of which only some of these points do is split in four, until the
/// pieces' edges are shorter than `finest` (voxels); so the boundary ends no farther than `finest` from where
/// the surface dives into the solid. Features that pass between all four points are overlooked, so the
/// triangles have to be small compared with the features.
/// @throws Cancelled.
std::vector<Corners> solid_boundary(const DistanceOracle& surface, const WindingOracle& solid, double finest,
                                    const RunContext& context);

}  // namespace hermesh
