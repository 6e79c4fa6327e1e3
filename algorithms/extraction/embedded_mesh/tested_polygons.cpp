#include "algorithms/extraction/embedded_mesh/tested_polygons.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <tuple>

#include "algorithms/core/bounds.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/contact/triangle_contact.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using Cells = std::vector<CellBlocks::Cell>;

/// The triangles of the uniform mesh by the block of their edge. Those of a block are listed on the first
/// request, from any thread.
class PolygonNeighbourhood {
 public:
  /// All arguments by reference must outlive this.
  /// @param cells cells of the lattice
  /// @param polygons forms of the edges; call forget() after a change
  /// @param points by number, including those of fanned edges; they may move
  /// @param farthest largest distance of any vertex from its cell along an axis, now or later, voxels
  PolygonNeighbourhood(const CellBlocks& cells, const EdgePolygons& polygons, const UniformPoints& points,
                       double farthest)
      : cells_(cells),
        polygons_(polygons),
        points_(points),
        reach_(1.0 + farthest + kRounding),
        lists_(cells.size()) {}
  ~PolygonNeighbourhood() { forget(); }
  PolygonNeighbourhood(const PolygonNeighbourhood&) = delete;
  PolygonNeighbourhood& operator=(const PolygonNeighbourhood&) = delete;

  /// Discards the lists, because the polygons have changed. Not concurrently with any other call.
  void forget() {
    for (auto& list : lists_) delete list.exchange(nullptr, std::memory_order_relaxed);
  }

  std::span<const Triangle> triangles_of(const CellBlocks::Edge& edge) const {
    return list_of(edge.block).triangles_of(number_of(edge));
  }
  /// Replaces the two triangles of a quad. Not while another thread reads them.
  void set_triangles(const CellBlocks::Edge& edge, const std::array<Triangle, 2>& triangles) {
    List& list = list_of(edge.block);
    std::ranges::copy(triangles, list.triangles.begin() + list.first[number_of(edge)]);
  }

  /// Calls f(edge, triangle) for all triangles whose boxes overlap `box`, which must not extend more than
  /// three voxels beyond the block. The triangles of an edge lie within `farthest` of the box of its four
  /// cells, so their edges begin at most five samples below the block or six above its last.
  template <class F>
  void for_each_near(std::int32_t block, const Bounds& box, F&& f) const {
    const Vector3d origin = cells_.corner(block, 0);
    int first[3], last[3];
    for (int a = 0; a < 3; ++a) {
      first[a] = static_cast<int>(std::ceil(box.lower[a] - origin[a] - reach_));
      last[a] = static_cast<int>(std::floor(box.upper[a] - origin[a] + reach_));
    }
    for (int x = first[0]; x <= last[0]; ++x)
      for (int y = first[1]; y <= last[1]; ++y)
        for (int z = first[2]; z <= last[2]; z = (z | 7) + 1)
          for_each_in_row(block, x, y, z, std::min(last[2], z | 7), box, f);
  }

  Bounds box_of(const Triangle& t) const {
    Bounds box;
    for (const std::uint32_t p : t) box.add(points_[p]);
    return box;
  }

  /// Returns true if two triangles certainly intersect only in their shared corners.
  bool apart(const Triangle& a, const Triangle& b) const { return certainly_apart(a, b, points_); }

 private:
  static constexpr double kRounding = 1e-3;  // far above that of points to the file's precision

  /// The triangles of a block's crossed edges, by the number of the edge.
  struct List {
    std::vector<std::uint32_t> first;
    std::vector<Triangle> triangles;
    std::span<const Triangle> triangles_of(std::uint32_t edge) const {
      return std::span(triangles).subspan(first[edge], first[edge + 1] - first[edge]);
    }
  };

  /// Returns the number of a crossed edge in its block, in the order of CellBlocks::for_each_crossing_edge().
  std::uint32_t number_of(const CellBlocks::Edge& edge) const {
    const auto& crossing = cells_.grid().blocks()[edge.block].crossing;
    std::uint32_t before = 0;
    for (int axis = 0; axis < edge.axis; ++axis) before += count(crossing[axis]);
    return before + rank_in(crossing[edge.axis], edge.sample);
  }

