// One fracture by one of the methods, piece by piece: shared by the command line and the experiment.
#pragma once

#include <optional>
#include <string>

#include "algorithms/core/level_set.h"
#include "algorithms/fracture/cutter_words.h"
#include "algorithms/fracture/piece_output.h"
#include "algorithms/thesis/thesis_fracture.h"

namespace hermesh {

/// A solid to break.
struct FractureObject {
  FloatHermite hermite;
  LevelSet level_set;
  const PolygonMesh* source = nullptr;  ///< whose attributes the pieces take over; null: none
};

/// Returns the object's mesh before it is broken, at tolerance 0; empty if no sample is inside. @throws
/// Cancelled.
PolygonMesh uncut_mesh(const FractureObject& object, RunContext& context);
/// Returns the volume of uncut_mesh() (cubic world units); 0 if no sample is inside. @throws Cancelled.
double uncut_volume(const FractureObject& object, RunContext& context);

struct FractureMethod {
  std::string name = "labelled";  ///< or thesis, openvdb
  /// labelled: two-sided distance to the finest mesh, in voxels; thesis: the root of
  /// adaptive_dual_contouring's threshold, in voxels, so that 0.3 is a threshold of 0.09 square voxels;
  /// openvdb: adaptivity, 0 to 1.
  double tolerance = 0.0;
  FractureOptions options;
  ThesisFractureOptions::Rule rule = ThesisFractureOptions::Rule::printed;  ///< only of the method thesis
};

struct FractureSummary {
  std::uint32_t pieces = 0;
  std::vector<CutterRecord> cutters;         ///< result of each cutter, by the method `labelled`
  std::optional<LabelledFracture> labelled;  ///< without its mesh
  std::vector<std::string> empty;            ///< names of cutters that took nothing, by the other methods
  double seconds = 0.0;  ///< time of the method itself: neither handing pieces over nor making polygons of
                         ///< OpenVDB's cutters
};

/// Returns an upper bound of the distance of the pieces' original surface from uncut_mesh(), in world units:
/// where pieces separate, vertices are recomputed within their cells. Returns 0 if the bound is not known:
/// for methods other than `labelled`, and if pieces separate with a gap instead of a seam.
double reach_of_pieces(const FractureObject& object, const FractureMethod& method,
                       const FractureSummary& summary);

/// Breaks the object by the method and hands its pieces over, one after the other.
/// @throws Error for a method that does not exist, or a tolerance that it does not take; Cancelled.
FractureSummary run_fracture(const FractureObject& object, const MadeCutters& cutters,
                             const FractureMethod& method, const HandOver& hand_over, RunContext& context);

/// Checks the method. @throws Error if run_fracture() would reject it.
void check_method(const FractureMethod& method);

}  // namespace hermesh
