// The surface that the bound of a remeshing is about, and the proof that a mesh is within an error of it, in
// both directions.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/search/surface_distance.h"
#include "algorithms/voxelization/distance/wide_band.h"
#include "algorithms/voxelization/inside/winding_number.h"

namespace hermesh {

/// Distance from a polygon within which its neighbourhood is rounding, in extents of the polygons.
inline constexpr double kOffSurface = 1e-6;

/// The boundary of the solid that polygons describe, relative to their origin.
struct SolidSurface {
  std::vector<Eigen::Vector3f> points;
  std::vector<Triangle> triangles;
  std::vector<Triangle> caps;         ///< triangles that close holes
  double area = 0.0, cap_area = 0.0;  ///< of the polygons, and of the caps; world units²
};

/// Returns the polygons' surface as a voxelization found it.
/// @param boundary relative to the mesh's origin, with the caps of holes
/// @param turns those of orient_faces(), or empty; faces that it omits are not part of the surface
/// @param over_holes true if the caps are part of the surface
SolidSurface surface_of(BoundaryTriangles boundary, std::span<const std::int8_t> turns, bool over_holes);

/// A position, relative to the polygons' origin, where mesh and surface are farther apart than allowed.
struct Far {
  Eigen::Vector3d place;
  double distance;
  bool of_surface;                  ///< it lies on the surface, otherwise on the mesh
  std::uint32_t triangle = 0;       ///< of the surface, if it lies on that
  double radius = 0.0, area = 0.0;  ///< of the piece around it, with Wanted::far_pieces (FarTriangle)
};

/// The proved two-sided distance, world units.
struct TwoSidedDistance {
  double to_surface = 0.0, from_surface = 0.0;  ///< upper bounds, except at `far`
  double free_area = 0.0;                       ///< area of polygons far from the mesh that bound nothing
  std::vector<Far> far;                         ///< positions where the error is exceeded, or may be
};

/// Proves bounds of the distance between meshes and the surface of polygons (search/surface_distance.h).
/// Polygons with the solid on both sides, or on neither, bound nothing and need not be near a mesh: pieces of
/// them no larger than a 16th of the error are tested by the winding number at both sides of their middle.
/// This is the only part of the bound that is sampled and not proved; its area is reported.
class TwoSidedProof {
 public:
  /// @param mesh the polygons; must outlive this
  /// @param by_winding true if the winding number defines the inside; if not, no polygon is free
  /// @param keeps_open true if polygons with the outside on both sides count as surface
  TwoSidedProof(const PolygonMesh& mesh, double error, bool by_winding, bool keeps_open);

  /// Orientations of the polygons as of orient_faces(); empty unless the winding number defines the inside.
  std::span<const std::int8_t> turns() const;

  /// Returns true if the surface bounds nothing next to a position, a corner of its triangle.
  bool bounds_nothing(const SolidSurface& surface, const Far& at) const;

  /// Returns true if the solid is behind a triangle and not in front of it, next to its middle. Requires that
  /// the winding number defines the inside.
  bool bounds_solid(const std::vector<Eigen::Vector3f>& points, const Triangle& triangle) const;

  /// Compares a mesh with the surface. `points` are relative to a position that is `offset` from the
  /// polygons' origin; `to` and `from` measure the distances to the surface and to the mesh. With
  /// Wanted::small_bound the bounds are minimal, to a few hundredths of the error; otherwise they are at most
  /// the error. If `lists_pieces`, `far` has pieces (Wanted::far_pieces), and the bounds hold for all points
  /// outside of the balls around these.
  /// @throws Cancelled
  TwoSidedDistance compare(std::span<const Eigen::Vector3f> points, const std::vector<Triangle>& triangles,
                           const Eigen::Vector3d& offset, const SolidSurface& surface,
                           const SurfaceDistance& to, const SurfaceDistance& from, Wanted wanted,
                           bool lists_pieces, const RunContext& context) const;

 private:
  using Corners = std::array<Eigen::Vector3d, 3>;
  /// Returns the positions in front of and behind the middle of a piece, just off it; none without an area.
  std::optional<std::array<Eigen::Vector3d, 2>> sides_of(const Corners& piece) const;
  /// Sets a result for each of some pieces near each other: 1 if it bounds nothing.
  void bound_nothing(std::span<const Corners> pieces, std::span<std::uint8_t> results) const;
  DistanceFromSurface smallest_bound(const SurfaceDistance& to, std::span<const Eigen::Vector3f> points,
                                     const Eigen::Vector3d& offset, std::vector<Triangle> triangles,
                                     const FreePieces& free, bool lists_pieces,
                                     const RunContext& context) const;

  const double error_, rounding_;  ///< world units
  const bool keeps_open_;
  std::optional<OrientedWinding> winding_;
};

/// Returns the area of a triangle, in the points' units squared.
double area(const std::vector<Eigen::Vector3f>& points, const Triangle& t);

}  // namespace hermesh
