#include "algorithms/extraction/marching_cubes/triangulation_table.h"

namespace hermesh {
namespace {

/// Corners of the six faces, counter-clockwise seen from outside the cell.
constexpr std::array<std::array<int, 4>, 6> kFaces{
    {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};

constexpr int edge_between(int a, int b) {
  // The two corners differ in one bit, which is the axis; the edge starts at the corner without it.
  const int first = a < b ? a : b;
  const int axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
  for (int e = 0; e < 12; ++e)
    if (kCellEdges[e].axis == axis && kCellEdges[e].first_corner == first) return e;
  return -1;
}

constexpr bool face_has_edge(const std::array<int, 4>& face, int edge) {
  for (int i = 0; i < 4; ++i)
    if (edge_between(face[i], face[(i + 1) % 4]) == edge) return true;
  return false;
}

constexpr bool on_common_face(int a, int b) {
  for (const auto& face : kFaces)
    if (face_has_edge(face, a) && face_has_edge(face, b)) return true;
  return false;
}

/// For each crossed edge the next one on its loop, −1 elsewhere. On each face a segment runs from the edge
/// through which the walk around the face enters the inside to the edge through which it leaves it again,
/// which cuts off the inside corners.
constexpr std::array<int, 12> segments(int pattern) {
  std::array<int, 12> next{};
  next.fill(-1);
  for (const auto& face : kFaces)
    for (int i = 0; i < 4; ++i) {
      const auto inside = [&](int k) { return ((pattern >> face[k & 3]) & 1) != 0; };
      // An ambiguous face has two such edges, one for each run of inside corners.
      if (inside(i) || !inside(i + 1)) continue;
      int leave = i + 1;
      while (inside(leave + 1)) ++leave;
      next[edge_between(face[i], face[(i + 1) & 3])] = edge_between(face[leave & 3], face[(leave + 1) & 3]);
    }
  return next;
}

struct Loop {
  int size = 0;
  std::array<int, 12> edges{};
};

constexpr bool diagonal_allowed(const Loop& loop, int i, int j) {
  const int apart = j - i;
  return apart == 1 || apart == loop.size - 1 || !on_common_face(loop.edges[i], loop.edges[j]);
}

/// Cuts the part of the loop from i to j into triangles, without the side from j to i; false if no
/// triangulation is allowed.
constexpr bool triangulate(const Loop& loop, int i, int j, CellTriangles& result) {
  if (j - i < 2) return true;
  // The side from i to j belongs to one triangle, with its third corner k between: all k are tried, and both
  // remaining parts recursively.
  for (int k = i + 1; k < j; ++k) {
    if (!diagonal_allowed(loop, i, k) || !diagonal_allowed(loop, k, j)) continue;
    const int before = result.count;
    result.triangles[result.count++] = {static_cast<std::uint8_t>(loop.edges[i]),
                                        static_cast<std::uint8_t>(loop.edges[k]),
                                        static_cast<std::uint8_t>(loop.edges[j])};
    if (triangulate(loop, i, k, result) && triangulate(loop, k, j, result)) return true;
    result.count = static_cast<std::uint8_t>(before);
  }
  return false;
}

constexpr CellTriangles triangulate_pattern(int pattern) {
  CellTriangles result;
  const std::array<int, 12> next = segments(pattern);
  std::array<bool, 12> done{};
  // Two faces share an edge and traverse it in opposite directions, so it is entered on one and left on the
  // other: each crossed edge has one successor and one predecessor, and the segments form closed loops.
  for (int start = 0; start < 12; ++start) {
    if (next[start] < 0 || done[start]) continue;
    Loop loop;
    for (int e = start; !done[e]; e = next[e]) {
      done[e] = true;
      loop.edges[loop.size++] = e;
    }
    if (!triangulate(loop, 0, loop.size - 1, result)) throw "a loop has no allowed triangulation";
  }
  return result;
}

constexpr std::array<CellTriangles, 256> build() {
  std::array<CellTriangles, 256> table{};
  for (int pattern = 0; pattern < 256; ++pattern) table[pattern] = triangulate_pattern(pattern);
  return table;
}

}  // namespace

// A pattern without an allowed triangulation would fail to compile here.
constexpr std::array<CellTriangles, 256> kTriangulation = build();

bool share_a_face(int edge_a, int edge_b) { return on_common_face(edge_a, edge_b); }

}  // namespace hermesh
