#include "algorithms/extraction/embedded_mesh/sheet_trials.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <tuple>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/embedded_mesh/polygon_neighbourhood.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using Cells = std::vector<CellBlocks::Cell>;

bool operator<(const CellBlocks::Edge& a, const CellBlocks::Edge& b) {
  return std::tie(a.block, a.axis, a.sample) < std::tie(b.block, b.axis, b.sample);
}

/// The edges that are yet to be tested, and the cells that may be held for them. Its loops over blocks are parallel,
/// and each step writes only what belongs to its own block.
class Trials {
 public:
  Trials(const CellBlocks& cells, EdgePolygons& polygons, UniformPoints& points, double farthest,
         RunContext& context)
      : cells_(cells),
        polygons_(polygons),
        mesh_(cells, polygons, points, farthest),
        points_(points),
        untested_(cells.size()) {
    // Lists by block, joined in the order of blocks: the same for every number of threads.
    std::vector<Cells> tried(cells_.size());
    parallel_blocks(cells_.size(), context, [&](std::size_t b) {
      const auto block = static_cast<std::int32_t>(b);
      for_each_bit(cells_[block].special, [&](int cell) {
        if (is_tried({block, cell})) tried[b].push_back({block, cell});
      });
    });
    tried_ = joined(tried);
    for (const CellBlocks::Cell& cell : tried_) mark_edges(cell);
  }

  /// The cells that can be held and have a pinched face, across which there is a joint: held to their segments, they
  /// leave no edge with four polygons.
  Cells pinched() const {
    Cells found;
    std::ranges::copy_if(tried_, std::back_inserter(found), [&](const CellBlocks::Cell& cell) {
      if (!polygons_.can_be_held(cell)) return false;
      for (int face = 0; face < 6; ++face)
        if (cells_.is_pinched(cell.block, cell.cell, face)) return true;
      return false;
    });
    return found;
  }

  /// Holds cells; the polygons of their edges are to be tested anew.
  void hold(const Cells& held, RunContext& context) {
    polygons_.hold(held, points_, context);
    mesh_.forget();
    for (const CellBlocks::Cell& cell : held) mark_edges(cell);
  }

  /// The tried cells near polygons that meet, some more than once. Those polygons are to be tested again next time, the
  /// others are not.
  Cells that_meet(RunContext& context) {
    std::vector<Cells> found(cells_.size());
    std::vector<std::vector<CellBlocks::Edge>> meeting(cells_.size());
    parallel_blocks(cells_.size(), context, [&](std::size_t b) {
      for (int axis = 0; axis < 3; ++axis)
        for_each_bit(untested_[b][axis], [&](int sample) {
          const CellBlocks::Edge edge{static_cast<std::int32_t>(b), sample, axis};
          if (meets(edge, found[b])) meeting[b].push_back(edge);
        });
    });
    // Only now, for above all blocks read which edges of others are untested.
    parallel_blocks(cells_.size(), context, [&](std::size_t b) {
      untested_.clear(b);
      for (const CellBlocks::Edge& edge : meeting[b]) mark(edge);
    });
    // In the order of blocks again; without_repeats() sorts them besides.
    return joined(found);
  }

 private:
  static Cells joined(const std::vector<Cells>& lists) {
    Cells all;
    for (const Cells& list : lists) all.insert(all.end(), list.begin(), list.end());
    return all;
  }
  void mark(const CellBlocks::Edge& edge) {
    BlockMask& edges = untested_.at(static_cast<std::size_t>(edge.block))[edge.axis];
    edges[edge.sample >> 6] |= std::uint64_t{1} << (edge.sample & 63);
  }
  void mark_edges(const CellBlocks::Cell& cell) {
    for (int edge = 0; edge < 12; ++edge)
      if (const CellBlocks::Edge at = cells_.edge_of_cell(cell.block, cell.cell, edge); cells_.is_crossed(at))
        mark(at);
  }

