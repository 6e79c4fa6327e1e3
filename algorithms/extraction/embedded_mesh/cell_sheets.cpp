#include "algorithms/extraction/embedded_mesh/cell_sheets.h"

namespace hermesh {
namespace {

/// Draws the segments on each face. On `joined` faces the outside corners are cut off.
constexpr void cut_faces(int signs, unsigned joined, CellSheets& cell) {
  const auto inside = [&](int corner) { return ((signs >> corner) & 1) != 0; };
  for (auto& face : cell.partner) face.fill(CellSheets::kNone);
  for (int face = 0; face < 6; ++face) {
    const std::array<int, 4> edges = face_edges(face), corners = face_corners(face);
    const auto join = [&](int a, int b) {
      cell.partner[face][a] = static_cast<std::uint8_t>(b);
      cell.partner[face][b] = static_cast<std::uint8_t>(a);
    };
    int crossed[4] = {}, count = 0;
    for (int i = 0; i < 4; ++i)
      if (inside(corners[i]) != inside(corners[(i + 1) % 4])) crossed[count++] = edges[i];
    // The sign changes an even number of times around a face: 0, 2, or 4 if the face is ambiguous.
    if (count == 2) join(crossed[0], crossed[1]);
    if (count < 4) continue;
    cell.ambiguous_faces |= static_cast<std::uint8_t>(1 << face);
    // Corner i lies between edges i − 1 and i of the face, so a segment between these cuts it off.
    const bool cut_off = !((joined >> face) & 1);
    for (int i = 0; i < 4; ++i)
      if (inside(corners[i]) == cut_off) join(edges[(i + 3) % 4], edges[i]);
  }
}

/// Numbers the loops of segments, in the order of their first edges, by walking along each.
constexpr void number_loops(CellSheets& cell) {
  cell.sheet_of.fill(CellSheets::kNone);
  for (int first = 0; first < 12; ++first) {
    if (cell.sheet_of[first] != CellSheets::kNone) continue;
    int edge = first, came_from = -1;
    bool found = false;
    do {  // an edge lies in two faces, so it has two partners or none
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

constexpr CellSheets traced(int signs, unsigned joined) {
  CellSheets cell;
  cut_faces(signs, joined, cell);
  number_loops(cell);
  return cell;
}

}  // namespace

// Computed by the compiler, so that no other initialisation can precede it.
constinit const std::array<CellSheets, 256> kCellSheets = [] {
  std::array<CellSheets, 256> table{};
  for (int signs = 0; signs < 256; ++signs) table[signs] = traced(signs, 0);
  return table;
}();

CellSheets cell_sheets(int signs, unsigned joined_faces) { return traced(signs, joined_faces); }

}  // namespace hermesh
