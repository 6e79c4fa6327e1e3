#include "algorithms/extraction/embedded_mesh/cell_sheets.h"

namespace hermesh {
namespace {

/// Whether a corner is inside, by a pattern's bits.
constexpr bool inside(int signs, int corner) { return (signs >> corner) & 1; }

/// Draws the segments on each face. The corners of `joined` faces are cut off the other way.
constexpr void cut_faces(int signs, unsigned joined, CellSheets& cell) {
  for (auto& face : cell.partner) face.fill(CellSheets::kNone);
  for (int face = 0; face < 6; ++face) {
    const std::array<int, 4> edges = face_edges(face), corners = face_corners(face);
    // A segment is noted at both of its ends.
    const auto join = [&](int a, int b) {
      cell.partner[face][a] = static_cast<std::uint8_t>(b);
      cell.partner[face][b] = static_cast<std::uint8_t>(a);
    };
    int crossed[4] = {}, count = 0;
    for (int i = 0; i < 4; ++i)
      if (inside(signs, corners[i]) != inside(signs, corners[(i + 1) % 4])) crossed[count++] = edges[i];
    // Going around a face the sign changes an even number of times: 0, 2, or 4 if the face is ambiguous.
    if (count == 2) join(crossed[0], crossed[1]);
    if (count < 4) continue;
    cell.ambiguous_faces |= static_cast<std::uint8_t>(1 << face);
    // Corner i lies between edges i − 1 and i of the face, so a segment between these cuts it off.
    const bool cut_off = !((joined >> face) & 1);  // which of the corners are
    for (int i = 0; i < 4; ++i)
      if (inside(signs, corners[i]) == cut_off) join(edges[(i + 3) % 4], edges[i]);
  }
}

/// Numbers the loops that the segments close to, in the order of their first edges, by walking around each.
constexpr void number_loops(CellSheets& cell) {
  cell.sheet_of.fill(CellSheets::kNone);
  for (int first = 0; first < 12; ++first) {
    if (cell.sheet_of[first] != CellSheets::kNone) continue;
    int edge = first, came_from = -1;
    bool found = false;
    do {  // an edge lies in two faces, and so has two partners or none
      // Leave by the other one of the edge's two faces; from the first edge either will do.
      for (int face = 0; face < 6; ++face) {
        if (face == came_from || cell.partner[face][edge] == CellSheets::kNone) continue;
        cell.sheet_of[edge] = cell.sheets;
        edge = cell.partner[face][edge];
        came_from = face;
        found = true;
        break;
      }
    } while (found && edge != first);
    if (found) ++cell.sheets;
  }
}

constexpr std::array<CellSheets, 256> all_cells() {
  std::array<CellSheets, 256> table{};
  for (int signs = 0; signs < 256; ++signs) {
    cut_faces(signs, 0, table[signs]);
    number_loops(table[signs]);
  }
  return table;
}

}  // namespace

// Worked out by the compiler, so it is there before anything runs.
constinit const std::array<CellSheets, 256> kCellSheets = all_cells();

CellSheets cell_sheets(int signs, unsigned joined_faces) {
  CellSheets cell;
  cut_faces(signs, joined_faces, cell);
  number_loops(cell);
  return cell;
}

}  // namespace hermesh