  bool is_joint_of_several(const CellBlocks::Cell& cell) const {
    return cells_.is_joint(cell.block, cell.cell) && cells_.point_count(cell.block, cell.cell) > 1;
  }
  /// Whether the cell is one of those that nothing but a test keeps from meeting others.
  bool is_tried(const CellBlocks::Cell& cell) const {
    return is_joint_of_several(cell) || (polygons_.can_be_held(cell) && !polygons_.is_held(cell));
  }
  /// Adds the tried cells around both edges; if there are none those around one, around the other, or the nearest ones.
  void add_tried(const CellBlocks::Edge& edge, const CellBlocks::Edge& other, Cells& found) const {
    const std::size_t before = found.size();
    const auto at_edge = cells_.around(edge).cells, at_other = cells_.around(other).cells;
    const auto add = [&](const CellBlocks::Cell& cell) {
      if (is_tried(cell)) found.push_back(cell);
    };
    for (const CellBlocks::Cell& cell : at_edge)
      if (std::ranges::any_of(at_other, [&](const CellBlocks::Cell& c) { return c.block == cell.block && c.cell == cell.cell; }))
        add(cell);
    for (const auto* cells : {&at_edge, &at_other})
      if (found.size() == before) std::ranges::for_each(*cells, add);
    for (int steps = 1; found.size() == before && steps <= 2; ++steps)
      for (const CellBlocks::Edge& at : {edge, other}) cells_.for_each_about({at.block, at.sample}, steps, add);
  }

  /// Whether a polygon of the edge meets another one; adds the tried cells near the first that does. Of two edges that
  /// are to be tested the first one asks.
  bool meets(const CellBlocks::Edge& edge, Cells& found) const {
    bool any = false;
    mesh_.for_each_triangle(edge, [&](const Triangle& t) {
      if (any) return;
      bool itself = false;
      mesh_.for_each_near(edge.block, mesh_.box_of(t), [&](const CellBlocks::Edge& other, const Triangle& u) {
        if (any || (other < edge && test(untested_[other.block][other.axis], other.sample))) return;
        // The search finds the triangle itself, once; a second one with the same corners is another and meets it.
        if (t == u && !itself) {
          itself = true;
        } else if (!mesh_.apart(t, u)) {
          add_tried(edge, other, found);
          any = true;
        }
      });
    });
    return any;
  }

  const CellBlocks& cells_;
  EdgePolygons& polygons_;
  PolygonNeighbourhood mesh_;
  UniformPoints& points_;
  Cells tried_;         ///< all that were when this began
  EdgeMasks untested_;  ///< edges whose polygons may meet others
};

Cells without_repeats(Cells cells) {
  const auto place = [](const CellBlocks::Cell& cell) { return std::pair(cell.block, cell.cell); };
  // By number, so that what is held is in one order, whoever found it.
  std::ranges::sort(cells, {}, place);
  const auto repeats = std::ranges::unique(cells, {}, place);
  cells.erase(repeats.begin(), repeats.end());
  return cells;
}

}  // namespace

void place_crossings(const CellBlocks& cells, const EdgePolygons& polygons, const FilePoints& file,
                     UniformPoints& points, RunContext& context) {
  points.extend(cells.point_count(), polygons.point_count());
  parallel_blocks(cells.size(), context, [&](std::size_t b) {
    for (int axis = 0; axis < 3; ++axis)
      for_each_bit(polygons.fanned(static_cast<std::int32_t>(b), axis), [&](int sample) {
        const CellBlocks::Edge edge{static_cast<std::int32_t>(b), sample, axis};
        points[polygons.crossing_point(edge)] = file.rounded(cells.crossing_point(edge));
      });
  });
}

Cells hold_cells_that_meet(const CellBlocks& cells, EdgePolygons& polygons, const FilePoints& file,
                           UniformPoints& points, double farthest, RunContext& context) {
  Stage stage(context, "try sheets");
  Trials trials(cells, polygons, points, farthest, context);
  // Four polygons at an edge are no contact that the test would find.
  Cells held = trials.pinched();
  // Each round holds one cell more at least, and no cell twice (is_tried()), so this ends. What is held makes other
  // polygons, with points on other edges: crossings are placed anew before they are tested.
  for (;;) {
    if (!held.empty()) trials.hold(held, context);
    place_crossings(cells, polygons, file, points, context);
    const Cells meeting = without_repeats(trials.that_meet(context));
    held.clear();
    // Joints remain where nothing else is left: they cannot be held.
    std::ranges::copy_if(meeting, std::back_inserter(held),
                         [&](const CellBlocks::Cell& cell) { return polygons.can_be_held(cell); });
    if (held.empty()) return meeting;
  }
}

}  // namespace hermesh
