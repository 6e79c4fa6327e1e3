// The validation report of a mesh: counts, the positions of the first defects of each kind, and messages.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/io/mesh_file.h"
#include "validation/geometry/quad_cut.h"

namespace hermesh::validation {

inline constexpr std::size_t kMaxPlaces = 10;
/// The first defects of one kind, in an order that does not depend on the number of threads. Polygons are
/// numbered triangles first, then quads.
struct Places {
  std::vector<Eigen::Vector3d> points;                ///< world units; at most kMaxPlaces
  std::vector<std::array<std::int64_t, 2>> polygons;  ///< the second is −1 if there is only one

  /// Adds a defect unless there are kMaxPlaces already.
  void add(const Eigen::Vector3d& point, std::int64_t first, std::int64_t second = -1) {
    if (points.size() >= kMaxPlaces) return;
    points.push_back(point);
    polygons.push_back({first, second});
  }
  /// Appends the defects of `later`, up to kMaxPlaces in all.
  void append(const Places& later) {
    for (std::size_t i = 0; i < later.points.size(); ++i)
      add(later.points[i], later.polygons[i][0], later.polygons[i][1]);
  }
};

/// Counts by another library, or the reason why it cannot load the mesh.
struct LibraryCounts {
  std::string library;  ///< "OpenMesh" or "CGAL"
  bool loaded = false;
  std::string refusal;  ///< a message, with the position, if not loaded
  std::int64_t boundary_edges = 0, components = 0, euler_characteristic = 0;
  double volume = 0.0, area = 0.0;
  std::vector<std::string> disagreements;  ///< a message for each count that differs from ours
};

struct SelfIntersections {
  std::int64_t pairs = 0;           ///< pairs of triangles, all kinds
  std::int64_t disjoint = 0;        ///< pairs that share no vertex
  std::int64_t vertex_sharing = 0;  ///< pairs that share one vertex and intersect elsewhere
  std::int64_t edge_sharing = 0;    ///< pairs that share an edge and fold onto one another (coplanar overlap)
  Places places;
};

struct Distances {
  double max = 0.0, mean = 0.0, rms = 0.0;  ///< world units, over the samples
  Eigen::Vector3d worst = Eigen::Vector3d::Zero();
  std::int64_t samples = 0;
};

/// Angles between the normals of two surfaces, in degrees, over samples of the first.
struct NormalAngles {
  double mean = 0.0, rms = 0.0, max = 0.0;
  std::int64_t samples = 0;
};

/// A certified bracket, lower ≤ true one-sided Hausdorff distance ≤ upper, in world units.
struct HausdorffBound {
  double lower = 0.0, upper = 0.0;
};

struct FeatureDistances {
  std::int64_t edges = 0, corners = 0;     ///< sharp edges and corners found on the reference
  std::int64_t edges_excluded = 0;         ///< edges over the dihedral angle that are part of a smooth blend
  double edge_length = 0.0;                ///< length of the edges that count, world units
  Distances edge_to_mesh, corner_to_mesh;  ///< from the reference's features to the mesh
};

/// A volume or an area found by sampling, with the ends of its interval (solid_comparison.h).
struct Estimate {
  double value = 0.0, lower = 0.0, upper = 0.0;
};

/// A mesh's solid compared with that of a reference, in world units.
struct SolidComparison {
  enum class Verdict { same, differs, unknown };
  Verdict verdict = Verdict::unknown;
  Estimate mesh_volume, reference_volume;  ///< volumes that are certainly inside
  Estimate difference;      ///< volume of the symmetric difference; the upper end includes `unknown_volume`
  Estimate unknown_volume;  ///< volume that is neither certainly inside nor certainly outside
  Estimate unexplained;     ///< the part of `difference` beyond `explained` from either boundary
  double mesh_area = 0.0, reference_area = 0.0;  ///< of the mesh and of the reference's boundary
  double possible_area = 0.0;  ///< of the reference's polygons that bound it by one rule but not by another
  std::int64_t mesh_components = 0, reference_components = 0;  ///< components of these two surfaces
  Estimate false_area, lost_area;  ///< area of the mesh, of the reference, beyond `explained` from the other
  double explained = 0.0;          ///< the distance that discretisation explains
  std::int64_t samples = 0;
  std::optional<Eigen::Vector3d> false_place, lost_place, unexplained_place;  ///< first sample of each kind
  bool reference_closed = true, reference_oriented = true;
};

/// Returns "same", "differs" or "unknown".
inline std::string verdict_word(const SolidComparison& solid) {
  using Verdict = SolidComparison::Verdict;
  return solid.verdict == Verdict::same ? "same" : solid.verdict == Verdict::differs ? "differs" : "unknown";
}

/// The visible surface of a model that is missing from a mesh (visible_loss.h): shares with 95 % intervals.
struct VisibleLoss {
  Estimate lost, vanished, filled;  ///< of the visible area of the model; lost = vanished + filled
  Estimate invented;                ///< of the mesh's area
  double visible_area = 0.0, invented_area = 0.0;        ///< world units²
  std::optional<Eigen::Vector3d> place, invented_place;  ///< first vanished, first invented sample
  std::int64_t samples = 0;                              ///< on each surface
};

struct MeshReport {
  // Counts over the unmodified polygons.
  std::int64_t points = 0, triangles = 0, quads = 0;
  std::int64_t boundary_edges = 0, non_manifold_edges = 0, non_manifold_vertices = 0, inconsistent_edges = 0;
  std::int64_t degenerate_polygons = 0, duplicate_polygons = 0, isolated_points = 0;
  std::int64_t components = 0, euler_characteristic = 0;
  std::optional<double> genus;  ///< sum over components; only of a closed, manifold, oriented mesh
  /// Components with negative volume that are not cavities of others (count_inside_out()); only of a closed,
  /// oriented mesh with polygons.
  std::optional<std::int64_t> inside_out_components;
  double volume = 0.0, area = 0.0;
  double smallest_angle = 0.0;  ///< degrees; the least of all triangles
  double worst_aspect = 0.0;  ///< longest edge over twice the inradius·√3: 1 for the equilateral triangle
  Places boundary_places, non_manifold_edge_places, non_manifold_vertex_places, inconsistent_places,
      degenerate_places, duplicate_places, inside_out_places;

