#include "algorithms/extraction/embedded_mesh/cell_sheets.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace hermesh {
namespace cell_sheets_test {

TEST(CellSheets, CountsKnownByHand) {
  EXPECT_EQ(kCellSheets[0b00000000].sheets, 0);
  EXPECT_EQ(kCellSheets[0b11111111].sheets, 0);
  EXPECT_EQ(kCellSheets[0b00000001].sheets, 1);
  EXPECT_EQ(kCellSheets[0b00001001].sheets, 2);  // two inside corners across a face
  EXPECT_EQ(kCellSheets[0b10000001].sheets, 2);  // across the cell
  EXPECT_EQ(kCellSheets[0b01101001].sheets, 4);  // every other corner
  EXPECT_EQ(kCellSheets[0b10010110].sheets, 4);
  EXPECT_EQ(kCellSheets[0b01111110].sheets, 2);  // outside corners across the cell
  EXPECT_EQ(kCellSheets[0b11110110].sheets, 1);  // outside corners across a face are joined there
  EXPECT_EQ(kCellSheets[0b00001001].ambiguous_faces, 0b010000);
}

TEST(CellSheets, SegmentsCloseToLoopsOfCrossedEdges) {
  for (int signs = 0; signs < 256; ++signs) {
    const CellSheets& cell = kCellSheets[signs];
    for (int edge = 0; edge < 12; ++edge) {
      std::array<int, 3> first = edge_offset(edge), second = first;
      second[edge_axis(edge)] = 1;
      const bool crossed = (((signs >> corner_number(first)) ^ (signs >> corner_number(second))) & 1) != 0;
      int ends = 0;
      for (int face = 0; face < 6; ++face) {
        const int other = cell.partner[face][edge];
        if (other == CellSheets::kNone) continue;
        ++ends;
        ASSERT_EQ(cell.partner[face][other], edge) << signs;
        ASSERT_EQ(cell.sheet_of[other], cell.sheet_of[edge]) << signs;
      }
      ASSERT_EQ(ends, crossed ? 2 : 0) << signs << " edge " << edge;
      ASSERT_EQ(cell.sheet_of[edge] != CellSheets::kNone, crossed) << signs;
      if (crossed) {
        ASSERT_LT(cell.sheet_of[edge], cell.sheets) << signs;
      }
    }
  }
}

/// A cell and its neighbour read the same segments off the face between them.
TEST(CellSheets, BothSidesOfAFaceCutItAlike) {
  for (const bool joined : {false, true})
    for (int axis = 0; axis < 3; ++axis)
      for (int pattern = 0; pattern < 16; ++pattern) {
        const int lower = 2 * axis, upper = 2 * axis + 1;
        int below = 0,
            above = 0;  // signs of a cell with the face above it, and of the cell on its other side
        for (int i = 0; i < 4; ++i) {
          below |= ((pattern >> i) & 1) << face_corners(upper)[i];
          above |= ((pattern >> i) & 1) << face_corners(lower)[i];
        }
        const CellSheets sheets_below = cell_sheets(below, joined ? 1u << upper : 0);
        const CellSheets sheets_above = cell_sheets(above, joined ? 1u << lower : 0);
        const std::array<int, 4> top = face_edges(upper), bottom = face_edges(lower);
        for (int i = 0; i < 4; ++i) {
          const int a = sheets_below.partner[upper][top[i]], b = sheets_above.partner[lower][bottom[i]];
          const int from_a = int(std::find(top.begin(), top.end(), a) - top.begin());
          const int from_b = int(std::find(bottom.begin(), bottom.end(), b) - bottom.begin());
          ASSERT_EQ(from_a, from_b) << axis << ' ' << pattern << ' ' << i;
        }
      }
}

bool has_one_sheet(const CellSheets& cell, int face) {
  for (const int edge : face_edges(face))
    if (cell.sheet_of[edge] != cell.sheet_of[face_edges(face)[0]]) return false;
  return true;
}

TEST(CellSheets, JoiningAFaceOfOneSheetPartsThatAndNoOther) {
  int faces = 0;
  for (int signs = 0; signs < 256; ++signs)
    for (int face = 0; face < 6; ++face) {
      const CellSheets& cell = kCellSheets[signs];
      if (!((cell.ambiguous_faces >> face) & 1) || !has_one_sheet(cell, face)) continue;
      ++faces;
      const CellSheets joined = cell_sheets(signs, 1u << face);
      EXPECT_EQ(joined.sheets, cell.sheets + 1) << signs << " face " << face;
      EXPECT_FALSE(has_one_sheet(joined, face)) << signs << " face " << face;
    }
  EXPECT_EQ(faces, 36);
}

/// A plane by its normal and twice its offset.
struct Plane {
  int normal[3], offset;
};

/// The side of a plane that the open interval of an edge lies strictly on, +1 or −1; 0 if it lies on neither.
int side(int edge, const Plane& plane) {
  std::array<int, 3> first = edge_offset(edge), second = first;
  second[edge_axis(edge)] = 1;
  int at_first = -plane.offset, at_second = -plane.offset;
  for (int a = 0; a < 3; ++a) {
    at_first += 2 * plane.normal[a] * first[a];
    at_second += 2 * plane.normal[a] * second[a];
  }
  if (at_first >= 0 && at_second >= 0 && at_first + at_second > 0) return 1;
  if (at_first <= 0 && at_second <= 0 && at_first + at_second < 0) return -1;
  return 0;
}

bool are_separated(const CellSheets& cell, int a, int b) {
  for (int n = 0; n < 27; ++n)
    for (int offset = -6; offset <= 6; ++offset) {
      const Plane plane{{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1}, offset};
      bool all = true;
      for (int edge = 0; edge < 12 && all; ++edge) {
        if (cell.sheet_of[edge] == a) all = side(edge, plane) == 1;
        if (cell.sheet_of[edge] == b) all = side(edge, plane) == -1;
      }
      if (all) return true;
    }
  return false;
}

/// The guarantee of kCellSheets and of cell_sheets().
TEST(CellSheets, APlaneSeparatesEveryTwoLoops) {
  int pairs = 0, patterns = 0;
  for (int signs = 0; signs < 256; ++signs)
    for (unsigned joined = 0; joined < 64; ++joined) {
      if (joined & ~unsigned{kCellSheets[signs].ambiguous_faces}) continue;
      if (joined && kCellSheets[signs].sheets == 4)
        continue;  // every other corner is inside: the header's exception
      ++patterns;
      const CellSheets cell = cell_sheets(signs, joined);
      for (int a = 0; a < cell.sheets; ++a)
        for (int b = a + 1; b < cell.sheets; ++b, ++pairs)
          EXPECT_TRUE(are_separated(cell, a, b)) << signs << ", " << joined << ": " << a << " and " << b;
    }
  EXPECT_EQ(patterns, 656 - 2 * 63);
  EXPECT_GT(pairs, 250);
}

}  // namespace cell_sheets_test
}  // namespace hermesh
