// Do the books of a fracture balance? A judge of pieces as their files hold them, whoever broke what.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/io/mesh_file.h"
#include "algorithms/core/run_context.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

/// What the volumes are compared with, as far as it is known.
struct ExpectedVolumes {
  std::optional<double> whole;  ///< of the uncut object's mesh
  std::vector<double> pieces;   ///< of each piece, as it was recorded; empty if nothing was
};

struct FractureLedger {
  std::int64_t pieces = 0, triangles = 0;
  /// Of several pieces, that the tags tell what was cut, or that there is no need to know: each triangle is
  /// matched, or the pieces are so far apart that no two of them were one, or nothing was cut and nothing of
  /// the whole is missing.
  bool gaps_can_be_judged = true;

  // Triangles with the same three points, compared exactly, in any order.
  std::int64_t seam_triangles = 0;  ///< of a piece, reversed in exactly one other piece and nowhere else
  std::int64_t unmatched_cut =
      0;  ///< said to be cut by the attribute `surface`, but in no other piece reversed
  std::int64_t matched_original = 0;    ///< said to be original, but a seam
  std::int64_t repeated_triangles = 0;  ///< that stand in three places or more, or twice the same way round

  /// The triangles said to be original, of all pieces together; where nothing is said, those that are no
  /// seam. They are closed if they pass along each edge as often one way as the other.
  std::int64_t rest_triangles = 0, rest_open_edges = 0;
  double rest_volume = 0.0, pieces_volume = 0.0;

  std::int64_t intersecting_pairs = 0;  ///< of triangles of all pieces, each seam taken once
  std::int64_t nested_components = 0;   ///< of a piece, inside another piece
  std::int64_t broken_pieces = 0;       ///< not closed, manifold, oriented or intersecting themselves
  std::vector<std::string> places;      ///< a sentence for the first offenders of each kind

  /// By how much the pieces' volumes sum to more than what was expected of the whole, relative to that. Cells
  /// along the cuts place their points anew, so it is not exactly 0.
  std::optional<double> expected_difference;
  std::int64_t wrong_records = 0;  ///< pieces whose volume is not the recorded one, or without a record

  double volume_difference() const;  ///< between the two volumes, relative to the greater one's size
  bool lost_a_piece() const;         ///< too much of the expected volume is missing, or there is too much
  /// Of the pieces by themselves: what thin parts lose beside cuts is no fault of their surfaces.
  bool is_consistent() const {
    return pieces > 0 && gaps_can_be_judged && unmatched_cut == 0 && matched_original == 0 &&
           repeated_triangles == 0 && rest_open_edges == 0 && intersecting_pairs == 0 &&
           nested_components == 0 && broken_pieces == 0 && volume_difference() <= 1e-9 &&
           wrong_records == 0;
  }
  bool balances() const { return is_consistent() && !lost_a_piece(); }
  std::vector<std::string> sentences() const;  ///< what does not balance, or that all of it does
};

/// Quads count as their two triangles. Pieces without the polygon attribute `surface` are judged without it:
/// then unmatched_cut and matched_original stay 0, and gaps cannot be judged. Neighbourhood goes by exactly
/// equal coordinates across the pieces.
/// @throws Cancelled; Error for a piece that judge() refuses.
FractureLedger judge_fracture(const std::vector<MeshFile>& pieces, RunContext& context,
                              const ExpectedVolumes& expected = {});

}  // namespace hermesh::validation
