// Polygons that are a valid mesh of a solid as they are, so that a bounded remeshing needs no volume.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_collapse/fine_mesh.h"

namespace hermesh {

/// A closed, oriented, manifold mesh free of self-intersection, relative to the origin of its polygons.
struct EmbeddedPolygons {
  std::vector<Eigen::Vector3f> points;  ///< those in use, no two at one position
  std::vector<Triangle> triangles;      ///< each with an area
  double mean_edge = 0.0;               ///< world units
};

/// Returns the polygons as a mesh, without triangles that have two corners at one position, if they are
/// closed, manifold and free of self-intersection; none otherwise. Contacts count as intersections, as does
/// anything too near to one to be certain (certainly_apart()).
/// @param turns those of orient_faces(): triangles with −1 are reversed
/// @throws Cancelled
std::optional<EmbeddedPolygons> embedded_polygons(const PolygonMesh& mesh, std::span<const std::int8_t> turns,
                                                  const RunContext& context);

/// Returns the vertices in units of `unit`, a power of two, so that they are exact.
std::vector<Eigen::Vector3d> scaled(std::span<const Eigen::Vector3f> points, double unit);

/// Returns the triangle with the largest area of each set that is connected by vertices.
std::vector<std::uint32_t> largest_of_components(const EmbeddedPolygons& mesh);

}  // namespace hermesh
