// How the surfaces between pieces, and that of the whole, pass through one cell, by the labels of its
// corners: the generalisation of extraction/embedded_mesh/cell_sheets.h to more than two sides.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/extraction/embedded_mesh/cell_sheets.h"

namespace hermesh {

/// The labels of a cell's corners, numbered as in cell_sheets.h; 0 is the outside.
using CornerLabels = std::array<std::uint32_t, 8>;

/// Returns true if an edge of the cell has its ends in two pieces, so the cell is a joint.
bool has_cut(const CornerLabels& labels);

/// A *sheet* of a joint is a set of crossings of its edges, connected by the lines that the surfaces draw on
/// the cell's faces:
///   two crossings    the segment between them
///   three            three labels meet: a star, which joins all of them
///   four             a star if all labels differ. Otherwise two opposite corners are alike and the face is
///                    *ambiguous*: these corners are connected and the other two are cut off one by one. If
///                    the other two are alike, too, and one of the labels is the outside, the inside
///                    corners are cut off (as in cell_sheets.h); if both are pieces, the corners 00 and 11
///                    of the face.
/// None of this depends on the order of the labels or on which of its two cells the face is seen from.
struct JointSheets {
  CellSheets sheets;  ///< `partner` describes segments only: kNone on stars
  /// True if the part of each sheet that bounds a label, the outside included, is a single loop on the cell's
  /// boundary: then the polygons of a piece around the sheet's vertex form one fan.
  bool single_loops = true;
  /// A bit for each face, set if the face is ambiguous and both its segments belong to one sheet.
  std::uint8_t pinched = 0;

  /// Returns true if one vertex is sufficient for the cell, as for most joints, and its segments need not be
  /// recorded.
  bool is_plain() const { return sheets.sheets <= 1 && sheets.ambiguous_faces == 0; }
};
/// Returns the sheets of a cell with these labels at its corners.
JointSheets joint_sheets(const CornerLabels& labels);

}  // namespace hermesh
