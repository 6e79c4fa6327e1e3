// hermesh::validation: validation of meshes. Its library links CGAL's packages under the GPL, so programs
// that link it are under GPL-3; the other libraries are under Apache-2.0.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hermesh/mesh.h"

namespace hermesh::HERMESH_V1 {

/// Options of validate(), as of `hermesh validate`.
struct ValidateOptions {
  const Mesh* reference = nullptr;  ///< mesh for the distances and the comparison of the solids
  const Mesh* features = nullptr;   ///< mesh whose sharp edges and corners the mesh should reproduce
  bool self_intersections = true;   ///< true to search for them
  bool libraries = true;            ///< true to let OpenMesh and CGAL count, too
  bool certify = false;             ///< true to certify bounds of the Hausdorff distances to the reference
  std::int64_t samples = 200'000;   ///< on each surface for the distances
  double dihedral = 30.0;           ///< least angle of a sharp edge, degrees
  double voxel_size = 0.0;          ///< world units, of the volume that the mesh was made from; 0: unknown
};

/// Distances from samples of one surface to another, world units.
struct SurfaceDistances {
  double max = 0.0, mean = 0.0, rms = 0.0;
  std::array<double, 3> worst = {0, 0, 0};  ///< the position of the greatest
};

/// A certified bracket of a one-sided Hausdorff distance, world units.
struct HausdorffBracket {
  double lower = 0.0, upper = 0.0;
};

/// Position of a defect, and its polygons (triangles first, then quads); the second is −1 if there is only
/// one.
struct DefectPlace {
  std::array<double, 3> point = {0, 0, 0};
  std::array<std::int64_t, 2> polygons = {-1, -1};
};

/// A kind of defect, with the positions of the first ten.
struct Defect {
  std::string name = {};  ///< boundary_edges, non_manifold_edges, ..., self_intersecting_pairs
  std::int64_t count = 0;
  std::vector<DefectPlace> places = {};
};

/// The validation report of a mesh.
struct Report {
  std::int64_t points = 0, triangles = 0, quads = 0;
  std::int64_t boundary_edges = 0, non_manifold_edges = 0, non_manifold_vertices = 0, inconsistent_edges = 0;
  std::int64_t degenerate_polygons = 0, duplicate_polygons = 0, isolated_points = 0;
  std::int64_t components = 0, euler_characteristic = 0;
  std::optional<double> genus = {};                          ///< of a closed, manifold, oriented mesh
  std::optional<std::int64_t> self_intersecting_pairs = {};  ///< none without a search
  double volume = 0.0, area = 0.0;                           ///< world units
  double smallest_angle = 0.0;                               ///< degrees
  double worst_aspect = 0.0;                                 ///< 1 for the equilateral triangle
  std::optional<SurfaceDistances> to_reference = {}, from_reference = {};
  std::optional<HausdorffBracket> certified_to_reference = {}, certified_from_reference = {};
  std::optional<std::string> solid = {};    ///< compared with the reference's: "same", "differs" or "unknown"
  std::vector<Defect> defects = {};         ///< only kinds that occur
  std::vector<std::string> sentences = {};  ///< the verdict, most important first
  /// The report with more values as a JSON object, as `hermesh validate --json` prints it except for the
  /// file's name.
  std::string json = {};

  bool closed() const { return boundary_edges == 0; }
  bool manifold() const { return non_manifold_edges == 0 && non_manifold_vertices == 0; }
  bool oriented() const { return inconsistent_edges == 0; }
  /// Returns true if an outermost component is inside out; false for a mesh that is not closed or not
  /// oriented.
  bool inside_out() const {
    for (const Defect& defect : defects)
      if (defect.name == "inside_out_components") return true;
    return false;
  }
  /// Returns true if the mesh is closed, manifold, oriented, nowhere inside out and free of
  /// self-intersections; false without a search for these.
  bool watertight() const {
    return closed() && manifold() && oriented() && !inside_out() && self_intersecting_pairs == 0;
  }
};

/// Validates a mesh. The report depends only on the input, at any number of threads.
/// @throws Error for options without effect, and a reference without polygons; Cancelled.
HERMESH_API Report validate(const Mesh& mesh, const ValidateOptions& options, Context& context);

/// The validation report of a fracture.
struct FractureReport {
  bool consistent = false;  ///< true if each piece is valid, and all fit without gap or overlap
  std::int64_t pieces = 0, triangles = 0, seam_triangles = 0, unmatched_cut = 0, intersecting_pairs = 0,
               broken_pieces = 0;
  double pieces_volume = 0.0;               ///< world units
  std::vector<std::string> sentences = {};  ///< states the inconsistencies, or their absence
};

/// Validates all pieces of a fracture together. @throws Error for a piece without polygons; Cancelled.
HERMESH_API FractureReport validate_fracture(const std::vector<Mesh>& pieces, Context& context);

}  // namespace hermesh::HERMESH_V1
