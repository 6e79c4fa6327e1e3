// How the surface passes through one cell, by the signs of its corners: the loops that it cuts on the cell's
// boundary.
//
// Numbers used by all of this folder. Corner c has the offsets (c & 1, c >> 1 & 1, c >> 2). Edge 4a + du +
// 2dv lies along axis a, displaced by du along axis (a+1) % 3 and dv along axis (a+2) % 3. Face 2a + s is the
// lower (s = 0) or upper (s = 1) one across axis a.
#pragma once

#include <array>
#include <cstdint>

namespace hermesh {

/// The loops that the surface cuts on the boundary of one cell, and the sheets that they bound. On each face
/// the surface cuts straight segments between the crossings of the face's edges. A face whose corners differ
/// along both diagonals is ambiguous and gets two segments: its inside corners are cut off one by one, which
/// both cells beside the face do alike. So the segments of a cell close to loops, and each loop bounds one
/// sheet of the surface.
struct CellSheets {
  static constexpr std::uint8_t kNone = 255;

  std::uint8_t sheets = 0;                  ///< how many, 0 to 4
  std::array<std::uint8_t, 12> sheet_of{};  ///< sheet of each edge; kNone where the edge is not crossed
  /// For each face and edge the other end of the segment that starts on this edge in that face; kNone where
  /// there is none.
  std::array<std::array<std::uint8_t, 12>, 6> partner{};
  std::uint8_t ambiguous_faces = 0;  ///< a bit a face
};

/// The sheets of a cell for each pattern of its corners' inside bits.
///
/// **Guarantee.** The crossings of two loops of one cell are strictly separated by a plane, wherever on their
/// edges they lie (but not at the corners): so the convex hulls of two loops never meet. The test tries all
/// patterns.
extern const std::array<CellSheets, 256> kCellSheets;

/// The sheets of a cell as in kCellSheets, except that on the ambiguous faces among `joined_faces`, a bit a
/// face, the outside corners are cut off one by one and the inside is joined. The guarantee of kCellSheets
/// holds for these, too, unless every other corner is inside and several faces are joined. (CellBlocks joins
/// no face of such cells.)
CellSheets cell_sheets(int signs, unsigned joined_faces);

constexpr int edge_axis(int edge) { return edge >> 2; }
/// Offset of an edge's first corner.
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
/// The crossed edges of a cell, a bit an edge, for each pattern of its corners' inside bits.
inline constexpr std::array<std::uint16_t, 256> kCrossedEdges = [] {
  std::array<std::uint16_t, 256> result{};
  for (int signs = 0; signs < 256; ++signs)
    for (int edge = 0; edge < 12; ++edge) {
      const int from = corner_number(edge_offset(edge)), to = from | 1 << edge_axis(edge);
      if (((signs >> from) & 1) != ((signs >> to) & 1))
        result[static_cast<std::size_t>(signs)] |= static_cast<std::uint16_t>(1 << edge);
    }
  return result;
}();
constexpr std::array<int, 3> corner_offset(int corner) {
  return {corner & 1, (corner >> 1) & 1, corner >> 2};
}

/// Edges of a face in cyclic order: between corners 00–10, 10–11, 11–01, 01–00 along axes (a+1) % 3 and (a+2)
/// % 3.
constexpr std::array<int, 4> face_edges(int face) {
  const int a = face >> 1, u = (a + 1) % 3, v = (a + 2) % 3;
  std::array<int, 3> at{};
  at[a] = face & 1;
  std::array<int, 3> far_u = at, far_v = at;
  far_u[u] = 1;
  far_v[v] = 1;
  return {edge_number(u, at), edge_number(v, far_u), edge_number(u, far_v), edge_number(v, at)};
}
/// Corners of a face in the same order: edge i leads from corner i to corner i + 1.
constexpr std::array<int, 4> face_corners(int face) {
  const int a = face >> 1, u = (a + 1) % 3, v = (a + 2) % 3;
  std::array<int, 4> corners{};
  for (int i = 0; i < 4; ++i) {
    std::array<int, 3> at{};
    at[a] = face & 1;
    at[u] = i == 1 || i == 2;
    at[v] = i >= 2;
    corners[i] = corner_number(at);
  }
  return corners;
}

}  // namespace hermesh
