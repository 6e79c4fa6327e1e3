#include "algorithms/extraction/embedded_mesh/sheet_trials.h"

#include <Eigen/Geometry>
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

/// Six times the volume, in cubic voxels, that a tetrahedron of a fan must exceed: far above rounding of
/// doubles.
constexpr double kLeastOfFan = 1e-9;

bool operator<(const CellBlocks::Edge& a, const CellBlocks::Edge& b) {
  return std::tie(a.block, a.axis, a.sample) < std::tie(b.block, b.axis, b.sample);
}

/// The edges that are yet to be tested, and the cells that may be held for them. Its loops over blocks are
/// parallel, and each step writes only what belongs to its own block.
class Trials {
 public:
  Trials(const CellBlocks& cells, EdgePolygons& polygons, const FilePoints& file, UniformPoints& points,
         double farthest, RunContext& context)
      : cells_(cells),
        polygons_(polygons),
        file_(file),
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

  /// The cells that can be held and have a pinched face, across which there is a joint: held to their
  /// segments, they leave no edge with four polygons.
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

  /// Holds cells, and centres those that are held already; their edges are then to be tested again.
  void hold(const Cells& cells, RunContext& context) {
    Cells held, centred;
    for (const CellBlocks::Cell& cell : cells) (polygons_.is_held(cell) ? centred : held).push_back(cell);
    polygons_.hold(held, points_, context);
    if (!centred.empty()) centre(centred, context);
    mesh_.forget();
    for (const CellBlocks::Cell& cell : held) mark_edges(cell);
  }

  /// Returns the cells to be held or centred near polygons that meet, some more than once. Those polygons are
  /// to be tested again next time, the others are not.
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

  /// Moves the crossings of cells to the middles of their edges, and the points of all sheets there with
  /// them.
  void centre(const Cells& centred, RunContext& context) {
    polygons_.centre(centred);
    Cells touched;
    for (const CellBlocks::Cell& cell : centred)
      cells_.for_each_about(cell, 1, [&](const CellBlocks::Cell& at) {
        if (!cells_.is_plain(at.block, at.cell)) touched.push_back(at);
      });
    for (const CellBlocks::Cell& cell : touched)
      if (const int sheets = cells_.point_count(cell.block, cell.cell); sheets > 1)
        for (int sheet = 0; sheet < sheets; ++sheet)
          points_[cells_.point(cell.block, cell.cell, sheet)] = file_.rounded(mean_of_crossings(cell, sheet));
    polygons_.decide_again(touched, points_, context);
    for (const CellBlocks::Cell& cell : touched) mark_edges(cell);
  }
  Vector3d mean_of_crossings(const CellBlocks::Cell& cell, int sheet) const {
    const CellSheets& sheets = cells_.sheets(cell.block, cell.cell);
    Vector3d sum = Vector3d::Zero();
    int crossings = 0;
    for (int edge = 0; edge < 12; ++edge)
      if (sheets.sheet_of[edge] == sheet) {
        sum += polygons_.crossing_position(cells_.edge_of_cell(cell.block, cell.cell, edge));
        ++crossings;
      }
    return sum / crossings;
  }

  bool is_joint_of_several(const CellBlocks::Cell& cell) const {
    return cells_.is_joint(cell.block, cell.cell) && cells_.point_count(cell.block, cell.cell) > 1;
  }
  /// Whether the cell is one of those that nothing but a test keeps from meeting others.
  bool is_tried(const CellBlocks::Cell& cell) const {
    return is_joint_of_several(cell) || (polygons_.can_be_held(cell) && !polygons_.is_held(cell));
  }
  /// Adds the tried cells near two edges, or if there are none the held cells that are not centred yet.
  void add_tried(const CellBlocks::Edge& edge, const CellBlocks::Edge& other, Cells& found) const {
    if (!add_near(edge, other, found, [&](const CellBlocks::Cell& cell) { return is_tried(cell); }))
      add_near(edge, other, found, [&](const CellBlocks::Cell& cell) {
        return polygons_.is_held(cell) && !polygons_.is_centred(cell);
      });
  }
  /// Adds the wanted cells around both edges; if there are none those around one, around the other, or the
  /// nearest ones. Returns whether there are any.
  template <class Wanted>
  bool add_near(const CellBlocks::Edge& edge, const CellBlocks::Edge& other, Cells& found,
                Wanted&& is_wanted) const {
    const std::size_t before = found.size();
    const auto at_edge = cells_.around(edge).cells, at_other = cells_.around(other).cells;
    const auto add = [&](const CellBlocks::Cell& cell) {
      if (is_wanted(cell)) found.push_back(cell);
    };
    for (const CellBlocks::Cell& cell : at_edge)
      if (std::ranges::any_of(at_other, [&](const CellBlocks::Cell& c) {
            return c.block == cell.block && c.cell == cell.cell;
          }))
        add(cell);
    for (const auto* cells : {&at_edge, &at_other})
      if (found.size() == before) std::ranges::for_each(*cells, add);
    for (int steps = 1; found.size() == before && steps <= 2; ++steps)
      for (const CellBlocks::Edge& at : {edge, other})
        cells_.for_each_about({at.block, at.sample}, steps, add);
    return found.size() > before;
  }

