// Shapes of which everything is known in closed form: the truth that orders of accuracy are measured against.
//
// A mesh is usually compared with polygons, and then the polygons' own error hides the mesh's. Here the
// distance from any point, the nearest point, normal and curvature there, area, volume and creases are those
// of the surface itself (the method of manufactured solutions: Etiene et al., Verifiable Visualization for
// Isosurface Extraction, 2009).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// A point on a surface. Curvatures are positive where a solid is convex.
struct SurfacePlace {
  Eigen::Vector3d point, normal;  ///< the normal has unit length and points outwards
  double mean_curvature = 0.0;    ///< half the sum of the principal curvatures
  double gaussian_curvature = 0.0;
};

/// A solid about the origin, of a size around 1, in its own frame.
class ExactShape {
 public:
  virtual ~ExactShape() = default;

  /// Returns the nearest point of the surface, or one of them if there are several. On a crease, the normal
  /// is that of the adjacent face that `p` is farther above.
  virtual SurfacePlace nearest(const Eigen::Vector3d& p) const = 0;
  /// Returns the signed distance to the surface, negative inside; exact where |distance| is below
  /// exact_within().
  virtual double distance(const Eigen::Vector3d& p) const = 0;
  virtual double exact_within() const { return 1e300; }
  /// Returns the value at p of a function with the sign of distance() that never exceeds the distance in
  /// magnitude, and whose slope is at most 1: the distance itself if that is exact everywhere.
  virtual double bounded_distance(const Eigen::Vector3d& p) const { return distance(p); }

  virtual std::optional<double> area() const = 0;    ///< none: it has no closed form
  virtual std::optional<double> volume() const = 0;  ///< none: it has no closed form
  virtual Eigen::Vector3d half_size() const = 0;     ///< the solid lies within these, along the axes

  /// Returns true if normals are discontinuous along creases.
  virtual bool is_sharp() const { return false; }
  /// Returns true if all of the surface is flat, so that polygons and Hermite data represent it exactly.
  virtual bool is_flat() const { return false; }
  /// Points of all creases, `spacing` apart or less.
  virtual std::vector<Eigen::Vector3d> crease_points(double /*spacing*/) const { return {}; }
  virtual std::vector<Eigen::Vector3d> corners() const { return {}; }

  /// Returns true if p is in the part of space in which the surface is the described one, which is all of
  /// space except for shapes that had to be cut off.
  virtual bool describes(const Eigen::Vector3d& /*p*/) const { return true; }

  /// Triangles with all corners on the surface and sides of about `length`, closed and oriented outwards,
  /// with creases along sides. Flat faces need no more than two. Empty where the shape has no parameters to
  /// walk along.
  virtual PolygonMesh facets(double length) const = 0;
};

/// Names in the order of tables: sphere, ellipsoid (axes 1, .7, .5), torus (.7 and .3), rounded-box, gyroid,
/// cylinder, cube. The gyroid sin x cos y + sin y cos z + sin z cos x = 0 at twice the size of space, cut off
/// by a ball of 1.25 and described within 0.75, has no closed distance: the nearest point is found by
/// Newton's method on the conditions of Lagrange, to rounding.
std::span<const char* const> exact_shape_names();
/// @throws Error for an unknown name.
std::shared_ptr<const ExactShape> exact_shape(const std::string& name);

/// A rotated and translated shape: its results are in world coordinates.
class PlacedShape {
 public:
  PlacedShape(std::shared_ptr<const ExactShape> shape, const Eigen::Isometry3d& to_world)
      : shape_(std::move(shape)), to_world_(to_world), to_shape_(to_world.inverse()) {}

  const ExactShape& shape() const { return *shape_; }
  double distance(const Eigen::Vector3d& p) const { return shape_->distance(to_shape_ * p); }
  double bounded_distance(const Eigen::Vector3d& p) const { return shape_->bounded_distance(to_shape_ * p); }
  bool describes(const Eigen::Vector3d& p) const { return shape_->describes(to_shape_ * p); }
  SurfacePlace nearest(const Eigen::Vector3d& p) const;
  std::vector<Eigen::Vector3d> crease_points(double spacing) const;
  std::vector<Eigen::Vector3d> corners() const;
  PolygonMesh facets(double length) const;
  Bounds bounds() const;

 private:
  std::shared_ptr<const ExactShape> shape_;
  Eigen::Isometry3d to_world_, to_shape_;
};

/// Returns the shape rotated by 20°, 30° and 40° about x, y and z, so that nothing is axis-aligned, and
/// translated.
PlacedShape turned(std::shared_ptr<const ExactShape> shape, const Eigen::Vector3d& move);

}  // namespace hermesh
