// Fracture: a solid into disjoint pieces (Aldén 2011, chapter 7).
//
//   labelled   every sample of the Hermite grid gets the number of its piece, and all pieces are meshed
//              together, so that a seam is one surface with two sides (labelled_mesh.h). Ours, the default.
//   thesis     §7.1 as printed (thesis_fracture.h): cutters one after another, each piece meshed separately.
//              Its gaps are measured, not repaired.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/fracture/cutters.h"
#include "algorithms/fracture/label_components.h"
#include "algorithms/fracture/label_repair.h"
#include "algorithms/fracture/labelled_mesh.h"

namespace hermesh {

/// Result of one cutter.
struct CutterRecord {
  enum class State {
    cuts,      ///< it bounds some piece
    takes,     ///< it contains whole parts of the object, and its surface cuts none
    swallows,  ///< it contains the whole object
    covered,   ///< earlier cutters took everything that it contains
    touches,   ///< it contains no sample of the object, but neighbours of such samples
    misses,
    merged,  ///< its pieces were slivers that were merged into neighbours
    empty    ///< it contains no sample at all
  };
  std::string name;
  State state = State::misses;
  std::uint64_t samples = 0;  ///< the object's samples with the cutter's number as code; 0 for planes
  std::uint64_t edges = 0;    ///< lattice edges that the cutter cuts
};
/// Returns the name of the enumerator.
const char* to_string(CutterRecord::State state);
/// Returns the state as the predicate of a message that begins with the cutter's name, e.g. "cuts the
/// object".
const char* in_words(CutterRecord::State state);

struct FractureOptions {
  DualContouringOptions placement;
  /// Largest distance of vertices from the boundary between voxels, as in joint_mesh(); none: vertices may
  /// leave their cells for sharp features.
  std::optional<double> from_voxels = std::nullopt;
  double tolerance = 0.0;            ///< voxels; above 0 the mesh is made coarser (joint_decimation.h)
  bool split = true;                 ///< split disconnected pieces
  std::uint64_t least_samples = 27;  ///< merges smaller pieces into a neighbour; 27: a cube of 3³, 0: none
};

/// A sliver that was merged into a neighbour: the codes of both, and their names by the cutters.
struct MergedPiece {
  CutCode code = 0, into_code = 0;
  std::string name, into_name;
  std::uint64_t samples = 0;
};

/// A fractured solid, with one mesh of all pieces.
struct LabelledFracture {
  JointMesh mesh;
  std::unique_ptr<PieceTriangles> pieces;
  std::vector<std::string> names;      ///< the cutters' name of each piece; [0] is unused
  std::vector<std::uint64_t> samples;  ///< samples of each piece; [0] is 0
  std::vector<CutCode> codes;          ///< the cutters' code of each piece; [0] is unused
  std::vector<CutterRecord> cutters;
  std::vector<MergedPiece> merged;
  std::uint64_t split_off = 0;   ///< pieces added by splitting disconnected ones
  std::uint64_t small_kept = 0;  ///< pieces that remain below the least number of samples
  RepairReport repair;
  /// Joints that were restricted to one sheet, because polygons at or next to them intersected others
  /// (LabelledSolid::one_sheet).
  std::uint64_t met_joints = 0;
  /// `cut_edges` counts the lattice edges between two pieces; at `made_up_crossings` of them no cutter's
  /// surface passes (LabelledGrid).
  std::uint64_t made_up_crossings = 0, cut_edges = 0;
  /// Numbers of faces across which the object's mesh joins two pieces that have no seam there: faces with a
  /// gap, and faces where the pieces touch in an edge.
  std::uint64_t gaps = 0, touches = 0;
  std::size_t grid_bytes = 0;  ///< memory of labels, codes and crossings

  /// Returns the number of pieces; they are numbered from 1.
  std::uint32_t piece_count() const { return pieces ? pieces->count() : 0; }
};

/// Breaks an object along the cutters into pieces that are closed manifolds and share the triangles of their
/// seams (labelled_mesh.h). The result has the same bytes at any thread count.
/// @throws Error for an object without an inside sample, or one of infinite extent; Cancelled.
LabelledFracture labelled_fracture(const FloatHermite& object, const Cutters& cutters,
                                   const FractureOptions& options, RunContext& context);

}  // namespace hermesh
