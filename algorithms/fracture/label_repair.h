// Changes few labels so that the joint mesh of all pieces is manifold piece by piece.
//
// A lattice edge whose ends are in two different pieces is a *cut*; a cell with a cut is a *joint* and gets a
// point for each of its sheets (label_sheets.h). A cell is **simple** if it has no cut (then the sheets of
// cell_sheets.h serve it), or if
//   - each sheet bounds each label, the outside included, in a single loop;
//   - it shares no face with another joint that is pinched in both, that is, ambiguous with both segments
//     in one sheet on either side;
//   - it has one sheet, if that is asked of it (LabelledSolid::one_sheet).
//
// **Why this makes each piece closed and manifold.** A piece is bounded by the polygons of the lattice edges
// of which one end is in it. Two of its polygons share the segment between the points of two cells if they
// belong to two such edges of the cells' common face. A face has none, two or four of them. If four, the face
// is ambiguous, and its two segments end in different points of one of the two cells, or the polygons are
// held to them (uniform_mesh.h, sheet_trials.h): one of the two cells has no cut then. So every segment has
// two polygons of the piece. The polygons around a joint's point are those of the piece's loop in that sheet,
// of which there is one: a single fan. Those around another point belong to the one loop of its sheet, all of
// whose inside corners hang together by edges of the cell, and so are of one piece.
//
// A wall that meets the original surface at a small angle passes, beside it, through cells that the surface
// passes through, too, without meeting it there. Such a cell has two sheets, and no label needs to change.
//
// **Why it ends.** Only inside samples change, so the surface of the whole stays what it is. First, a change
// is made only if it leaves fewer cells that are not simple, a number that cannot fall for ever. What is
// still not simple then, is changed only towards lower labels: if nothing better is found, each part of a
// cell's inside corners that hangs together gets the lowest of its labels, after which the cell has no cut. A
// cell that is not simple has a cut, so such a part has two labels and some label becomes lower; the sum of
// all labels cannot fall for ever either.
#pragma once

#include <cstdint>

#include "algorithms/core/run_context.h"
#include "algorithms/fracture/label_sheets.h"
#include "algorithms/fracture/labelled_solid.h"

namespace hermesh {

/// Of a cell that begins in one of the solid's blocks.
CornerLabels corner_labels(const LabelledSolid& solid, const LabelledSolid::Place& cell);
bool is_simple(const LabelledSolid& solid, const LabelledSolid::Place& cell);

struct RepairReport {
  std::uint64_t cells = 0;  ///< that were not simple
  std::uint64_t changed_samples = 0;
  std::uint64_t forced_changes =
      0;  ///< made towards lower labels, because no other change was an improvement
};

/// Cells are visited in the order of their place, one after the other: the same result at any thread count.
RepairReport repair_labels(LabelledSolid& solid, RunContext& context);

}  // namespace hermesh
