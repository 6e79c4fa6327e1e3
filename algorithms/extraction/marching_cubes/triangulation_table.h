// Marching cubes' table of triangles for the 256 sign patterns of a cell, built at compile time from two
// rules.
//
// Rule of faces: on a face whose four edges all cross, segments cut off the two inside corners. The rule
// looks at the face alone, so both cells at the face choose alike and the surface is closed. Rule of
// diagonals: a loop of segments is cut into triangles by diagonals between edges of the cell that have no
// face in common. A diagonal thus lies in one cell alone, so no edge of the mesh can have more than two
// triangles; and each crossing point is passed once by each of its four cells, so its triangles form one fan.
// The search below finds such diagonals for every loop of every pattern (the original table of Lorensen &
// Cline 1987 has patterns that leave holes).
#pragma once

#include <array>
#include <cstdint>

namespace hermesh {

/// Corners are numbered x + 2y + 4z. Edges: four along x, four along y, four along z, by their first corner
/// ascending.
struct CellEdge {
  std::uint8_t axis, first_corner;
};
inline constexpr std::array<CellEdge, 12> kCellEdges{
    {{0, 0}, {0, 2}, {0, 4}, {0, 6}, {1, 0}, {1, 1}, {1, 4}, {1, 5}, {2, 0}, {2, 1}, {2, 2}, {2, 3}}};

struct CellTriangles {
  std::uint8_t count = 0;
  /// Edges of the cell, counter-clockwise seen from outside. At most five triangles a cell.
  std::array<std::array<std::uint8_t, 3>, 5> triangles{};
};

/// Triangles of each cell by the pattern of its inside corners: bit c is set if corner c is inside.
extern const std::array<CellTriangles, 256> kTriangulation;

/// True if two edges of the cell lie on a common face.
bool share_a_face(int edge_a, int edge_b);

}  // namespace hermesh
