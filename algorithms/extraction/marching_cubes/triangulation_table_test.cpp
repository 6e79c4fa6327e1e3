#include "algorithms/extraction/marching_cubes/triangulation_table.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

namespace hermesh {
namespace triangulation_table_test {

bool crosses(int pattern, const CellEdge& edge) {
  const int other = edge.first_corner | (1 << edge.axis);
  return ((pattern >> edge.first_corner) & 1) != ((pattern >> other) & 1);
}

TEST(TriangulationTable, KnownCells) {
  EXPECT_EQ(kTriangulation[0].count, 0);
  EXPECT_EQ(kTriangulation[255].count, 0);
  EXPECT_EQ(kTriangulation[1].count, 1);           // one corner cut off
  EXPECT_EQ(kTriangulation[0b1111].count, 2);      // a plane between z = 0 and z = 1
  EXPECT_EQ(kTriangulation[0b10010110].count, 4);  // every other corner, each cut off by itself
}

TEST(TriangulationTable, ACutOffCornerFacesAwayFromIt) {
  // Corner 0 inside: the normal of the triangle between the edges' midpoints points along (1,1,1),
  // counter-clockwise.
  const auto& triangle = kTriangulation[1].triangles[0];
  const auto axis_after = [](int edge) { return (kCellEdges[edge].axis + 1) % 3; };
  for (int i = 0; i < 3; ++i) EXPECT_EQ(kCellEdges[triangle[(i + 1) % 3]].axis, axis_after(triangle[i]));
}

TEST(TriangulationTable, UsesEveryCrossingEdgeAndNoOther) {
  for (int pattern = 0; pattern < 256; ++pattern) {
    std::set<int> used;
    const CellTriangles& cell = kTriangulation[pattern];
    for (int t = 0; t < cell.count; ++t) used.insert(cell.triangles[t].begin(), cell.triangles[t].end());
    for (int e = 0; e < 12; ++e)
      EXPECT_EQ(used.count(e) == 1, crosses(pattern, kCellEdges[e])) << pattern << ' ' << e;
  }
}

/// Within a cell, a side between edges without a common face is a diagonal and belongs to two triangles, once
/// in each direction; a side between edges of one face is open, and the adjacent cell closes it.
TEST(TriangulationTable, DiagonalsArePairedAndNeverLieOnAFace) {
  for (int pattern = 0; pattern < 256; ++pattern) {
    std::map<std::pair<int, int>, int> sides;
    const CellTriangles& cell = kTriangulation[pattern];
    for (int t = 0; t < cell.count; ++t)
      for (int i = 0; i < 3; ++i) ++sides[{cell.triangles[t][i], cell.triangles[t][(i + 1) % 3]}];
    for (const auto& [side, times] : sides) {
      EXPECT_EQ(times, 1);
      const bool paired = sides.count({side.second, side.first}) == 1;
      EXPECT_EQ(paired, !share_a_face(side.first, side.second)) << pattern;
    }
  }
}

}  // namespace triangulation_table_test
}  // namespace hermesh
