// Polygons that are already a valid mesh of a solid, except for few triangles, so that a bounded remeshing
// needs no volume.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_collapse/fine_mesh.h"

namespace hermesh {

/// A closed, oriented, manifold mesh, relative to the origin of its polygons.
struct ManifoldPolygons {
  std::vector<Eigen::Vector3f> points;              ///< those in use, no two at one position
  std::vector<Triangle> triangles;                  ///< each with an area
  std::vector<std::uint8_t> meets;                  ///< by triangle: 1 if it may intersect another one
  std::vector<std::array<std::uint32_t, 2>> pairs;  ///< that may intersect, as given, in ascending order
  double mean_edge = 0.0;                           ///< world units

  bool is_embedded() const;  ///< true if no triangle meets another one
};

/// Returns the polygons as a mesh, without triangles that have two corners at one position, if they are
/// closed and manifold, and few triangles meet others; none otherwise. Contacts count as intersections, as
/// does anything too near to one to be certain (certainly_apart()).
/// @param turns those of orient_faces(): triangles with −1 are reversed
/// @throws Cancelled
std::optional<ManifoldPolygons> manifold_polygons(const PolygonMesh& mesh, std::span<const std::int8_t> turns,
                                                  const RunContext& context);

/// Collapses edges of the triangles that meet others, round by round, until none does or no edge is left
/// that can be collapsed. The mesh remains closed and manifold. Deterministic.
ManifoldPolygons untangled(ManifoldPolygons mesh, const RunContext& context);

/// Returns the vertices in units of `unit`, a power of two, so that they are exact.
std::vector<Eigen::Vector3d> scaled(std::span<const Eigen::Vector3f> points, double unit);

/// Returns by triangle the one with the largest area of its patch, the set that is connected by sides;
/// FineMesh::kNone for the triangles that meet others. Along each side of a patch the winding number is
/// constant.
std::vector<std::uint32_t> largest_of_patch(const ManifoldPolygons& mesh);

/// Returns pieces of the triangles that meet others, each of which meets none: all but those with sides
/// shorter than `smallest`. Appends their corners to `points`, which begin with the mesh's.
std::vector<Triangle> pieces_apart(const ManifoldPolygons& mesh, double smallest,
                                   std::vector<Eigen::Vector3f>& points);

}  // namespace hermesh
