#include "algorithms/fracture/labelled_grid.h"

#include <Eigen/LU>

#include "algorithms/core/parallel.h"
#include "algorithms/fracture/label_repair.h"

namespace hermesh {

LabelledGrid::LabelledGrid(LabelledSolid& solid, const FloatHermite& hermite, const Cutters& cutters,
                           RunContext& context)
    : solid_(solid),
      cuts_(solid.blocks.size()),
      joint_sheets_(solid.blocks.size()),
      first_(solid.blocks.size()),
      made_up_edges_(solid.blocks.size()) {
  const Stage stage(context, "crossings of the cuts");
  // Count, scan, fill (parallel.h): each block writes its own range of crossings and sides, so no two threads
  // write the same element, and the order is that of block, axis and sample at any number of threads.
  find_edges(context);
  std::vector<std::uint64_t> made_up(solid.blocks.size());
  parallel_blocks(solid.blocks.size(), context,
                  [&](std::size_t b) { made_up[b] = fill_block(b, hermite, cutters); });
  for (const std::uint64_t n : made_up) made_up_ += n;
}

void LabelledGrid::find_edges(RunContext& context) {
  // Steps along x, y and z within a LabelCube.
  static constexpr int kStep[3] = {81, 9, 1};
  std::vector<std::uint64_t> counts(solid_.blocks.size());
  parallel_blocks(solid_.blocks.size(), context, [&](std::size_t b) {
    auto& crossing = solid_.blocks[b].crossing;
    // The masks of an earlier grid over this solid are replaced: labels may have changed since.
    crossing = {};
    cuts_[b] = {};
    LabelCube cube;
    if (!gather_labels(solid_, solid_.labels, static_cast<std::int32_t>(b), cube)) return;
    for (int sample = 0; sample < 512; ++sample) {
      const int at = 81 * (sample >> 6) + 9 * ((sample >> 3) & 7) + (sample & 7);
      const std::uint32_t label = cube[static_cast<std::size_t>(at)];
      for (int axis = 0; axis < 3; ++axis) {
        const std::uint32_t next = cube[static_cast<std::size_t>(at + kStep[axis])];
        if (label == next) continue;
        const std::uint64_t bit = std::uint64_t{1} << (sample & 63);
        crossing[axis][sample >> 6] |= bit;
        if (label > 0 && next > 0) cuts_[b][axis][sample >> 6] |= bit;
      }
    }
    solid_.blocks[b].count_before();
    // Joints with one vertex and no ambiguous face need not be listed (CellGrid::joint_sheets()). Most joints
    // are of this kind, so the lists are short.
    for (int cell = 0; cell < 512; ++cell) {
      const CornerLabels labels = labels_in(cube, cell);
      if (!has_cut(labels)) continue;
      if (const JointSheets joint = hermesh::joint_sheets(labels); !joint.is_plain())
        joint_sheets_[b].emplace_back(static_cast<std::uint16_t>(cell), joint.sheets);
    }
    for (const BlockMask& edges : crossing) counts[b] += static_cast<std::uint64_t>(count(edges));
  });
  const std::uint64_t total = exclusive_scan(counts, "edge crossings");
  for (std::size_t b = 0; b < counts.size(); ++b) first_[b] = static_cast<std::uint32_t>(counts[b]);
  crossings_.resize(total);
  sides_.resize(total);
}

std::uint64_t LabelledGrid::fill_block(std::size_t b, const FloatHermite& hermite, const Cutters& cutters) {
  const auto block = static_cast<std::int32_t>(b);
  const std::int32_t leaf = solid_.blocks[b].leaf;
  // The original surface's crossings come in the same order as here, with the cuts in between.
  const EdgeCrossing* original =
      leaf < 0 ? nullptr : hermite.crossings_of(static_cast<std::size_t>(leaf)).data();
  std::size_t number = first_[b];
  std::uint64_t made_up = 0;
  const auto value = [&](std::uint32_t code) { return solid_.code_values[code - 1]; };
  for (int axis = 0; axis < 3; ++axis)
    for_each_bit(solid_.blocks[b].crossing[axis], [&](int sample) {
      const LabelledSolid::Place next = solid_.locate(
          block, (sample >> 6) + (axis == 0), ((sample >> 3) & 7) + (axis == 1), (sample & 7) + (axis == 2));
      // Labels and codes are looked up one by one here: only crossing edges come this far.
      const std::uint32_t from = solid_.labels(block, sample), to = solid_.label(next);
      EdgeSides& sides = sides_[number];
      EdgeCrossing& crossing = crossings_[number];
      ++number;
      // Where the first sample is outside, the polygon faces it, so the piece of the second is at the back.
      sides = from > 0 ? EdgeSides{from, to, -1} : EdgeSides{to, 0, -1};
      if (!test(cuts_[b][axis], sample)) {
        crossing = *original++;
        return;
      }
      // First try the codes of the samples: the cutter's own surface passes between them. If a repair or a
      // merge assigned a sample to another piece, both codes may be equal; then try those of the two pieces.
      const std::uint32_t codes[2][2] = {{solid_.codes(block, sample), solid_.codes(next.block, next.sample)},
                                         {solid_.code_of[from], solid_.code_of[to]}};
      for (const auto& [first, second] : codes) {
        if (first == second) continue;
        const auto found = cutters.crossing(solid_.index(block, sample), axis, value(first), value(second));
        if (!found) continue;
        crossing = found->crossing;
        sides.cutter = found->cutter;
        return;
      }
      // No surface passes between these samples. The edge needs a crossing all the same, for polygons close
      // the two pieces here: the end nearer to the surface misplaces it least.
      ++made_up;
      set_bit(made_up_edges_.at(b)[axis], sample);
      if (codes[1][0] != codes[1][1])
        if (const auto found =
                cutters.nearest(solid_.index(block, sample), axis, value(codes[1][0]), value(codes[1][1]))) {
          crossing = found->crossing;
          sides.cutter = found->cutter;
          return;
        }
      // Nothing is known of a surface between these pieces: the middle of the edge, and a plane across it.
      crossing = {0.5f, {}};
      crossing.normal[axis] = 1.0f;
    });
  return made_up;
}

/// Returns the number of a crossing edge, in the order of fill_block().
std::size_t LabelledGrid::number_of(std::int32_t block, int sample, int axis) const {
  const auto b = static_cast<std::size_t>(block);
  return first_[b] + solid_.blocks[b].rank(axis, sample);
}

EdgeCrossing LabelledGrid::crossing(std::int32_t block, int sample, int axis) const {
  return crossings_[number_of(block, sample, axis)];
}

std::array<std::uint32_t, 2> LabelledGrid::pieces(std::int32_t block, int sample, int axis) const {
  const EdgeSides& sides = sides_[number_of(block, sample, axis)];
  return {sides.back, sides.front};
}

bool LabelledGrid::is_of_one_piece(std::int32_t block, int cell, int face) const {
  const CornerLabels labels = corner_labels(solid_, {block, cell});
  const std::array<int, 4> corners = face_corners(face);
  // On an ambiguous face without a cut one diagonal is inside and the other outside.
  const int inside = labels[corners[0]] > 0 ? 0 : 1;
  return labels[corners[inside]] == labels[corners[inside + 2]];
}

std::size_t LabelledGrid::memory_bytes() const {
  std::size_t sheets = joint_sheets_.capacity() * sizeof(joint_sheets_[0]);
  for (const SheetsOfBlock& block : joint_sheets_) sheets += block.capacity() * sizeof(block[0]);
  return crossings_.capacity() * sizeof(EdgeCrossing) + sides_.capacity() * sizeof(EdgeSides) +
         cuts_.capacity() * sizeof(cuts_[0]) + solid_.blocks.capacity() * sizeof(solid_.blocks[0]) + sheets +
         solid_.labels.memory_bytes() + solid_.codes.memory_bytes();
}

namespace {

/// Returns true if the surface leaves only a point of a face between its two inside corners, as where the
/// solid touches itself in an edge, i.e. if for both corners the planes of the two crossings next to the
/// corner intersect the face in lines that meet in the same point of the face.
bool touches_in_a_point(const CellBlocks& cells, std::int32_t block, int cell, int face, int inside) {
  constexpr double kNear = 0.01;  // voxels
  const std::array<int, 4> edges = face_edges(face);
  const int u = ((face >> 1) + 1) % 3, v = ((face >> 1) + 2) % 3;
  const Eigen::Vector3d lower = cells.corner(block, cell);
  const auto tip = [&](int corner) {
    Eigen::Matrix2d normals;
    Eigen::Vector2d distances;
    for (int i = 0; i < 2; ++i) {
      const CellBlocks::Edge edge = cells.edge_of_cell(block, cell, edges[(corner + 3 * i) % 4]);
      const EdgeCrossing crossing = cells.grid().crossing(edge.block, edge.sample, edge.axis);
      const Eigen::Vector3d point = cells.crossing_point(edge, crossing) - lower;
      normals.row(i) << crossing.normal[u], crossing.normal[v];
      distances[i] = normals.row(i).dot(Eigen::Vector2d(point[u], point[v]));
    }
    return Eigen::Vector2d(normals.inverse() * distances);
  };
  // Two walls that face each other at a small angle also have a line of intersection, but far away. For
  // parallel walls its position is not finite, so the comparisons below are false.
  const Eigen::Vector2d first = tip(inside), second = tip(inside + 2);
  return (first - second).norm() < kNear && first.minCoeff() > -kNear && first.maxCoeff() < 1.0 + kNear;
}

}  // namespace

void find_joined_faces(LabelledSolid& solid, const FloatHermite& hermite, const Cutters& cutters,
                       RunContext& context) {
  // The solid is of one piece here, so this is the lattice of the whole: no cell is a joint, and faces are
  // cut by the normals of the original surface (CellBlocks::sheets()).
  const LabelledGrid grid(solid, hermite, cutters, context);
  const CellBlocks cells(grid, context);
  const Stage stage(context, "find joined faces");
  std::vector<std::vector<LabelledSolid::JoinedFace>> found(cells.size());
  parallel_blocks(cells.size(), context, [&](std::size_t b) {
    const auto block = static_cast<std::int32_t>(b);
    for_each_bit(cells[block].special, [&](int cell) {
      const CellSheets& sheets = cells.sheets(block, cell);
      const int signs = cells.corner_code(cells.cell_number(block, cell));
      const auto moved = [&](int steps) {  // a bit an axis, as of corners
        return solid.locate(block, (cell >> 6) + (steps & 1), ((cell >> 3) & 7) + ((steps >> 1) & 1),
                            (cell & 7) + (steps >> 2));
      };
      for (int face = 1; face < 6; face += 2) {  // the lower ones are upper ones of other cells
        if (!((sheets.ambiguous_faces >> face) & 1)) continue;
        const std::array<int, 4> edges = face_edges(face), corners = face_corners(face);
        const int inside = (signs >> corners[0]) & 1 ? 0 : 1;
        // Corner i lies between edges i − 1 and i of the face: a segment that joins these cuts it off.
        const bool is_cut_off = sheets.partner[face][edges[inside]] == edges[(inside + 3) % 4];
        if (!is_cut_off)
          found[b].push_back({{moved(corners[inside]), moved(corners[inside + 2])},
                              {moved(0), moved(1 << (face >> 1))},
                              touches_in_a_point(cells, block, cell, face, inside)});
      }
    });
  });
  // Lists of blocks follow one another in order of blocks, not of threads.
  solid.joined_faces.clear();
  for (const auto& list : found)
    solid.joined_faces.insert(solid.joined_faces.end(), list.begin(), list.end());
}

}  // namespace hermesh
