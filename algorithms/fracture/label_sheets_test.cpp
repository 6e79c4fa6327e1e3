#include "algorithms/fracture/label_sheets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace hermesh {
namespace label_sheets_test {

/// Every way to divide the corners among labels, the first corner's being `first`; 4140 of them.
std::vector<CornerLabels> all_patterns(std::uint32_t first) {
  std::vector<CornerLabels> patterns = {{first}};
  for (std::size_t c = 1; c < 8; ++c) {
    std::vector<CornerLabels> longer;
    for (const CornerLabels& pattern : patterns) {
      const std::uint32_t highest = *std::max_element(pattern.begin(), pattern.begin() + int(c));
      for (std::uint32_t label = first; label <= highest + 1; ++label) {
        longer.push_back(pattern);
        longer.back()[c] = label;
      }
    }
    patterns = std::move(longer);
  }
  return patterns;
}

struct Expected {
  int sheets;
  bool single_loops;
  int ambiguous, pinched;  ///< a bit a face
};

void expect(const CornerLabels& labels, const Expected& expected) {
  const JointSheets joint = joint_sheets(labels);
  std::string text;
  for (const std::uint32_t label : labels) text += std::to_string(label) + " ";
  EXPECT_EQ(joint.sheets.sheets, expected.sheets) << text;
  EXPECT_EQ(joint.single_loops, expected.single_loops) << text;
  EXPECT_EQ(joint.sheets.ambiguous_faces, expected.ambiguous) << text;
  EXPECT_EQ(joint.pinched, expected.pinched) << text;
}

TEST(LabelSheets, KnownByHand) {
  // Corner c has the offsets (c & 1, c >> 1 & 1, c >> 2); face 2a + s is the lower or upper one across axis
  // a.
  expect({1, 1, 1, 1, 1, 1, 1, 1}, {0, true, 0, 0});
  expect({1, 2, 1, 2, 1, 2, 1, 2}, {1, true, 0, 0});  // a wall across x
  expect({1, 2, 3, 4, 1, 2, 3, 4}, {1, true, 0, 0});  // four pieces along an edge
  expect({1, 2, 1, 2, 0, 0, 0, 0}, {1, true, 0, 0});  // a wall that ends at the original surface
  // The original surface cuts off corners 0 and 2, a wall corner 7, which is across the upper face of y
  // from 2.
  expect({0, 2, 0, 2, 2, 2, 2, 1}, {2, true, 0b001000, 0});
  // The wall meets the surface at corners 1 and 4 twice, with 2 in between on the lower face of y.
  expect({0, 2, 0, 1, 2, 1, 1, 1}, {1, true, 0b000100, 0b000100});
  // Label 1 at two opposite corners: two sheets. Across a face the corners are cut off one by one in one case
  // (corners 0 and 3 are the face's 00 and 11) and connected in the other (1 and 2).
  expect({1, 2, 2, 2, 2, 2, 2, 1}, {2, true, 0, 0});
  expect({1, 2, 2, 1, 2, 2, 2, 2}, {2, true, 0b010000, 0});
  expect({2, 1, 1, 2, 2, 2, 2, 2}, {1, true, 0b010000, 0b010000});
  // A ring of label 1 around the cell, next to 2 on one side and 3 on the other: 1 is bounded by two loops,
  // in two sheets.
  expect({2, 1, 1, 1, 1, 1, 1, 3}, {2, true, 0, 0});
  // 1 at two corners across the cell, with three labels meeting all about them: two loops in one sheet.
  expect({1, 2, 3, 3, 2, 2, 3, 1}, {1, false, 0, 0});
}

TEST(LabelSheets, AreThoseOfSignsWhereAllIsOfOnePiece) {
  for (int signs = 0; signs < 256; ++signs) {
    CornerLabels labels;
    for (int c = 0; c < 8; ++c) labels[c] = (signs >> c) & 1 ? 5 : 0;
    const JointSheets joint = joint_sheets(labels);
    const CellSheets& cell = kCellSheets[static_cast<std::size_t>(signs)];
    ASSERT_FALSE(has_cut(labels));
    ASSERT_EQ(joint.sheets.sheets, cell.sheets) << signs;
    ASSERT_EQ(joint.sheets.sheet_of, cell.sheet_of) << signs;
    ASSERT_EQ(joint.sheets.partner, cell.partner) << signs;
    ASSERT_EQ(joint.sheets.ambiguous_faces, cell.ambiguous_faces) << signs;
    ASSERT_TRUE(joint.single_loops) << signs;
  }
}

/// A face's segments as indices in face_edges(), −1 for none.
std::array<int, 4> segments(const JointSheets& joint, int face) {
  const std::array<int, 4> edges = face_edges(face);
  std::array<int, 4> result{};
  for (int i = 0; i < 4; ++i) {
    const auto at = std::ranges::find(edges, int(joint.sheets.partner[face][edges[i]]));
    result[i] = at == edges.end() ? -1 : int(at - edges.begin());
  }
  return result;
}

TEST(LabelSheets, BothSidesOfAFaceCutItAlikeWhateverTheLabelsAreCalled) {
  for (const std::uint32_t first : {0u, 1u})
    for (const CornerLabels& labels : all_patterns(first)) {
      const JointSheets joint = joint_sheets(labels);
      CornerLabels other_names;
      std::ranges::transform(labels, other_names.begin(),
                             [](std::uint32_t l) { return l == 0 ? 0 : 100 - l; });
      const JointSheets renamed = joint_sheets(other_names);
      ASSERT_EQ(joint.sheets.partner, renamed.sheets.partner);
      ASSERT_EQ(joint.sheets.sheet_of, renamed.sheets.sheet_of);
      for (int axis = 0; axis < 3; ++axis) {
        // The cell above, whose lower face is this one's upper face; the rest of it is of one more piece.
        CornerLabels above;
        above.fill(50);
        for (int i = 0; i < 4; ++i) above[face_corners(2 * axis)[i]] = labels[face_corners(2 * axis + 1)[i]];
        ASSERT_EQ(segments(joint, 2 * axis + 1), segments(joint_sheets(above), 2 * axis));
      }
    }
}

/// Crossings on one face are in one sheet, except for the two segments of an ambiguous face; every sheet has
/// at least three crossings.
TEST(LabelSheets, HoldWhatHangsTogetherOnTheFaces) {
  for (const CornerLabels& labels : all_patterns(0)) {
    const JointSheets joint = joint_sheets(labels);
    std::array<int, 4> crossings{};
    for (int edge = 0; edge < 12; ++edge) {
      const int a = corner_number(edge_offset(edge)), b = a | 1 << edge_axis(edge);
      ASSERT_EQ(joint.sheets.sheet_of[edge] != CellSheets::kNone, labels[a] != labels[b]);
      if (labels[a] != labels[b]) ++crossings.at(joint.sheets.sheet_of[edge]);
    }
    for (int sheet = 0; sheet < 4; ++sheet) ASSERT_EQ(crossings[sheet] >= 3, sheet < joint.sheets.sheets);
    for (int face = 0; face < 6; ++face) {
      const std::array<int, 4> edges = face_edges(face);
      const bool ambiguous = ((joint.sheets.ambiguous_faces >> face) & 1) != 0;
      for (const int a : edges)
        for (const int b : edges) {
          const std::uint8_t of_a = joint.sheets.sheet_of[a], of_b = joint.sheets.sheet_of[b];
          if (of_a == CellSheets::kNone || of_b == CellSheets::kNone) continue;
          if (ambiguous && joint.sheets.partner[face][a] != b) continue;
          ASSERT_EQ(of_a, of_b);
        }
    }
  }
}

}  // namespace label_sheets_test
}  // namespace hermesh
