// §7.1 of the thesis as printed: "processed in turn".
//
// For each cutter: convert it into a Hermite grid; intersect it with what is left of the object, and mesh the
// result by the adaptive surface extraction of chapter 6; subtract it from what is left. What is left at the
// end is the last piece.
//
// By default this is the print from end to end: Hermite grids of 10 bytes (§4.2), eq. 7.1 on their codes
// (dense_combine.h), and pieces meshed as they are packed. `Rule::repaired` puts the rule of signs of
// boolean_rule.h and exact data in their place, and nothing else.
//
// Both sides of a cut have the same crossings on the same edges. But along a rim a cell holds, for each
// piece, other crossings (the original surface's on one side of the cut only, those of a later cutter in one
// piece only), so that the pieces' points differ there, and the volumes do not add up. Eq. 7.1 leaves data
// between samples of one sign where a cut runs beside the surface, and the whole wall where two cutters share
// one (trap T11); these become polygons that bound nothing. 10 bytes lose some data (trap T2), which leaves
// holes. fracture.h has the method that repairs all of it.
//
// Where the text leaves a gap (paper/readings.md, R33 to R37):
//   - Planes and Voronoi cells are made into solids code by code, each cut off by a box around the object. As
//   the cutters
//     are there as functions, their "conversion" samples these; that of a mesh packs its Hermite data.
//   - The difference is the intersection with the complement; a component without data is infinite
//   (dense_combine.h).
//   - "Replace the original grid with the result": what is left when all cutters are through is a piece, too.
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

/// Makes the part of space with that code into a solid, cut off by a box two blocks around the object, where
/// the object is not.
/// @throws Cancelled
FloatHermite solid_of_code(const FloatHermite& object, const Cutters& cutters, CutCode code,
                           RunContext& context);

/// The codes that samples of the object have, ascending.
/// @throws Cancelled
std::vector<CutCode> codes_within(const FloatHermite& object, const Cutters& cutters, RunContext& context);

/// What decides about the pieces.
struct ThesisFractureOptions {
  /// How grids are combined, and of what.
  enum class Rule {
    printed,  ///< 10-byte voxels by eq. 7.1: the lesser or greater of each component
    repaired  ///< exact data by the rule of signs: an edge has data if and only if its ends differ in sign
  };
  Rule rule = Rule::printed;
  /// Bound of E that adaptive_dual_contouring.h has, in square voxels; at 0 no cells are merged.
  double threshold = 0.0;
};

/// Breaks the object along the cutters. Each piece is handed over as it is made, and what no cutter takes in
/// the end. Figures of the run, summed over the pieces: `lost_crossings`, `needless_crossings` and `escaped`
/// of adaptive_dual_contouring.h; a note says how many data are lost and needless, if any are.
/// @throws Cancelled
void thesis_fracture(const FloatHermite& object, const Cutters& cutters, const ThesisFractureOptions& options,
                     const std::function<void(ThesisPiece&&)>& hand_over, RunContext& context);

}  // namespace hermesh
