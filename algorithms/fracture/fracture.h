// Fracture: a solid into disjoint pieces (Aldén 2011, chapter 7).
//
//   labelled   every sample of the Hermite grid gets the number of its piece, and all pieces are meshed
//              together, so that a seam is one surface with two sides (labelled_mesh.h). Ours, the default.
//   thesis     §7.1 as printed (thesis_fracture.h): cutters one after another, each piece meshed by itself.
//              Its gaps are measured, not repaired.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/fracture/cutters.h"
#include "algorithms/fracture/label_components.h"
#include "algorithms/fracture/label_repair.h"
#include "algorithms/fracture/labelled_mesh.h"

namespace hermesh {

/// What became of a cutter.
struct CutterRecord {
  enum class State {
    cuts,      ///< some piece ends at it
    takes,     ///< it holds whole parts of the object and its surface meets none
    swallows,  ///< it holds all of the object
    covered,   ///< the cutters before it took all that it holds
    touches,   ///< it holds nothing of the object, but samples next to it
    misses,
    merged,  ///< its pieces were slivers, and neighbours have them
    empty    ///< it holds no sample at all
  };
  std::string name;
  State state = State::misses;
  std::uint64_t samples = 0;  ///< of the object, of the code with the cutter's number; 0 for planes
  std::uint64_t edges = 0;    ///< lattice edges that it cuts
};
const char* to_string(CutterRecord::State state);
/// "cuts the object", "misses the object", …: for a sentence that begins with the cutter's name.
const char* in_words(CutterRecord::State state);

struct FractureOptions {
  DualContouringOptions placement;
  double tolerance = 0.0;            ///< voxels; above 0 points are merged within seams (joint_decimation.h)
  bool split = true;                 ///< pieces that fall apart become several
  std::uint64_t least_samples = 27;  ///< smaller ones join a neighbour; a cube of 3 voxels. 0 keeps all
};

/// A sliver that was given to a neighbour: codes as the cutters give them, and what they call them.
struct MergedPiece {
  CutCode code = 0, into_code = 0;
  std::string name, into_name;
  std::uint64_t samples = 0;
};

/// A solid in pieces, as labels and as one mesh of all.
struct LabelledFracture {
  JointMesh mesh;
  std::unique_ptr<PieceTriangles> pieces;
  std::vector<std::string> names;      ///< by piece, [0] unused: what the cutters call it
  std::vector<std::uint64_t> samples;  ///< by piece
  std::vector<CutCode> codes;          ///< by piece: that of the cutters
  std::vector<CutterRecord> cutters;
  std::vector<MergedPiece> merged;
  std::uint64_t split_off = 0;
  std::uint64_t small_kept = 0;  ///< pieces that stayed below the least number of samples
  RepairReport repair;
  /// Cells that are to have one sheet because polygons at or beside them met others.
  std::uint64_t met_joints = 0;
  std::uint64_t made_up_crossings = 0, cut_edges = 0;
  std::size_t grid_bytes = 0;  ///< labels, codes and crossings

  std::uint32_t piece_count() const { return pieces ? pieces->count() : 0; }
};

/// @throws Error for an object without a sample inside, or one that has no end; Cancelled.
LabelledFracture labelled_fracture(const FloatHermite& object, const Cutters& cutters,
                                   const FractureOptions& options, RunContext& context);

}  // namespace hermesh
