// Changes few labels so that the joint mesh of all pieces is manifold piece by piece.
//
// A lattice edge whose ends are in two different pieces is a *cut*; a cell with a cut is a *joint* and gets a
// point for each of its sheets (label_sheets.h). A cell is **simple** if it has no cut, or if all of this
// holds:
//   - each sheet bounds each label, the outside included, in one loop at most;
//   - no face between it and another joint is pinched, that is, ambiguous with both its segments in one sheet
//   in each of the
//     two cells;
//   - it has one sheet, if that is asked of it (LabelledSolid::one_sheet).
//
// **What labels and sheets must fulfil.** A piece is bounded by the polygons of the lattice edges of which
// one end is in it. It is closed and manifold if all of this holds:
//   1. The two cells beside a face draw the same lines on it. None, two or four of the face's edges bound the
//      piece. Two hang together by the lines, four are paired by two segments.
//   2. Where four do, the two segments belong to different sheets in at least one of the two cells, or the
//   polygons are held
//      to them (uniform_mesh.h, sheet_trials.h).
//   3. Each sheet of a cell bounds the piece in one loop at most.
// Two polygons of the piece share the segment between the points of two cells if their two edges lie in the
// common face of these cells and bound the piece. By 1 and 2 each such segment has two such polygons: the
// piece is closed. By 3 those around a point are one fan. A polygon between two pieces belongs to both, with
// opposite orientation; any other faces the outside and belongs to one. So in the sum over all pieces the
// seams cancel: the areas of contact agree, and what is left is a closed surface, whose volume the volumes of
// the pieces add up to. That no two polygons meet is proved without a look at what lies on their sides
// (uniform_mesh.h).
//
// **Why simple cells fulfil it.** 1: A face with a cut lies between two joints, which draw what
// label_sheets.h says of the face's labels. A face without a cut is drawn as in Hermite data; where it is
// ambiguous and a joint lies beside it, its inside corners are cut off in both cells.
//   Joints: 2 and 3 are what makes them simple; where the cell beyond the face is no joint, its polygons can
//   be held to the
// face's segments.
//   A cell without a cut has the loops of cell_sheets.h. What hangs together of its inside corners by edges
// is of one piece. But a loop goes around what hangs together by edges *and across ambiguous faces whose
// inside is joined*, as normals may have it. The two corners of such a face may well be of two pieces without
// a cut anywhere near: a thin plate aslant in the lattice holds samples that are neighbours across faces
// only. One loop would bound both pieces then, and each of them would be open. So only faces whose inside
// corners are of one piece are joined (CellGrid::is_of_one_piece), and pieces come apart at the others, with
// a gap of less than a voxel in place of a seam. Now each loop bounds one piece, which is 3; and of 2 there
// is nothing to ask at a face between two pieces, for its segments are of two loops. At other faces without a
// joint cell_blocks.h sees to it.
//
// Where the surface between two pieces meets the original surface at a small angle, both pass through the
// same cells near the line where they meet, without meeting in them. Such a cell has two sheets, and no label
// needs to change.
//
// **Why it ends.** Only labels of inside samples change, and none becomes 0, so the surface of the whole
// stays. First, a change is made only if it leaves fewer cells that are not simple, a number that cannot fall
// for ever. What is still not simple then, is changed only towards lower labels: if no such change makes a
// cell simple, each of its sets of inside corners that edges of the cell connect gets the lowest of its
// labels, after which the cell has no cut. A cell that is not simple has a cut, so such a set has two labels
// and some label becomes lower; the sum of all labels cannot fall for ever either.
#pragma once

#include <cstdint>

#include "algorithms/core/run_context.h"
#include "algorithms/fracture/label_sheets.h"
#include "algorithms/fracture/labelled_solid.h"

namespace hermesh {

/// The labels of the corners of a cell whose first corner lies in one of the solid's blocks. Corners that no
/// block holds have label 0.
CornerLabels corner_labels(const LabelledSolid& solid, const LabelledSolid::Place& cell);
/// Whether a cell, whose first corner lies in one of the solid's blocks, is simple as said above.
bool is_simple(const LabelledSolid& solid, const LabelledSolid::Place& cell);

struct RepairReport {
  std::uint64_t cells = 0;            ///< cells that were not simple before the repair
  std::uint64_t changed_samples = 0;  ///< samples whose label is another one after it
  /// How often the second phase ("Why it ends") changed a cell, towards lower labels; a cell may count
  /// several times.
  std::uint64_t forced_changes = 0;
};

/// Changes labels of inside samples until every cell is simple. Each round visits cells in ascending order of
/// block and sample, the first round all that are not simple and the next ones those around changed samples.
/// One thread makes the changes, so the result is the same at any thread count. A piece may lose all its
/// samples or fall apart (label_components.h). @throws Cancelled.
RepairReport repair_labels(LabelledSolid& solid, RunContext& context);

}  // namespace hermesh
