// §7.1 of the thesis as printed: "processed in turn".
//
// For each cutter: convert it into a Hermite grid; intersect it with the rest of the object, and mesh the
// result by the adaptive surface extraction of chapter 6; subtract it from the rest. The final rest is the
// last piece.
//
// The default is the print from end to end: Hermite grids of 10 bytes (§4.2), eq. 7.1 on their codes
// (combine() of dense_hermite.h), and pieces meshed as they are packed. `Rule::repaired` replaces them by the
// rule of signs of boolean_rule.h and exact data, and nothing else.
//
// Both sides of a cut have the same crossings on the same edges. But along a boundary a cell holds, for each
// piece, other crossings (the original surface's on one side of the cut only, those of a later cutter in one
// piece only), so the pieces' points differ there, and the volumes do not add up. Eq. 7.1 leaves data between
// samples of one sign where a cut runs close to the surface, and the whole wall where two cutters share one
// (trap T11); these become polygons that bound nothing. 10 bytes lose some data (trap T2), which leaves
// holes. fracture.h has the method that repairs all of it.
//
// Readings of gaps in the text (paper/readings.md, R33 to R37):
//   - Planes and Voronoi cells are made into solids code by code, each closed by a box around the object. As
//     the cutters are functions, their "conversion" samples these; that of a mesh packs its Hermite data.
//   - The difference is the intersection with the complement; a component without data is infinite
//     (dense_hermite.h).
//   - "Replace the original grid with the result": the rest after all cutters is a piece, too.
#pragma once

#include <functional>
#include <string>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/fracture/cutters.h"

namespace hermesh {

/// A piece, and the times of its steps.
struct ThesisPiece {
  std::string name;
  PolygonMesh mesh;  ///< empty where the cutter takes nothing
  double conversion_seconds = 0.0, csg_seconds = 0.0, extraction_seconds = 0.0;
};

/// Makes the part of space with that code into a solid, closed by a box two blocks around the object, outside
/// of the object. @throws Cancelled
FloatHermite solid_of_code(const FloatHermite& object, const Cutters& cutters, CutCode code,
                           RunContext& context);

/// Returns the codes of the object's samples, ascending. @throws Cancelled
std::vector<CutCode> codes_within(const FloatHermite& object, const Cutters& cutters, RunContext& context);

/// Options of the pieces.
struct ThesisFractureOptions {
  /// Form of the grids and rule of their combination.
  enum class Rule {
    printed,  ///< 10-byte voxels by eq. 7.1: the lesser or greater of each component
    repaired  ///< exact data by the rule of signs: an edge has data if and only if its ends differ in sign
  };
  Rule rule = Rule::printed;
  /// Bound of E that adaptive_dual_contouring.h has, in square voxels; at 0 no cells are merged.
  double threshold = 0.0;
};

/// Breaks the object along the cutters. Each piece is handed over as it is made, and finally the rest.
/// Figures of the run, summed over the pieces: `lost_crossings`, `needless_crossings` and `escaped` of
/// adaptive_dual_contouring.h; a note reports lost and needless data. @throws Cancelled
void thesis_fracture(const FloatHermite& object, const Cutters& cutters, const ThesisFractureOptions& options,
                     const std::function<void(ThesisPiece&&)>& hand_over, RunContext& context);

}  // namespace hermesh
