// Validates all pieces of a fracture together: seams, gaps, overlaps and conservation of volume.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/run_context.h"
#include "algorithms/io/mesh_file.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

/// Known properties of the uncut object and its pieces (world units).
struct ExpectedVolumes {
  std::optional<double> whole;        ///< volume of the uncut object's mesh
  std::vector<double> pieces;         ///< recorded volume of each piece; empty if there are no records
  const MeshFile* surface = nullptr;  ///< the uncut object's mesh
  double reach = 0.0;  ///< largest distance of a piece's original surface from `surface`; 0: unknown
};

/// Findings about all pieces of a fracture together.
struct FractureReport {
  std::int64_t pieces = 0, triangles = 0;
  /// True if gaps between pieces would be detected: tags mark the cuts, or tags are unnecessary because each
  /// triangle is matched, or the pieces are so far apart that no two of them were ever one, or nothing was
  /// cut (the volume of the whole is complete, or all of the pieces' surface is near the whole's, unlike the
  /// walls of a gap).
  bool gaps_checked = true;

  // Triangles with the same three points, compared exactly, in any order.
  std::int64_t seam_triangles = 0;  ///< triangles of a piece that are in exactly one other piece, reversed
  std::int64_t unmatched_cut =
      0;  ///< triangles tagged as cut (`surface`) that are in no other piece, reversed
  std::int64_t matched_original = 0;    ///< seam triangles tagged as original
  std::int64_t repeated_triangles = 0;  ///< triangles that occur three times, or twice with the same winding

  /// The *rest* is the triangles tagged as original, of all pieces together; of untagged pieces those that
  /// are not seams. It is closed if its triangles pass along each edge as often in one direction as in the
  /// other.
  std::int64_t rest_triangles = 0, rest_open_edges = 0;
  double rest_volume = 0.0, pieces_volume = 0.0;

  std::int64_t intersecting_pairs = 0;  ///< pairs of triangles of all pieces, each seam taken once
  std::int64_t nested_components = 0;   ///< components of a piece inside another piece
  std::int64_t broken_pieces = 0;   ///< pieces not closed, manifold, oriented and free of self-intersections
  std::vector<std::string> places;  ///< a message for each of the first defects of each kind

  /// The sum of the pieces' volumes less the expected volume of the whole, relative to the latter. Not
  /// exactly 0, because the vertices of cells along the cuts are recomputed.
  std::optional<double> expected_difference;
  std::int64_t wrong_records = 0;  ///< pieces without a record, or whose volume differs from the recorded one

  /// Returns the difference of rest_volume and pieces_volume, relative to the greater one's size.
  double volume_difference() const;
  /// Returns true if the pieces' volume is far from the expected one.
  bool lost_a_piece() const;
  /// Returns true if the pieces fit one another. Ignores the whole's expected volume: losses of thin parts
  /// next to cuts are not a defect of the pieces' surfaces.
  bool is_consistent() const {
    return pieces > 0 && gaps_checked && unmatched_cut == 0 && matched_original == 0 &&
           repeated_triangles == 0 && rest_open_edges == 0 && intersecting_pairs == 0 &&
           nested_components == 0 && broken_pieces == 0 && volume_difference() <= 1e-9 && wrong_records == 0;
  }
  bool is_valid() const { return is_consistent() && !lost_a_piece(); }
  std::vector<std::string> sentences() const;  ///< returns all defects in words, or that there are none
};

/// Validates all pieces of a fracture together. Quads count as their two triangles. Pieces may lack the
/// polygon attribute `surface`: then unmatched_cut and matched_original stay 0, and gaps cannot be checked.
/// Points of all pieces are the same if their coordinates are exactly equal.
/// @throws Cancelled; Error for a piece that cannot be validated as a mesh.
FractureReport check_fracture(const std::vector<MeshFile>& pieces, RunContext& context,
                              const ExpectedVolumes& expected = {});

}  // namespace hermesh::validation