  List& list_of(std::int32_t block) const {
    auto& slot = lists_[block];
    if (List* list = slot.load(std::memory_order_acquire)) return *list;
    auto made = std::make_unique<List>();
    cells_.for_each_crossing_edge(block, [&](const CellBlocks::Edge& edge) {
      made->first.push_back(static_cast<std::uint32_t>(made->triangles.size()));
      if (!test(polygons_.edges(block, edge.axis), edge.sample)) return;
      const auto add = [&](const Triangle& t) { made->triangles.push_back(t); };
      polygons_.polygons_of(
          edge,
          [&](const Quad& q) {
            add({q[0], q[1], q[2]});
            add({q[0], q[2], q[3]});
          },
          add);
    });
    made->first.push_back(static_cast<std::uint32_t>(made->triangles.size()));
    List* before = nullptr;
    if (slot.compare_exchange_strong(before, made.get(), std::memory_order_acq_rel)) return *made.release();
    return *before;  // made by another thread meanwhile
  }

  /// Calls f(edge, triangle) for the crossed edges that begin at samples z to `end` of one row of a block.
  template <class F>
  void for_each_in_row(std::int32_t block, int x, int y, int z, int end, const Bounds& box, F&& f) const {
    const CellBlocks::Cell row = cells_.locate(block, x, y, z & ~7);
    if (row.block < 0) return;
    const unsigned wanted = (2u << (end & 7)) - (1u << (z & 7));
    for (int axis = 0; axis < 3; ++axis) {
      const BlockMask& crossing = cells_.grid().blocks()[row.block].crossing[axis];
      auto bits = static_cast<unsigned>(crossing[row.cell >> 6] >> (row.cell & 63)) & wanted;
      if (bits == 0) continue;
      const List& list = list_of(row.block);
      std::uint32_t number = number_of({row.block, row.cell + std::countr_zero(bits), axis});
      for (; bits != 0; bits &= bits - 1, ++number)
        for (const Triangle& t : list.triangles_of(number))
          if (box.overlaps(box_of(t)))
            f(CellBlocks::Edge{row.block, row.cell + std::countr_zero(bits), axis}, t);
    }
  }

  const CellBlocks& cells_;
  const EdgePolygons& polygons_;
  const UniformPoints& points_;
  const double reach_;  ///< of the triangles of an edge from its first sample along an axis, voxels
  mutable std::vector<std::atomic<List*>> lists_;  ///< one per block; null until requested
};

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

/// Twice the least area of a triangle after a move, in square voxels.
constexpr double kLeastArea = 1e-4;

/// More than rounding to the file's precision may move a position, in voxels: rounded positions are tested.
constexpr double kBoxMargin = 0.05;

/// Distance from a target that another vertex has reached, voxels.
constexpr double kBefore = 2e-3;

/// Passes over all vertices: one move makes room for another.
constexpr int kSweeps = 2;

/// Returns the solid angle of a triangle seen from q (van Oosterom & Strackee 1983), from −2π to 2π.
double solid_angle(const Vector3d& q, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d u = a - q, v = b - q, w = c - q;
  const double lu = u.norm(), lv = v.norm(), lw = w.norm();
  return 2.0 * std::atan2(u.dot(v.cross(w)), lu * lv * lw + u.dot(v) * lw + v.dot(w) * lu + w.dot(u) * lv);
}

/// A triangle of an edge's polygon, with the pieces behind and in front of it.
struct SidedTriangle {
  Triangle corners;
  std::array<std::uint32_t, 2> pieces;
  CellBlocks::Edge edge;
};

/// The polygons around the vertex of one cell, and those nearby that they might intersect.
class Star {
 public:
  Star(const CellBlocks& cells, const EdgePolygons& polygons, PolygonNeighbourhood& mesh,
       UniformPoints& points)
      : cells_(cells), polygons_(polygons), mesh_(mesh), points_(points) {}

  /// Starts with the vertex of a cell, its polygons and the box of the positions that it might move to.
  void gather(std::int32_t block, int cell, std::initializer_list<Vector3d> places) {
    block_ = block;
    point_ = cells_.point(block, cell, 0);
    star_.clear();
    nearby_.reset();
    // All polygons of the vertex belong to crossed edges of its cell. Of a quad both triangles count, because
    // it may be cut along its other diagonal.
    cells_.for_each_crossed_edge_of({block, cell}, [&](const CellBlocks::Edge& at) {
      const auto triangles = mesh_.triangles_of(at);
      const bool is_quad = !polygons_.is_fanned(at) && !triangles.empty() &&
                           (has_point(triangles[0]) || has_point(triangles[1]));
      for (const Triangle& t : triangles)
        if (is_quad || has_point(t)) star_.push_back(sided(t, at));
    });
    // The positions tried later lie between these and the vertices around, so the box contains all of them.
    box_ = {};
    for (const Vector3d& place : places) box_.add(place);
    for (const SidedTriangle& t : star_)
      for (const std::uint32_t p : t.corners) box_.add(points_[p]);
    box_.lower.array() -= kBoxMargin;
    box_.upper.array() += kBoxMargin;
  }

