#include "algorithms/extraction/embedded_mesh/tested_polygons.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>
#include <tuple>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/embedded_mesh/polygon_neighbourhood.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using Cells = std::vector<CellBlocks::Cell>;

/// Six times the least volume, in cubic voxels, of a tetrahedron of a fan: far above rounding of doubles.
constexpr double kLeastOfFan = 1e-9;

bool operator<(const CellBlocks::Edge& a, const CellBlocks::Edge& b) {
  return std::tie(a.block, a.axis, a.sample) < std::tie(b.block, b.axis, b.sample);
}

/// The edges still to be tested, and the cells that may be held for them. In parallel loops over blocks, each
/// step writes only its own block's data.
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

  /// Returns the cells that can be held and have a pinched face, beyond which there is a joint. When held,
  /// they leave no edge with four polygons.
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

  /// Holds cells, and centres those already held; schedules their edges for a test.
  void hold(const Cells& cells, RunContext& context) {
    Cells held, centred;
    for (const CellBlocks::Cell& cell : cells) (polygons_.is_held(cell) ? centred : held).push_back(cell);
    polygons_.hold(held, points_, context);
    if (!centred.empty()) centre(centred, context);
    mesh_.forget();
    for (const CellBlocks::Cell& cell : held) mark_edges(cell);
  }

  /// Returns the cells to be held or centred near intersecting polygons, each once and ascending. Only those
  /// polygons are tested again next time.
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
    // Afterwards, because the loop above reads the untested edges of other blocks.
    parallel_blocks(cells_.size(), context, [&](std::size_t b) {
      untested_.clear(b);
      for (const CellBlocks::Edge& edge : meeting[b]) mark(edge);
    });
    Cells all = joined(found);
    std::ranges::sort(all);
    const auto repeats = std::ranges::unique(all);
    all.erase(repeats.begin(), repeats.end());
    return all;
  }

 private:
  static Cells joined(const std::vector<Cells>& lists) {
    Cells all;
    for (const Cells& list : lists) all.insert(all.end(), list.begin(), list.end());
    return all;
  }
  void mark(const CellBlocks::Edge& edge) { set_bit(untested_.at(edge.block)[edge.axis], edge.sample); }
  void mark_edges(const CellBlocks::Cell& cell) {
    cells_.for_each_crossed_edge_of(cell, [&](const CellBlocks::Edge& at) { mark(at); });
  }

  /// Moves the crossings of cells to the middles of their edges, and the vertices of all sheets there with
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
  /// Returns true if only a test can exclude that the cell's polygons intersect others.
  bool is_tried(const CellBlocks::Cell& cell) const {
    return is_joint_of_several(cell) || (polygons_.can_be_held(cell) && !polygons_.is_held(cell));
  }
  /// Adds the tested cells near two edges or, if there are none, the held cells that are not yet centred.
  void add_tried(const CellBlocks::Edge& edge, const CellBlocks::Edge& other, Cells& found) const {
    if (!add_near(edge, other, found, [&](const CellBlocks::Cell& cell) { return is_tried(cell); }))
      add_near(edge, other, found, [&](const CellBlocks::Cell& cell) {
        return polygons_.is_held(cell) && !polygons_.is_centred(cell);
      });
  }
  /// Adds the wanted cells around both edges; if there are none, those around one, around the other, or the
  /// nearest ones. Returns true if any were found.
  template <class Wanted>
  bool add_near(const CellBlocks::Edge& edge, const CellBlocks::Edge& other, Cells& found,
                Wanted&& is_wanted) const {
    const std::size_t before = found.size();
    const auto at_edge = cells_.around(edge).cells, at_other = cells_.around(other).cells;
    const auto add = [&](const CellBlocks::Cell& cell) {
      if (is_wanted(cell)) found.push_back(cell);
    };
    for (const CellBlocks::Cell& cell : at_edge)
      if (std::ranges::find(at_other, cell) != at_other.end()) add(cell);
    for (const auto* cells : {&at_edge, &at_other})
      if (found.size() == before) std::ranges::for_each(*cells, add);
    for (int steps = 1; found.size() == before && steps <= 2; ++steps)
      for (const CellBlocks::Edge& at : {edge, other})
        cells_.for_each_about({at.block, at.sample}, steps, add);
    return found.size() > before;
  }

  /// Returns true if a polygon of the edge intersects another one, and adds the tested cells near the first
  /// such pair. If both edges are to be tested, only the first of them tests the pair.
  bool meets(const CellBlocks::Edge& edge, Cells& found) const {
    bool any = false;
    std::ranges::for_each(mesh_.triangles_of(edge), [&](const Triangle& t) {
      if (any) return;
      bool itself = false;
      mesh_.for_each_near(edge.block, mesh_.box_of(t), [&](const CellBlocks::Edge& other, const Triangle& u) {
        if (any || (other < edge && test(untested_[other.block][other.axis], other.sample))) return;
        // The search returns the triangle itself once; another one with the same corners intersects it.
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
  Cells tried_;         ///< as of the construction
  EdgeMasks untested_;  ///< edges whose polygons may intersect others
};

/// Returns the position of the vertex on a fanned edge: its crossing or, for a fan that is not tested, as
/// near to that as the eight tetrahedra of the fan allow.
Vector3d fan_point(const CellBlocks& cells, const EdgePolygons& polygons, const CellBlocks::Edge& edge,
                   const FilePoints& file, const UniformPoints& points) {
  const Vector3d crossing = polygons.crossing_position(edge), first = file.rounded(crossing);
  const CellBlocks::Around around = cells.around(edge);
  for (const CellBlocks::Cell& cell : around.cells)
    if (cells.point_count(cell.block, cell.cell) > 1 || polygons.can_be_held(cell)) return first;
  const auto [start, along] = polygons.corners().ends(edge);
  const auto fits = [&](const Vector3d& point) {
    const Vector3d x = point - start;
    for (std::size_t i = 0; i < 4; ++i) {
      const Vector3d p = points[around.points[i]] - start, q = points[around.points[(i + 1) % 4]] - start;
      const double lower = p.cross(q).dot(x), upper = (q - along).cross(p - along).dot(x - along);
      if (!(lower > kLeastOfFan && upper > kLeastOfFan)) return false;
    }
    return true;
  };
  if (polygons.corners().has_moved(edge.block)) {
    Vector3d exact = cells.corner(edge.block, edge.sample);
    exact[edge.axis] += cells.grid().crossing(edge.block, edge.sample, edge.axis).offset;
    if (const Vector3d place = file.rounded(exact); fits(place)) return place;
  }
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
  // The contact test does not detect four polygons at an edge.
  Cells held = trials.pinched();
  // Each round holds or centres at least one more cell, and none twice (add_tried()), so this terminates.
  // Held cells get other polygons, with vertices on other edges, so crossings are placed again before the
  // test.
  for (;;) {
    if (!held.empty()) trials.hold(held, context);
    place_crossings(cells, polygons, file, points, context);
    const Cells meeting = trials.that_meet(context);
    held.clear();
    // Only joints, which cannot be held, may remain.
    std::ranges::copy_if(meeting, std::back_inserter(held),
                         [&](const CellBlocks::Cell& cell) { return polygons.can_be_held(cell); });
    if (held.empty()) return meeting;
  }
}

}  // namespace hermesh
