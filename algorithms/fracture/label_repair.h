// Changes few labels so that the joint mesh of all pieces is manifold piece by piece.
//
// A lattice edge whose ends are in two different pieces is a *cut*; a cell with a cut is a *joint* and gets a
// vertex for each of its sheets (label_sheets.h). A cell is **simple** if it has no cut, or if all of the
// following hold:
//   - each sheet bounds each label, the outside included, in at most one loop;
//   - no face between it and another joint is pinched, i.e. ambiguous with both its segments in one sheet in
//     each of the two cells;
//   - it has one sheet, if LabelledSolid::one_sheet requires it.
//
// **Conditions on labels and sheets.** A piece is bounded by the polygons of the lattice edges that have
// exactly one end in it. It is closed and manifold if all of the following hold:
//   1. The two cells next to a face draw the same lines on it. None, two or four of the face's edges bound
//      the piece. Two such edges are connected by the lines; four are paired by two segments.
//   2. Where four edges bound the piece, the two segments belong to different sheets in at least one of the
//      two cells, or the polygons are constrained to the segments (uniform_mesh.h, tested_polygons.h).
//   3. Each sheet of a cell bounds the piece in at most one loop.
// Two polygons of the piece share the segment between the vertices of two cells if their two edges lie in the
// common face of these cells and bound the piece. By 1 and 2 each such segment has exactly two such polygons,
// so the piece is closed. By 3 the polygons around a vertex form one fan. A polygon between two pieces
// belongs to both, with opposite orientations; every other polygon faces the outside and belongs to one
// piece. In the sum over all pieces the seams therefore cancel: the contact areas agree, and the remaining
// polygons form a closed surface whose volume is the sum of the volumes of the pieces. The proof that no two
// polygons intersect does not depend on the labels on their sides (uniform_mesh.h).
//
// **Why simple cells satisfy the conditions.** 1: A face with a cut lies between two joints, which both draw
// the lines that label_sheets.h defines for the face's labels. A face without a cut is drawn as in Hermite
// data; where it is ambiguous and next to a joint, its inside corners are cut off in both cells.
//   Joints: 2 and 3 follow from the definition of a simple cell; where the cell beyond the face is not a
//   joint, its polygons can be constrained to the face's segments.
//   A cell without a cut has the loops of cell_sheets.h. Inside corners that edges connect belong to one
//   piece. But a loop encloses the corners that are connected by edges *and across ambiguous faces whose
//   inside is joined*, depending on the normals. The two corners of such a face may belong to two pieces with
//   no cut nearby: a thin plate oblique to the lattice contains samples that are neighbours across faces
//   only. One loop would then bound both pieces, and each of them would be open. So only faces whose inside
//   corners belong to one piece are joined (CellGrid::is_of_one_piece), and pieces separate at the others,
//   with a gap of less than a voxel instead of a seam. Now each loop bounds one piece, which is 3; and 2
//   cannot fail at a face between two pieces, because its segments belong to two loops. At other faces
//   without a joint cell_blocks.h ensures 2.
//
// Where the surface between two pieces meets the original surface at a small angle, both pass through the
// same cells near their intersection line without intersecting in these cells. Such a cell has two sheets,
// and no label needs to change.
//
// **Termination.** Only labels of inside samples change, and none becomes 0, so the surface of the whole
// solid is unchanged. First, a change is made only if it reduces the number of cells that are not simple,
// which cannot decrease for ever. Cells that are still not simple afterwards are changed only towards lower
// labels: if no such change makes a cell simple, each of its sets of inside corners that edges of the cell
// connect gets the lowest of its labels, after which the cell has no cut. A cell that is not simple has a
// cut, so such a set has two labels and some label becomes lower; the sum of all labels cannot decrease for
// ever either.
//   Label maps need two more phases before these, which leave samples away from the boundary between
// codes unchanged, i.e. those whose six neighbours have their code: a vertex next to such a sample would be
// more than half a voxel away from that boundary. The two phases are like the others, except that they try
// any set of the inside corners of a cell, the smallest first, and that the second leaves a cell unchanged
// if no change makes it simple. They end for the same reasons: the first reduces the number of cells that
// are not simple, and each change of the second lowers a label and raises none. The remaining cells are
// those with which the other two phases begin, after which every cell is simple as before.
#pragma once

#include <cstdint>

#include "algorithms/core/run_context.h"
#include "algorithms/fracture/label_sheets.h"
#include "algorithms/fracture/labelled_solid.h"

namespace hermesh {

/// Returns the labels of the corners of a cell whose first corner lies in one of the solid's blocks. Corners
/// that no block holds have label 0.
CornerLabels corner_labels(const LabelledSolid& solid, const LabelledSolid::Place& cell);
/// Returns true if a cell, whose first corner lies in one of the solid's blocks, is simple as defined above.
bool is_simple(const LabelledSolid& solid, const LabelledSolid::Place& cell);

struct RepairReport {
  std::uint64_t cells = 0;            ///< cells that were not simple before the repair
  std::uint64_t changed_samples = 0;  ///< samples whose label is another one after it
  /// How often a phase that lowers labels ("Termination") changed a cell; a cell may count several times.
  std::uint64_t forced_changes = 0;
};

/// Changes labels of inside samples until every cell is simple. Each round visits cells in ascending order of
/// block and sample, the first round all that are not simple and the next ones those around changed samples.
/// One thread makes the changes, so the result is the same at any thread count. A piece may lose all its
/// samples or fall apart (label_components.h). With `near_boundary`, a sample whose six neighbours have its
/// code gets the label of another code only where the cells cannot be made simple without that.
/// @throws Cancelled.
RepairReport repair_labels(LabelledSolid& solid, RunContext& context, bool near_boundary = false);

}  // namespace hermesh
