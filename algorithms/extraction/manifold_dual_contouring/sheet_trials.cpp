#include "algorithms/extraction/manifold_dual_contouring/sheet_trials.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/manifold_dual_contouring/polygon_neighbourhood.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using Cells = std::vector<CellBlocks::Cell>;

class Trials {
 public:
  Trials(const CellBlocks& cells, EdgePolygons& polygons, std::vector<Vector3d>& points, RunContext& context)
      : cells_(cells), polygons_(polygons), mesh_(cells, polygons, points), points_(points), candidates_(cells.size()) {
    parallel_blocks(cells_.size(), context, [&](std::size_t b) {
      const auto block = static_cast<std::int32_t>(b);
      for_each_bit(cells_[block].active, [&](int cell) {
        if (polygons_.can_be_held({block, cell}) || is_joint_of_several({block, cell}))
          candidates_[b].push_back({block, cell});
      });
    });
  }

  Cells not_worth_a_trial(RunContext& context) const {
    return gathered(context, [&](const CellBlocks::Cell& cell, Cells& found) {
      if (!polygons_.can_be_held(cell)) return;
      if (polygons_.is_crowded(cell) || would_be_pinched(cell.block, cell.cell)) found.push_back(cell);
    });
  }

  /// Tried cells with a polygon that meets another, and those of the other one.
  Cells that_meet(RunContext& context) const {
    return gathered(context, [&](const CellBlocks::Cell& cell, Cells& found) {
      if (!is_tried(cell)) return;
      for (int edge = 0; edge < 12; ++edge)
        if (const CellBlocks::Edge at = cells_.edge_of_cell(cell.block, cell.cell, edge); cells_.is_crossed(at))
          test_edge(at, found);
    });
  }

  void place_crossings(const FilePoints& file, RunContext& context) {
    points_.resize(polygons_.point_count());
    parallel_blocks(cells_.size(), context, [&](std::size_t b) {
      cells_.for_each_crossing_edge(static_cast<std::int32_t>(b), [&](const CellBlocks::Edge& edge) {
        if (polygons_.is_fanned(edge))
          points_[polygons_.crossing_point(edge)] = file.rounded(cells_.crossing_point(edge));
      });
    });
  }

 private:
  template <class F>
  Cells gathered(RunContext& context, F&& of_candidate) const {
    std::vector<Cells> found(cells_.size());
    parallel_blocks(cells_.size(), context, [&](std::size_t b) {
      for (const CellBlocks::Cell& cell : candidates_[b]) of_candidate(cell, found[b]);
    });
    Cells all;
    for (const Cells& some : found) all.insert(all.end(), some.begin(), some.end());
    return all;
  }

  /// Whether both segments of an ambiguous face belong to one sheet in either cell beside it: then four polygons would meet
  /// in the edge between the two cells' points.
  bool would_be_pinched(std::int32_t block, int cell) const {
    const CellSheets& own = cells_.sheets(block, cell);
    for (int face = 0; face < 6; ++face) {
      if (!((own.ambiguous_faces >> face) & 1)) continue;
      int at[3] = {cell >> 6, (cell >> 3) & 7, cell & 7};
      at[face >> 1] += face & 1 ? 1 : -1;
      const CellBlocks::Cell there = cells_.locate(block, at[0], at[1], at[2]);
      const auto has_one_sheet = [](const CellSheets& sheets, int f) {
        const std::array<int, 4> edges = face_edges(f);
        for (const int edge : edges)
          if (sheets.sheet_of[edge] != sheets.sheet_of[edges[0]]) return false;
        return true;
      };
      if (has_one_sheet(own, face) && has_one_sheet(cells_.sheets(there.block, there.cell), face ^ 1)) return true;
    }
    return false;
  }

  bool is_joint_of_several(const CellBlocks::Cell& cell) const {
    return cells_.is_joint(cell.block, cell.cell) && cells_.point_count(cell.block, cell.cell) > 1;
  }
  bool is_tried(const CellBlocks::Cell& cell) const {
    return is_joint_of_several(cell) || (polygons_.can_be_held(cell) && !polygons_.is_held(cell));
  }
  /// With those beside them, so that few rounds do.
  void add_tried(const CellBlocks::Edge& edge, Cells& found) const {
    cells_.for_each_about({edge.block, edge.sample}, 2, [&](const CellBlocks::Cell& cell) {
      if (is_tried(cell)) found.push_back(cell);
    });
  }

  void test_edge(const CellBlocks::Edge& edge, Cells& found) const {
    bool meets = false;
    mesh_.for_each_triangle(edge, [&](const Triangle& t) {
      if (meets) return;
      bool itself = false;
      mesh_.for_each_near(edge.block, mesh_.box_of(t), [&](const CellBlocks::Edge& other, const Triangle& u) {
        if (meets) return;
        if (t == u && !itself) {
          itself = true;
        } else if (!mesh_.apart(t, u)) {
          add_tried(edge, found);
          add_tried(other, found);
          meets = true;
        }
      });
    });
  }

  const CellBlocks& cells_;
  EdgePolygons& polygons_;
  const PolygonNeighbourhood mesh_;
  std::vector<Vector3d>& points_;
  std::vector<Cells> candidates_;  ///< by block: all that can be held, and joints of several sheets
};

Cells without_repeats(Cells cells) {
  const auto place = [](const CellBlocks::Cell& cell) { return std::pair(cell.block, cell.cell); };
  std::ranges::sort(cells, {}, place);
  const auto repeats = std::ranges::unique(cells, {}, place);
  cells.erase(repeats.begin(), repeats.end());
  return cells;
}

}  // namespace

Cells hold_cells_that_meet(const CellBlocks& cells, EdgePolygons& polygons, const FilePoints& file,
                           std::vector<Vector3d>& points, RunContext& context) {
  Stage stage(context, "try sheets");
  Trials trials(cells, polygons, points, context);
  Cells held = trials.not_worth_a_trial(context);
  for (;;) {
    if (!held.empty()) polygons.hold(held, points, context);
    trials.place_crossings(file, context);
    const Cells meeting = trials.that_meet(context);
    held.clear();
    std::ranges::copy_if(meeting, std::back_inserter(held),
                         [&](const CellBlocks::Cell& cell) { return polygons.can_be_held(cell); });
    if (held.empty()) return without_repeats(meeting);
  }
}

}  // namespace hermesh
