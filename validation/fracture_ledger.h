// Do the books of a fracture balance? A judge of pieces as their files hold them, whoever broke what.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/run_context.h"
#include "algorithms/io/mesh_file.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

/// What the pieces are compared with, as far as it is known (world units).
struct ExpectedVolumes {
  std::optional<double> whole;        ///< volume of the uncut object's mesh
  std::vector<double> pieces;         ///< recorded volume of each piece; empty if there are no records
  const MeshFile* surface = nullptr;  ///< the uncut object's mesh
  double reach =
      0.0;  ///< how far the original surface of a piece may be from `surface`; 0 if that is not known
};

/// What was found about all pieces of a fracture together.
struct FractureLedger {
  std::int64_t pieces = 0, triangles = 0;
  /// Whether gaps between several pieces would show: the tags tell what was cut, or there is no need to know,
  /// because each triangle is matched, or the pieces are so far apart that no two of them were one, or
  /// nothing was cut: nothing of the whole is missing, or all of the pieces' surface is near the whole's, in
  /// which the walls of a gap are not.
  bool gaps_can_be_judged = true;

  // Triangles with the same three points, compared exactly, in any order.
  std::int64_t seam_triangles = 0;  ///< triangles of a piece that are in exactly one other piece, reversed
  std::int64_t unmatched_cut =
      0;  ///< triangles that the attribute `surface` calls cut, but that no other piece has reversed
  std::int64_t matched_original = 0;    ///< seam triangles that the attribute `surface` calls original
  std::int64_t repeated_triangles = 0;  ///< triangles that are there three times, or twice the same way round

  /// The *rest* is the triangles that the tags call original, of all pieces together; of untagged pieces
  /// those that are no seam. It is closed if its triangles pass along each edge as often one way as the
  /// other.
  std::int64_t rest_triangles = 0, rest_open_edges = 0;
  double rest_volume = 0.0, pieces_volume = 0.0;

  std::int64_t intersecting_pairs = 0;  ///< pairs of triangles of all pieces, each seam taken once
  std::int64_t nested_components = 0;   ///< components of a piece that lie inside another piece
  std::int64_t broken_pieces = 0;       ///< pieces not closed, manifold, oriented, or that meet themselves
  std::vector<std::string> places;      ///< a sentence for the first offenders of each kind

  /// The sum of the pieces' volumes less the expected volume of the whole, relative to the latter. Cells
  /// along the cuts place their points anew, so it is not exactly 0.
  std::optional<double> expected_difference;
  std::int64_t wrong_records = 0;  ///< pieces without a record, or whose volume is not the recorded one

  double volume_difference() const;  ///< of rest_volume and pieces_volume, relative to the greater one's size
  bool lost_a_piece() const;         ///< whether the pieces' volume is far from the expected one
  /// Whether the pieces fit one another. The whole's expected volume is left aside: what thin parts lose
  /// beside cuts is no fault of the pieces' surfaces.
  bool is_consistent() const {
    return pieces > 0 && gaps_can_be_judged && unmatched_cut == 0 && matched_original == 0 &&
           repeated_triangles == 0 && rest_open_edges == 0 && intersecting_pairs == 0 &&
           nested_components == 0 && broken_pieces == 0 && volume_difference() <= 1e-9 && wrong_records == 0;
  }
  bool balances() const { return is_consistent() && !lost_a_piece(); }
  std::vector<std::string> sentences() const;  ///< what does not balance, in words, or that all does
};

/// Judges all pieces of a fracture together. Quads count as their two triangles. Pieces without the polygon
/// attribute `surface` are judged without it: then unmatched_cut and matched_original stay 0, and gaps cannot
/// be judged. Points of all pieces are the same if their coordinates are exactly equal.
/// @throws Cancelled; Error for a piece that judge() refuses.
FractureLedger judge_fracture(const std::vector<MeshFile>& pieces, RunContext& context,
                              const ExpectedVolumes& expected = {});

}  // namespace hermesh::validation