  std::vector<LibraryCounts> libraries;
  std::optional<SelfIntersections> self_intersections;  ///< absent if not requested
  std::optional<Distances> to_reference, from_reference;
  std::optional<NormalAngles> normals_to_reference;
  std::optional<HausdorffBound> certified_to_reference, certified_from_reference;
  std::optional<FeatureDistances> features;
  std::optional<SolidComparison> solid;
  std::optional<VisibleLoss> visible;  ///< absent if no voxel size is known

  bool closed() const { return boundary_edges == 0; }
  bool manifold() const { return non_manifold_edges == 0 && non_manifold_vertices == 0; }
  bool oriented() const { return inconsistent_edges == 0; }
  /// Returns true if no component is inside out, or if that is unknown.
  bool faces_outwards() const { return inside_out_components.value_or(0) == 0; }
  /// Returns true if the mesh is closed, manifold, oriented, free of self-intersections and nowhere inside
  /// out; false if self-intersections were not searched for.
  bool watertight() const {
    return closed() && manifold() && oriented() && faces_outwards() && self_intersections &&
           self_intersections->pairs == 0;
  }
  bool libraries_agree() const {
    for (const LibraryCounts& l : libraries)
      if (!l.disagreements.empty()) return false;
    return true;
  }
  std::vector<std::string> sentences() const;  ///< returns the verdict in words, most important first
};

struct CheckOptions {
  bool self_intersections = true;
  bool libraries = true;                ///< counts by OpenMesh and CGAL, too
  const MeshFile* reference = nullptr;  ///< the mesh that distances are measured to
  /// How the reference's quads are cut: as_given for a mesh with guarantees that depend on the given
  /// diagonals, such as an extractor's uniform mesh.
  QuadRule reference_quads = QuadRule::better;
  std::int64_t samples = 200'000;         ///< on each surface, by area, in addition to all its vertices
  bool certify = false;                   ///< certified Hausdorff bound in both directions
  std::int64_t solid_samples = 100'000;   ///< for comparing the solids; 0: no comparison
  std::int64_t visible_samples = 20'000;  ///< for the visible loss, if `voxel_size` is known; 0: not measured
  double voxel_size = 0.0;   ///< world units, of the volume that the mesh was made from; 0 = unknown
  double certify_gap = 0.0;  ///< world units; 0 = 1e-4 of the reference's diagonal
  const MeshFile* features = nullptr;  ///< reference for the sharp features
  double dihedral_degrees = 30.0;
};

/// Validates a mesh without modifying it. The report is the same at any thread count, and has no distances
/// and no features if the mesh has no polygons. Meshes with coordinates beyond 2^±150 are validated at
/// another scale; values beyond the range of double precision become infinite, or NaN instead of 0.
/// @throws Cancelled; Error if a reference has no polygons, a point is not finite, a polygon refers to a
/// missing point, or coordinates span too many orders of magnitude.
MeshReport check_mesh(const MeshFile& mesh, const CheckOptions& options, RunContext& context);

}  // namespace hermesh::validation
