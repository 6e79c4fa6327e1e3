// Marching cubes' table of triangles for the 256 sign patterns of a cell, built at compile time from two
// rules.
//
// Rule of faces: on a face whose four edges are all crossed, segments cut off the two inside corners. The
// rule depends only on the face, so both cells at the face make the same choice and the surface is closed.
// Rule of diagonals: a loop of segments is cut into triangles by diagonals between edges of the cell that
// have no face in common. A diagonal thus lies in only one cell, so no edge of the mesh can have more than
// two triangles; and each of the four cells around a crossed edge passes its vertex once, so the vertex's
// triangles form one fan. The search in triangulation_table.cpp finds such diagonals for every loop of every
// pattern (the original table of Lorensen & Cline 1987 has patterns that leave holes).
#pragma once

#include <array>
#include <cstdint>

namespace hermesh {

/// Corners are numbered x + 2y + 4z. Edges are numbered by axis, four along each of x, y and z, in ascending
/// order of their first corners.
struct CellEdge {
  std::uint8_t axis, first_corner;
};
inline constexpr std::array<CellEdge, 12> kCellEdges{
    {{0, 0}, {0, 2}, {0, 4}, {0, 6}, {1, 0}, {1, 1}, {1, 4}, {1, 5}, {2, 0}, {2, 1}, {2, 2}, {2, 3}}};

struct CellTriangles {
  std::uint8_t count = 0;
  /// Edges of the cell, counter-clockwise seen from outside. At most five triangles per cell.
  std::array<std::array<std::uint8_t, 3>, 5> triangles{};
};

/// Triangles of each cell by the pattern of its inside corners: bit c is set if corner c is inside.
extern const std::array<CellTriangles, 256> kTriangulation;

/// Returns true if two edges of the cell lie on a common face.
bool share_a_face(int edge_a, int edge_b);

}  // namespace hermesh