  /// Whether a polygon of the edge meets another one; adds the tried cells near the first that does. Of two
  /// edges that are to be tested the first one asks.
  bool meets(const CellBlocks::Edge& edge, Cells& found) const {
    bool any = false;
    mesh_.for_each_triangle(edge, [&](const Triangle& t) {
      if (any) return;
      bool itself = false;
      mesh_.for_each_near(edge.block, mesh_.box_of(t), [&](const CellBlocks::Edge& other, const Triangle& u) {
        if (any || (other < edge && test(untested_[other.block][other.axis], other.sample))) return;
        // The search finds the triangle itself, once; a second one with the same corners is another and meets
        // it.
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
  const FilePoints& file_;
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

/// Returns the position of the point on a fanned edge: its crossing, or for a fan that is not tested, the
/// position as near to that as the eight tetrahedra of the fan allow.
Vector3d fan_point(const CellBlocks& cells, const EdgePolygons& polygons, const CellBlocks::Edge& edge,
                   const FilePoints& file, const UniformPoints& points) {
  const Vector3d crossing = polygons.crossing_position(edge), first = file.rounded(crossing);
  const CellBlocks::Around around = cells.around(edge);
  for (const CellBlocks::Cell& cell : around.cells)
    if (cells.point_count(cell.block, cell.cell) > 1 || polygons.can_be_held(cell)) return first;
  const Vector3d start = cells.corner(edge.block, edge.sample), along = Vector3d::Unit(edge.axis);
  const auto fits = [&](const Vector3d& point) {
    const Vector3d x = point - start;
    for (std::size_t i = 0; i < 4; ++i) {
      const Vector3d p = points[around.points[i]] - start, q = points[around.points[(i + 1) % 4]] - start;
      const double lower = p.cross(q).dot(x), upper = (q - along).cross(p - along).dot(x - along);
      if (!(lower > kLeastOfFan && upper > kLeastOfFan)) return false;
    }
    return true;
  };
  if (fits(first)) return first;
  const Vector3d to_middle = start + 0.5 * along - crossing;
  for (double part = 1.0 / 1024.0; part <= 1.0; part *= 2.0)
    if (const Vector3d moved = file.rounded(crossing + part * to_middle); fits(moved)) return moved;
  return first;
}

}  // namespace

void place_crossings(const CellBlocks& cells, const EdgePolygons& polygons, const FilePoints& file,
                     UniformPoints& points, RunContext& context) {
  points.extend(cells.point_count(), polygons.point_count());
  parallel_blocks(cells.size(), context, [&](std::size_t b) {
    for (int axis = 0; axis < 3; ++axis)
      for_each_bit(polygons.fanned(static_cast<std::int32_t>(b), axis), [&](int sample) {
        const CellBlocks::Edge edge{static_cast<std::int32_t>(b), sample, axis};
        points[polygons.crossing_point(edge)] = fan_point(cells, polygons, edge, file, points);
      });
  });
}

Cells hold_cells_that_meet(const CellBlocks& cells, EdgePolygons& polygons, const FilePoints& file,
                           UniformPoints& points, double farthest, RunContext& context) {
  Stage stage(context, "try sheets");
  Trials trials(cells, polygons, file, points, farthest, context);
  // Four polygons at an edge are no contact that the test would find.
  Cells held = trials.pinched();
  // Each round holds or centres one cell more at least, and none twice (add_tried()), so this ends. What is
  // held makes other polygons, with points on other edges: crossings are placed again before they are tested.
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
