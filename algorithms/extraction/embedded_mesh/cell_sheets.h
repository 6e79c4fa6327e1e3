// The connected components ("sheets") of the surface within one cell, from the signs of the cell's corners.
//
// Numbering used in this directory: corner c has the offsets (c & 1, c >> 1 & 1, c >> 2). Edge 4a + du + 2dv
// lies along axis a, displaced by du along axis (a+1) % 3 and by dv along axis (a+2) % 3. Face 2a + s is the
// lower (s = 0) or upper (s = 1) face across axis a.
#pragma once

#include <array>
#include <cstdint>

namespace hermesh {

/// The loops in which the surface intersects the boundary of a cell, and the sheets that they bound. On each
/// face, straight segments connect the crossings of the face's edges. A face whose corners alternate in sign
/// is ambiguous and gets two segments, which cut off its inside corners one by one. Both cells at the face
/// draw it alike. The segments of a cell thus form closed loops, and each loop bounds one sheet.
struct CellSheets {
  static constexpr std::uint8_t kNone = 255;

  std::uint8_t sheets = 0;                  ///< number of sheets, 0 to 4
  std::array<std::uint8_t, 12> sheet_of{};  ///< sheet of each edge; kNone if the edge is not crossed
  /// By face and edge: the other end of the segment in the face that starts on the edge; kNone if there is
  /// none.
  std::array<std::array<std::uint8_t, 12>, 6> partner{};
  std::uint8_t ambiguous_faces = 0;  ///< one bit per face
};

/// The sheets of a cell, by the inside bits of its corners.
///
/// **Guarantee.** A plane strictly separates the crossings of any two loops of a cell, wherever they lie in
/// the interiors of their edges; so the convex hulls of two loops are disjoint. A test covers all patterns.
extern const std::array<CellSheets, 256> kCellSheets;

/// Returns the sheets as in kCellSheets, except that ambiguous faces among `joined_faces`, one bit per face,
/// cut off their outside corners, which joins the inside. The guarantee of kCellSheets also holds for these,
/// except for several joined faces of a cell with alternating corners, of which CellBlocks joins none.
CellSheets cell_sheets(int signs, unsigned joined_faces);

constexpr int edge_axis(int edge) { return edge >> 2; }
/// Returns the offset of the first corner of an edge.
constexpr std::array<int, 3> edge_offset(int edge) {
  std::array<int, 3> offset{};
  offset[(edge_axis(edge) + 1) % 3] = edge & 1;
  offset[(edge_axis(edge) + 2) % 3] = (edge >> 1) & 1;
  return offset;
}
constexpr int edge_number(int axis, const std::array<int, 3>& offset) {
  return 4 * axis + offset[(axis + 1) % 3] + 2 * offset[(axis + 2) % 3];
}
constexpr int corner_number(const std::array<int, 3>& offset) {
  return offset[0] + 2 * offset[1] + 4 * offset[2];
}
/// The crossed edges of a cell, one bit per edge, by the inside bits of its corners.
inline constexpr std::array<std::uint16_t, 256> kCrossedEdges = [] {
  std::array<std::uint16_t, 256> result{};
  for (int signs = 0; signs < 256; ++signs)
    for (int edge = 0; edge < 12; ++edge) {
      const int from = corner_number(edge_offset(edge)), to = from | 1 << edge_axis(edge);
      if (((signs >> from) & 1) != ((signs >> to) & 1))
        result[signs] |= static_cast<std::uint16_t>(1 << edge);
    }
  return result;
}();
constexpr std::array<int, 3> corner_offset(int corner) {
  return {corner & 1, (corner >> 1) & 1, corner >> 2};
}

/// Returns the corners of a face in cyclic order: 00, 10, 11, 01 along axes (a+1) % 3 and (a+2) % 3.
constexpr std::array<int, 4> face_corners(int face) {
  const int a = face >> 1, first = (face & 1) << a, u = 1 << (a + 1) % 3, v = 1 << (a + 2) % 3;
  return {first, first | u, first | u | v, first | v};
}
/// Returns the edges of a face in the same order: edge i connects corner i to corner i + 1.
constexpr std::array<int, 4> face_edges(int face) {
  const int u = ((face >> 1) + 1) % 3, v = ((face >> 1) + 2) % 3;
  const std::array<int, 4> corners = face_corners(face);
  return {edge_number(u, corner_offset(corners[0])), edge_number(v, corner_offset(corners[1])),
          edge_number(u, corner_offset(corners[3])), edge_number(v, corner_offset(corners[0]))};
}

}  // namespace hermesh