  /// Moves the vertex if the mesh stays embedded and its orientation is unchanged. Quads one of whose
  /// triangles has no area then, as with three corners on a crease, are cut along the other diagonal, and
  /// added to `turned`. The trial modifies the mesh itself, of which no other thread reads this part
  /// meanwhile (move_points()), and reverts it on failure.
  bool moves_to(const Vector3d& place, std::vector<CellBlocks::Edge>& turned) {
    const Vector3d before = points_[point_];
    points_[point_] = place;
    const std::vector<std::size_t> quads = turn_quads();
    const bool fits = is_embedded() && meets_nothing() && keeps_orientation(before);
    if (!fits) {
      points_[point_] = before;
      return false;
    }
    for (const std::size_t i : quads) {
      mesh_.set_triangles(moved_[i].edge, {moved_[i].corners, moved_[i + 1].corners});
      turned.push_back(moved_[i].edge);
    }
    return true;
  }

 private:
  SidedTriangle sided(const Triangle& t, const CellBlocks::Edge& edge) const {
    return {t, cells_.grid().pieces(edge.block, edge.sample, edge.axis), edge};
  }
  bool has_point(const Triangle& t) const { return t[0] == point_ || t[1] == point_ || t[2] == point_; }
  bool has_area(const Triangle& t) const {
    return (points_[t[1]] - points_[t[0]]).cross(points_[t[2]] - points_[t[0]]).norm() >= kLeastArea;
  }

  /// Sets `moved_` to the star with other diagonals where needed, and returns where their first triangles
  /// are.
  std::vector<std::size_t> turn_quads() {
    std::vector<std::size_t> turned;
    moved_ = star_;
    for (std::size_t i = 0; i + 1 < moved_.size(); ++i) {
      if (moved_[i].edge != moved_[i + 1].edge || polygons_.is_fanned(moved_[i].edge)) continue;
      const Triangle first = moved_[i].corners, second = moved_[i + 1].corners;
      if (!has_area(first) || !has_area(second)) {
        moved_[i].corners = {first[1], first[2], second[2]};
        moved_[i + 1].corners = {first[1], second[2], first[0]};
        turned.push_back(i);
      }
      ++i;
    }
    return turned;
  }

  bool is_embedded() const {
    for (std::size_t i = 0; i < moved_.size(); ++i) {
      const Triangle& t = moved_[i].corners;
      if (!has_area(t)) return false;
      for (std::size_t j = i + 1; j < moved_.size(); ++j)
        if (!mesh_.apart(t, moved_[j].corners)) return false;
    }
    return true;
  }

  /// Returns true if the star intersects no triangle around it. Those nearby are collected on the first call.
  bool meets_nothing() {
    if (!nearby_) {
      nearby_.emplace();
      mesh_.for_each_near(block_, box_, [&](const CellBlocks::Edge& edge, const Triangle& t) {
        const bool in_star = has_point(t) || std::ranges::any_of(star_, [&](const SidedTriangle& own) {
                               return own.edge == edge && !polygons_.is_fanned(edge);
                             });
        if (!in_star) nearby_->push_back(sided(t, edge));
      });
    }
    for (const SidedTriangle& t : moved_) {
      const Bounds box = mesh_.box_of(t.corners);
      for (const SidedTriangle& other : *nearby_)
        if (box.overlaps(mesh_.box_of(other.corners)) && !mesh_.apart(t.corners, other.corners)) return false;
    }
    return true;
  }

  /// Returns true if the orientation of the boundary of each piece at the vertex is as with the vertex at
  /// `before` (see move_points()). To be called after meets_nothing().
  bool keeps_orientation(const Vector3d& before) const {
    std::array<std::uint32_t, 2> last{};
    for (const SidedTriangle& t : star_) {
      if (t.pieces == last) continue;
      last = t.pieces;
      for (const std::uint32_t piece : t.pieces) {
        if (piece == 0) continue;
        const std::optional<Vector3d> beyond = place_beyond(piece);
        if (!beyond || std::abs(swept_angle(before, *beyond, piece)) > 2.0 * std::numbers::pi) return false;
      }
    }
    return true;
  }

