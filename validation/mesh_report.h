// What the judges say of a mesh: counts, the places of the first offenders, and sentences; never a bare
// "valid".
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/mesh_file.h"

namespace hermesh::validation {

/// The first offenders of one kind: where they are (world units) and which polygons they are. Polygons are
/// numbered triangles first, then quads.
struct Places {
  std::vector<Eigen::Vector3d> points;                ///< at most kMaxPlaces
  std::vector<std::array<std::int64_t, 2>> polygons;  ///< second is −1 where there is only one
};
inline constexpr std::size_t kMaxPlaces = 10;

/// A judge's answer that may be missing, because a library cannot load such a mesh; then `refusal` says why.
struct LibraryCounts {
  std::string library;  ///< "OpenMesh" or "CGAL"
  bool loaded = false;
  std::string refusal;  ///< one sentence, with the place, when not loaded
  std::int64_t boundary_edges = 0, components = 0, euler_characteristic = 0;
  double volume = 0.0, area = 0.0;
  std::vector<std::string>
      disagreements;  ///< one sentence for each count that is not ours; empty = agreement
};

struct SelfIntersections {
  std::int64_t pairs = 0;           ///< of triangles, all kinds
  std::int64_t disjoint = 0;        ///< the triangles share no point
  std::int64_t vertex_sharing = 0;  ///< they share one corner and meet elsewhere, too
  std::int64_t edge_sharing = 0;    ///< they share an edge and fold onto one another (coplanar overlap)
  Places places;
};

struct Distances {
  double max = 0.0, mean = 0.0, rms = 0.0;  ///< world units, over the samples
  Eigen::Vector3d worst = Eigen::Vector3d::Zero();
  std::int64_t samples = 0;
};

/// Between the normals of two surfaces, in degrees, over samples of the first.
struct NormalAngles {
  double mean = 0.0, rms = 0.0, max = 0.0;
  std::int64_t samples = 0;
};

/// Certified: lower ≤ true one-sided Hausdorff distance ≤ upper, world units.
struct HausdorffBound {
  double lower = 0.0, upper = 0.0;
};

struct FeatureDistances {
  std::int64_t edges = 0, corners = 0;     ///< sharp edges and corners found on the reference
  std::int64_t edges_excluded = 0;         ///< over the dihedral angle, but part of a smooth blend
  double edge_length = 0.0;                ///< world units, of the edges kept
  Distances edge_to_mesh, corner_to_mesh;  ///< from the reference's features to the judged mesh
};

struct MeshReport {
  // Counts over the polygons as they stand.
  std::int64_t points = 0, triangles = 0, quads = 0;
  std::int64_t boundary_edges = 0, non_manifold_edges = 0, non_manifold_vertices = 0, inconsistent_edges = 0;
  std::int64_t degenerate_polygons = 0, duplicate_polygons = 0, isolated_points = 0;
  std::int64_t components = 0, euler_characteristic = 0;
  std::optional<double> genus;  ///< only of a closed, manifold, oriented mesh; summed over components
  double volume = 0.0, area = 0.0;
  double smallest_angle = 0.0;  ///< degrees, over all triangles
  double worst_aspect = 0.0;  ///< longest edge over twice the inradius·√3: 1 for the equilateral triangle
  Places boundary_places, non_manifold_edge_places, non_manifold_vertex_places, inconsistent_places,
      degenerate_places, duplicate_places;

  std::vector<LibraryCounts> libraries;
  std::optional<SelfIntersections> self_intersections;  ///< absent when not asked for
  std::optional<Distances> to_reference, from_reference;
  std::optional<NormalAngles> normals_to_reference;
  std::optional<HausdorffBound> certified_to_reference, certified_from_reference;
  std::optional<FeatureDistances> features;

  bool closed() const { return boundary_edges == 0; }
  bool manifold() const { return non_manifold_edges == 0 && non_manifold_vertices == 0; }
  bool oriented() const { return inconsistent_edges == 0; }
  /// Closed, manifold, not self-intersecting. False when self-intersections were not asked for.
  bool watertight() const {
    return closed() && manifold() && self_intersections && self_intersections->pairs == 0;
  }
  bool libraries_agree() const {
    for (const LibraryCounts& l : libraries)
      if (!l.disagreements.empty()) return false;
    return true;
  }
  std::vector<std::string> sentences() const;  ///< the verdict in words, most important first
};

struct JudgeOptions {
  bool self_intersections = true;
  bool libraries = true;                ///< let OpenMesh and CGAL count, too
  const MeshFile* reference = nullptr;  ///< for the distances
  std::int64_t samples = 200'000;       ///< on each surface, by area, besides every point of it
  bool certify = false;                 ///< certified Hausdorff bound, both ways
  double certify_gap = 0.0;             ///< world units; 0 = 1e-4 of the reference's diagonal
  const MeshFile* features = nullptr;   ///< reference for the sharp features
  double dihedral_degrees = 30.0;
};

/// Judges a mesh as its file holds it. Same input, same report, at any thread count.
/// Of a mesh without polygons there are no distances and no features in the report.
/// @throws Cancelled; Error when a reference holds no polygon, when a point is not finite, or when a polygon
/// refers to a point that is not there.
MeshReport judge(const MeshFile& mesh, const JudgeOptions& options, RunContext& context);

}  // namespace hermesh::validation
