#include "algorithms/fracture/label_sheets.h"

#include <algorithm>

namespace hermesh {
namespace {

/// The numbering of cell_sheets.h as tables, because a repair computes sheets very often: an edge's two
/// corners.
constexpr std::array<std::array<int, 2>, 12> kCornersOfEdge = [] {
  std::array<std::array<int, 2>, 12> result{};
  for (int edge = 0; edge < 12; ++edge) {
    const int first = corner_number(edge_offset(edge));
    result[edge] = {first, first | 1 << edge_axis(edge)};
  }
  return result;
}();
constexpr std::array<std::array<int, 4>, 6> kFaceEdges = [] {
  std::array<std::array<int, 4>, 6> result{};
  for (int face = 0; face < 6; ++face) result[face] = face_edges(face);
  return result;
}();
constexpr std::array<std::array<int, 4>, 6> kFaceCorners = [] {
  std::array<std::array<int, 4>, 6> result{};
  for (int face = 0; face < 6; ++face) result[face] = face_corners(face);
  return result;
}();

/// The first of the two opposite corners of an ambiguous face that are cut off one by one: 0 (with corner 2)
/// or 1 (with corner 3). `l` holds the labels in the order of face_corners().
int cut_off(const std::array<std::uint32_t, 4>& l) {
  // Both diagonals are alike: inside corners are cut off against the outside, corners 00 and 11 between two
  // pieces. This does not depend on the order of the labels, so renumbering the pieces does not change the
  // sheets.
  if (l[0] == l[2] && l[1] == l[3]) return l[0] == 0 ? 1 : 0;
  // One diagonal is alike and connected; the ends of the other are cut off.
  return l[0] == l[2] ? 1 : 0;
}

/// Works out JointSheets for the labels of one cell.
class Sheets {
 public:
  explicit Sheets(const CornerLabels& labels) : labels_(labels) {
    for (auto& face : sheets().partner) face.fill(CellSheets::kNone);
    for (int edge = 0; edge < 12; ++edge) group_[edge] = edge;
    // Edges start as groups of their own; the lines on the faces unite them into sheets.
    for (int face = 0; face < 6; ++face) cut_face(face);
    number_sheets();
    // All faces must be cut before it is known if the two segments of a face belong to one sheet.
    for (int face = 0; face < 6; ++face) {
      const auto& edges = kFaceEdges[face];
      if (((sheets().ambiguous_faces >> face) & 1) &&
          std::all_of(edges.begin(), edges.end(), [&](int e) { return group_[e] == group_[edges[0]]; }))
        result_.pinched |= static_cast<std::uint8_t>(1 << face);
    }
    for (int c = 0; c < 8; ++c)
      if (std::find(labels.begin(), labels.begin() + c, labels[c]) == labels.begin() + c)
        follow_loops(labels[c]);
  }
  const JointSheets& result() const { return result_; }

 private:
  CellSheets& sheets() { return result_.sheets; }
  bool is_crossed(int edge) const {
    return labels_[kCornersOfEdge[edge][0]] != labels_[kCornersOfEdge[edge][1]];
  }
  /// Returns true if exactly one end of an edge has this label: then the boundary of the label's piece passes
  /// through the edge.
  bool bounds(int edge, std::uint32_t label) const {
    return (labels_[kCornersOfEdge[edge][0]] == label) != (labels_[kCornersOfEdge[edge][1]] == label);
  }

  /// Unites two groups. With twelve edges a pass over all is cheap; the lowest edge is the group's
  /// representative.
  void unite(int a, int b) {
    const int low = std::min(group_[a], group_[b]), high = std::max(group_[a], group_[b]);
    for (int& g : group_)
      if (g == high) g = low;
  }
  /// Draws the segment between the crossings of two edges of a face.
  void join(int face, int a, int b) {
    sheets().partner[face][a] = static_cast<std::uint8_t>(b);
    sheets().partner[face][b] = static_cast<std::uint8_t>(a);
    unite(a, b);
  }

  /// Draws the lines of one face: a segment, two, or a star. A face with one crossing does not exist.
  void cut_face(int face) {
    const auto& edges = kFaceEdges[face];
    int crossed[4] = {}, count = 0;
    for (const int edge : edges)
      if (is_crossed(edge)) crossed[count++] = edge;
    if (count == 2) return join(face, crossed[0], crossed[1]);
    std::array<std::uint32_t, 4> l;
    for (int i = 0; i < 4; ++i) l[i] = labels_[kFaceCorners[face][i]];
    if (count == 4 && (l[0] == l[2] || l[1] == l[3])) {
      sheets().ambiguous_faces |= static_cast<std::uint8_t>(1 << face);
      // Corner i lies between edges i − 1 and i, so the segment between their crossings cuts it off.
      for (int i = cut_off(l); i < 4; i += 2) join(face, edges[(i + 3) % 4], edges[i]);
      return;
    }
    // Three or four labels meet in a star, which has no segments: `partner` stays kNone.
    for (int i = 1; i < count; ++i) unite(crossed[0], crossed[i]);
  }

  void number_sheets() {
    sheets().sheet_of.fill(CellSheets::kNone);
    for (int edge = 0; edge < 12; ++edge) {
      if (!is_crossed(edge)) continue;
      // Edges ascend and the lowest represents its group, so its number is set before the others look it up.
      const int first = group_[edge];
      sheets().sheet_of[edge] = first == edge ? sheets().sheets++ : sheets().sheet_of[first];
    }
  }

  /// The other end of the line on a face that starts at this edge and bounds the label. If two edges of the
  /// face bound the label, it is the other one, even across a star; if four do, the face is ambiguous and its
  /// segment gives the other end.
  int next(int face, int edge, std::uint32_t label) const {
    int count = 0, other = -1;
    for (const int e : kFaceEdges[face])
      if (bounds(e, label)) {
        ++count;
        if (e != edge) other = e;
      }
    return count == 2 ? other : result_.sheets.partner[face][edge];
  }

  /// Walks the loops that bound a label on the cell's boundary, and looks for two of them in one sheet.
  void follow_loops(std::uint32_t label) {
    unsigned seen = 0, sheets_seen = 0;  // edges and sheets, a bit each
    for (int first = 0; first < 12; ++first) {
      if (((seen >> first) & 1) || !bounds(first, label)) continue;
      const unsigned sheet = 1u << sheets().sheet_of[first];
      if (sheets_seen & sheet) result_.single_loops = false;
      sheets_seen |= sheet;
      int edge = first, came_from = -1;
      do {
        seen |= 1u << edge;
        for (int face = 0; face < 6; ++face)
          if (face != came_from && std::ranges::find(kFaceEdges[face], edge) != kFaceEdges[face].end()) {
            edge = next(face, edge, label);
            came_from = face;
            break;
          }
      } while (edge != first);
    }
  }

  const CornerLabels& labels_;
  JointSheets result_;
  std::array<int, 12> group_{};
};

}  // namespace

bool has_cut(const CornerLabels& labels) {
  for (const auto& [a, b] : kCornersOfEdge)
    if (labels[a] != labels[b] && labels[a] != 0 && labels[b] != 0) return true;
  return false;
}

JointSheets joint_sheets(const CornerLabels& labels) { return Sheets(labels).result(); }

}  // namespace hermesh