  /// Returns the centroid of a triangle of a piece's boundary that shares a side with the star.
  std::optional<Vector3d> place_beyond(std::uint32_t piece) const {
    const auto has_piece = [&](const SidedTriangle& t) {
      return t.pieces[0] == piece || t.pieces[1] == piece;
    };
    for (const SidedTriangle& t : star_) {
      if (!has_piece(t)) continue;
      for (const SidedTriangle& other : *nearby_) {
        if (!has_piece(other)) continue;
        int common = 0;
        for (const std::uint32_t p : t.corners)
          common += p != point_ && std::ranges::find(other.corners, p) != other.corners.end();
        if (common == 2)
          return (points_[other.corners[0]] + points_[other.corners[1]] + points_[other.corners[2]]) / 3.0;
      }
    }
    return std::nullopt;
  }

  /// Returns 4π times the winding number about q of the region that a piece's boundary has swept since the
  /// vertex was at `before`.
  double swept_angle(const Vector3d& before, const Vector3d& q, std::uint32_t piece) const {
    double sum = 0.0;
    const auto add = [&](const SidedTriangle& t, const Vector3d& place, double sign) {
      if (t.pieces[0] != piece && t.pieces[1] != piece) return;
      std::array<Vector3d, 3> at;
      for (std::size_t k = 0; k < 3; ++k) at[k] = t.corners[k] == point_ ? place : points_[t.corners[k]];
      sum += (t.pieces[0] == piece ? sign : -sign) * solid_angle(q, at[0], at[1], at[2]);
    };
    for (const SidedTriangle& t : moved_) add(t, points_[point_], 1.0);
    for (const SidedTriangle& t : star_) add(t, before, -1.0);
    return sum;
  }

  const CellBlocks& cells_;
  const EdgePolygons& polygons_;
  PolygonNeighbourhood& mesh_;
  UniformPoints& points_;
  std::int32_t block_ = 0;
  std::uint32_t point_ = 0;
  Bounds box_;
  std::vector<SidedTriangle> star_;   ///< the two triangles of a quad one after the other
  std::vector<SidedTriangle> moved_;  ///< the same after the move that is tried
  std::optional<std::vector<SidedTriangle>> nearby_;
};

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

void move_points(const CellBlocks& cells, EdgePolygons& polygons,
                 const std::vector<std::vector<PointTarget>>& targets, const FilePoints& file,
                 UniformPoints& points, RunContext& context) {
  Stage stage(context, "move points");
  PolygonNeighbourhood mesh(cells, polygons, points, kFarthestFromCell);
  std::vector<std::vector<CellBlocks::Edge>> turned(cells.size());
  // A vertex so near to its target does not move.
  const double fulfilled = 2.0 * cells.margin();
  // A vertex's polygons end within two voxels of its cell. Those that might intersect them belong to edges at
  // most six samples away, with vertices in cells at most seven away. So moves in blocks of one parity, eight
  // samples apart, do not affect each other.
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (int parity = 0; parity < 8; ++parity)
      parallel_blocks(cells.size(), context, [&](std::size_t b) {
        if (targets[b].empty()) return;
        const auto block = static_cast<std::int32_t>(b);
        const auto& lower = cells.grid().blocks()[b].lower;
        if (((lower[0] >> 3 & 1) | (lower[1] >> 3 & 1) << 1 | (lower[2] >> 3 & 1) << 2) != parity) return;
        Star star(cells, polygons, mesh, points);
        for (const PointTarget& target : targets[b]) {
          const Vector3d from = points[cells.point(block, target.cell, 0)];
          if ((target.place - from).norm() < fulfilled || polygons.is_crowded({block, target.cell})) continue;
          star.gather(block, target.cell, {target.place, target.nearer});
          const Vector3d between = 0.5 * (target.place + target.nearer),
                         halfway = 0.5 * (from + target.nearer);
          // From the best position to the least move: the target, halfway from it to the nearer position,
          // that, just before the target, which may be the vertex of another cell, and one half and one
          // quarter of the distance to the nearer position.
          const Vector3d before = target.place + kBefore * (from - target.place).normalized();
          for (const Vector3d& place :
               {target.place, between, target.nearer, before, halfway, Vector3d(0.5 * (from + halfway))}) {
            if ((place - from).norm() < fulfilled) break;
            if (star.moves_to(file.rounded(place), turned[b])) break;
          }
        }
      });
  // Only now, because bits of several edges share a word.
  for (const auto& edges : turned)
    for (const CellBlocks::Edge& edge : edges) polygons.turn_quad(edge);
}

}  // namespace hermesh
