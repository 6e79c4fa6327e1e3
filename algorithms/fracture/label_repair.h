// Changes few labels so that the joint mesh of all pieces is manifold piece by piece.
//
// A lattice edge whose ends are in two different pieces is a *cut*; a cell with a cut is a *joint* and gets
// one point. A cell is **simple** if it has no cut (then the sheets of cell_sheets.h serve it), or if for
// each label at its corners, the outside included, the corners of that label and the others are separated by
// a single loop and no face is ambiguous between them, that is, alternates around its four corners.
//
// **Why this makes each piece closed and manifold.** A piece is bounded by the polygons of the lattice edges
// of which one end is in it. Two of its polygons share the segment between the points of two cells if they
// belong to two such edges of the cells' common face. A face has none, two or four of them. Four is
// ambiguous: that does not happen at a joint, and between two cells without a cut the polygons are held to
// two separate segments or end in different points (uniform_mesh.h, sheet_trials.h). So every segment has two polygons of the piece. The polygons around a
// joint's point are those of the piece's loop, of which there is one: a single fan. Those around another
// point belong to the one loop of its sheet, all of whose inside corners hang together by edges of the cell,
// and so are of one piece.
//
// **Why it ends.** Only inside samples change, so the surface of the whole stays what it is. First, a change
// is made only if it leaves fewer cells that are not simple, a number that cannot fall for ever. What is
// still not simple then, is changed only towards lower labels: if nothing better is found, each part of a
// cell's inside corners that hangs together gets the lowest of its labels, after which the cell has no cut. A
// cell that is not simple has a cut, so such a part has two labels and some label becomes lower; the sum of
// all labels cannot fall for ever either.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/run_context.h"
#include "algorithms/fracture/labelled_solid.h"

namespace hermesh {

/// By corner as in cell_sheets.h.
using CornerLabels = std::array<std::uint32_t, 8>;

bool has_cut(const CornerLabels& labels);
bool is_simple(const CornerLabels& labels);

struct RepairReport {
  std::uint64_t cells = 0;  ///< that were not simple
  std::uint64_t changed_samples = 0;
  std::uint64_t forced_changes =
      0;  ///< made towards lower labels, because no other change was an improvement
};

/// Cells are visited in the order of their place, one after the other: the same result at any thread count.
RepairReport repair_labels(LabelledSolid& solid, RunContext& context);

}  // namespace hermesh
