// §7.1 of the thesis as printed: "processed in turn".
//
// For each cutter: convert it into a Hermite grid; intersect it with what is left of the object, and mesh the
// result by the adaptive surface extraction of chapter 6; subtract it from what is left. What is left at the
// end is the last piece.
//
// Both sides of a cut have the same crossings on the same edges. But along a rim a cell holds, for each
// piece, other crossings (the original surface's on one side of the cut only, those of a later cutter in one
// piece only), so that the pieces' points differ there, and the volumes do not add up. Nothing is repaired:
// fracture.h has the method that is.
#pragma once

#include <functional>
#include <string>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/fracture/cutters.h"

namespace hermesh {

/// A piece, and what it took to make it.
struct ThesisPiece {
  std::string name;
  PolygonMesh mesh;  ///< empty where the cutter takes nothing
  double conversion_seconds = 0.0, csg_seconds = 0.0, extraction_seconds = 0.0;
};

/// Makes the part of space with that code into a solid, cut off by a box two blocks around the object, where the
/// object is not.
/// @throws Cancelled
FloatHermite solid_of_code(const FloatHermite& object, const Cutters& cutters, CutCode code,
                           RunContext& context);

/// The codes that samples of the object have, ascending.
/// @throws Cancelled
std::vector<CutCode> codes_within(const FloatHermite& object, const Cutters& cutters, RunContext& context);

/// Breaks the object along the cutters. `threshold` is that of adaptive_dual_contouring.h, in square voxels; 0 meshes
/// by uniform dual contouring. Each piece is handed over as it is made, and what no cutter takes in the end.
/// @throws Cancelled
void thesis_fracture(const FloatHermite& object, const Cutters& cutters, double threshold,
                     const std::function<void(ThesisPiece&&)>& hand_over, RunContext& context);

}  // namespace hermesh
