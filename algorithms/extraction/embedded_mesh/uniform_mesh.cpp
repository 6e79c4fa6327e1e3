#include "algorithms/extraction/embedded_mesh/uniform_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/dual_contouring/kernels/leaf_kernels.h"
#include "algorithms/extraction/dual_contouring/qef.h"
#include "algorithms/extraction/embedded_mesh/cell_records.h"
#include "algorithms/extraction/embedded_mesh/late_moves.h"
#include "algorithms/extraction/embedded_mesh/near_voxels.h"
#include "algorithms/extraction/embedded_mesh/tested_polygons.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Least deviation of the best position within the cell from the planes for a vertex to leave its cell, in
/// voxels, root mean square: a feature then passes outside.
constexpr double kWorthLeavingCell = 0.03;

/// Deviation from the planes up to which a position within the cell is accepted, in voxels, root mean square.
constexpr double kGoodEnough = 0.005;

/// Largest distance beyond a corner of a vertex that misses its third plane, voxels.
constexpr double kLongestSpur = 1.0;
/// Least distance before the corner that such a vertex is turned back to, about, voxels.
constexpr double kLeastBack = 0.1;

/// Least cosine of the angle between the directions of one crease in two cells.
constexpr double kSameLine = 0.9999;

/// Distance of a vertex from its target, which it has missed by little, voxels.
constexpr double kNextTo = 0.01;

/// Part of the distance from the boundary between voxels that is left for rounding, voxels.
constexpr double kRounding = 1e-4;

/// Least determinant, with terms of the order of one, that is certainly positive: far above rounding.
constexpr double kLeastVolume = 1e-5;

/// Returns six times the signed volume of a tetrahedron, voxels cubed.
double volume(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  return (b - a).cross(c - a).dot(d - a);
}

/// The steps of the uniform mesh: cells, vertices, moves by the rule of tetrahedra, polygons, late moves.
class UniformContourer {
 public:
  UniformContourer(const CellGrid& grid, const DualContouringOptions& options, const FilePoints& file,
                   RunContext& context, PolygonEdges* numbers, const UniformTiling& tiling = {},
                   const NearVoxels& near = {std::numeric_limits<double>::infinity()})
      : numbers_(numbers),
        tiling_(tiling),
        cells_(grid, context),
        options_(options),
        reach_(std::min(options.reach, kFarthestFromCell)),
        near_(near),
        file_(file),
        targets_(cells_.size()),
        corners_of_planes_(cells_.size()),
        corners_(cells_),
        points_(UniformPoints::of_few(cells_.point_count())) {
    counts_.cells = cells_.cell_count();
    if (grid.cuts().empty()) return;  // no joints
    for (std::size_t b = 0; b < cells_.size(); ++b) counts_.joints += count(cells_[b].joints);
  }

  const CellBlocks& cells() const { return cells_; }
  const UniformPoints& points() const { return points_; }
  const UniformCounts& counts() const { return counts_; }

  UniformMesh run(RunContext& context) {
    // The argument of the header concerns the vertices of the first two steps, by which the polygons are
    // made. Late moves change positions only.
    place_all_points(context);
    let_points_leave(context);
    const std::optional<EdgeMasks> edges = edges_of_active_cells(cells_, context);
    EdgePolygons polygons = connect(edges ? &*edges : nullptr, context);
    UniformMesh mesh;
    move_points(cells_, polygons, targets_, file_, points_, tiling_.side, context);
    fill(polygons, mesh, context);
    // Only vertices with a target can have left their cells.
    for_each_with_target([&](double outside) { counts_.escaped += outside > cells_.rounding().maxCoeff(); });
    mesh.missed = missed_targets();
    if (tiling_.keys) *tiling_.keys = vertex_keys(cells_, polygons, context);
    mesh.points = points_.take();
    mesh.counts = std::move(counts_);
    return mesh;
  }

  /// Computes the vertices of all active cells, replacing any previous ones.
  void place_all_points(RunContext& context) {
    points_ = UniformPoints::of_all(cells_.point_count());
    place_points_of([&](std::size_t b) { return cells_[b].active_mask(); }, context);
  }

  /// Computes the vertices of the cells in `wanted`, a mask per block of active cells without vertices.
  void place_points(std::span<const BlockMask> wanted, RunContext& context) {
    parallel_blocks(wanted.size(), context, [&](std::size_t b) {
      for_each_bit(wanted[b], [&](int cell) {
        const auto block = static_cast<std::int32_t>(b);
        for (int sheet = 0; sheet < cells_.point_count(block, cell); ++sheet)
          points_.ask(cells_.point(block, cell, sheet));
      });
    });
    points_.make_room();
    place_points_of([&](std::size_t b) { return wanted[b]; }, context);
  }

  /// Makes the polygons of `edges`, all crossed ones if null.
  EdgePolygons connect(const EdgeMasks* edges, RunContext& context) {
    EdgePolygons polygons = [&] {
      Stage stage(context, "connect");
      return EdgePolygons(cells_, corners_, points_, edges, context);
    }();
    // A later call adds edges of the same cells; holding others than before would change existing polygons.
    if (held_) {
      polygons.centre(centred_);
      if (!held_->empty()) polygons.hold(*held_, points_, context);
      place_crossings(cells_, polygons, file_, points_, context);
    } else {
      // Bounds the distance of the edges whose polygons may be near another polygon.
      double farthest = 0;
      for_each_with_target([&](double outside) { farthest = std::max(farthest, outside); });
      for (const CellBlocks::Cell& cell :
           hold_cells_that_meet(cells_, polygons, file_, points_, farthest, context))
        counts_.meeting_joints.emplace_back(cell.block, cell.cell);
      held_ = polygons.held_cells();
      centred_ = polygons.centred_cells();
    }
    counts_.held = held_->size();
    counts_.fanned_edges = polygons.fanned_edges();
    return polygons;
  }

 private:
  /// Computes the vertices of the active cells wanted(b) of each block b, for which there is room.
  template <class Wanted>
  void place_points_of(Wanted&& wanted, RunContext& context) {
    Stage stage(context, "place points");
    std::vector<std::uint32_t> several(cells_.size());
    parallel_blocks(cells_.size(), context, [&](std::size_t b) {
      const auto block = static_cast<std::int32_t>(b);
      const BlockMask asked = wanted(b);
      if (!any(asked)) return;
      const BlockMask placed = place_plain_cells(block, asked);
      for_each_bit(asked, [&](int cell) {
        if (test(placed, cell)) return;
        const int sheets = cells_.point_count(block, cell);
        several[b] += sheets > 1;
        for (int sheet = 0; sheet < sheets; ++sheet)
          points_[cells_.point(block, cell, sheet)] = file_.rounded(place(block, cell, sheet, sheets));
      });
    });
    for (const std::uint32_t found : several) counts_.several_sheets += found;
  }

  /// Computes the vertices of most of a block's wanted cells by vector code: plain ones, and in optimal
  /// placement only those with nearly parallel planes. Returns the cells placed; the others are left to the
  /// code for single cells.
  BlockMask place_plain_cells(std::int32_t block, const BlockMask& wanted) {
    BlockMask placed{};
    const bool average = options_.placement == DualContouringOptions::Placement::average;
    if (!average && options_.truncation < leaf_kernels::kLeastTruncation) return placed;
    thread_local CellRecords records;
    BlockMask near_ends;
    if (!records.read(cells_, block, near_ends)) return placed;
    constexpr std::size_t kMost = 512 + leaf_kernels::kLargestVector;
    std::array<std::uint16_t, kMost> cell{};
    std::array<std::array<float, kMost>, 3> place;
    std::array<std::uint8_t, kMost> is_placed;
    std::array<std::uint32_t, kMost> point;
    std::size_t found = 0;
    for_each_bit(wanted, [&](int at) {
      // Planes through a crossing near an end of its edge are those of single cells, which may get a target.
      if (!cells_.is_plain(block, at) || (has_exact_planes() && test(near_ends, at))) return;
      point[found] = cells_.point(block, at, 0);
      cell[found++] = static_cast<std::uint16_t>(at);
    });
    // The last vector reads beyond the end, where it must find cells; their results are ignored.
    for (std::size_t i = 0; i < leaf_kernels::kLargestVector; ++i) cell[found + i] = 0;
    float* const out[3] = {place[0].data(), place[1].data(), place[2].data()};
    const leaf_kernels::PlainCells plain{records.data(), cell.data(), static_cast<int>(found)};
    if (average) {
      kernels_.place_mean(plain, out);
      is_placed.fill(1);
    } else {
      // If vertices may leave, a cell far off its planes is left to best_place(), which records the target.
      // Otherwise any error is acceptable.
      kernels_.place_flat(
          plain,
          {.truncation = static_cast<float>(options_.truncation),
           .smooth_share = static_cast<float>(options_.smooth_share()),
           .margin = static_cast<float>(cells_.margin()),
           .most_error = static_cast<float>(reach_ > 0 ? kWorthLeavingCell * kWorthLeavingCell : 1e6),
           .most_error_held = static_cast<float>(kGoodEnough * kGoodEnough)},
          out, is_placed.data());
    }
    // So are vertices that the vector code held off a face, as where a plane cuts off a corner of the cell.
    const auto least = static_cast<float>(1.01 * cells_.margin());
    const auto is_held = [&](std::size_t i) {
      return has_exact_planes() && std::ranges::any_of(place, [&](const auto& along) {
               return along[i] < least || along[i] > 1.0f - least;
             });
    };
    for (std::size_t i = 0; i < found; ++i) {
      if (!is_placed[i] || is_held(i)) continue;
      set_bit(placed, cell[i]);
      points_[point[i]] = file_.rounded(near_voxels(
          block, cell[i], cells_.corner(block, cell[i]) + Vector3d(place[0][i], place[1][i], place[2][i])));
    }
    return placed;
  }

  /// Returns the position of a sheet's vertex within the cell, and records a better one outside. With several
  /// sheets it is the mean of the loop's crossings: in their hull, which is disjoint from those of other
  /// loops (cell_sheets.h).
  Vector3d place(std::int32_t block, int cell, int sheet, int sheets) {
    Vector3d sum = Vector3d::Zero();
    const Qef qef = planes_of(block, cell, sheet, sheets, sum);
    if (sheets > 1) return sum / qef.planes();
    if (options_.placement == DualContouringOptions::Placement::average)
      return near_voxels(block, cell,
                         cells_.is_plain(block, cell) ? qef.mass_point() : Vector3d(sum / qef.planes()));
    return near_voxels(block, cell, best_place(block, cell, qef, cells_.corner(block, cell)));
  }

  /// Returns the position, moved towards the middle of its cell if it is farther from the boundary between
  /// voxels than allowed. Within a cell this boundary consists of a quarter of a voxel's face for
  /// each crossed edge. These quarters have the middle of the cell in common, so distances from them shrink
  /// in proportion to that from the middle.
  Vector3d near_voxels(std::int32_t block, int cell, const Vector3d& place) const {
    const double most = near_.distance - kRounding;
    const Vector3d middle = cells_.corner(block, cell) + Vector3d::Constant(0.5), from = place - middle;
    if (from.norm() <= most) return place;
    double squared = std::numeric_limits<double>::infinity();
    for (int edge = 0; edge < 12; ++edge) {
      const int axis = edge_axis(edge);
      const CellBlocks::Edge at = cells_.edge_of_cell(block, cell, edge);
      if (!cells_.is_crossed(at)) continue;
      if (near_.not_on_boundary && test((*near_.not_on_boundary)[at.block][axis], at.sample)) continue;
      const std::array<int, 3> side = edge_offset(edge);
      double sum = from[axis] * from[axis];
      for (const int across : {(axis + 1) % 3, (axis + 2) % 3})
        if ((from[across] > 0) != (side[across] > 0)) sum += from[across] * from[across];
      squared = std::min(squared, sum);
    }
    if (squared <= most * most || std::isinf(squared)) return place;
    return middle + most / std::sqrt(squared) * from;
  }

  /// Returns the planes at the crossings of a sheet, and adds the positions of these, held within margin().
  Qef planes_of(std::int32_t block, int cell, int sheet, int sheets, Vector3d& sum) const {
    const bool plain = cells_.is_plain(block, cell);
    const CellSheets& loops = cells_.sheets(block, cell);
    Qef qef(cells_.corner(block, cell) + Vector3d::Constant(0.5));
    // A joint of one vertex has all crossed edges of its cell, including cuts, which sheet_of ignores.
    for (unsigned edges = plain ? kCrossedEdges[cells_.corner_code(cells_.cell_number(block, cell))] : 0xfffu;
         edges != 0; edges &= edges - 1) {
      const int edge = std::countr_zero(edges);
      if (sheets > 1 && loops.sheet_of[edge] != sheet) continue;
      const CellBlocks::Edge at = cells_.edge_of_cell(block, cell, edge);
      if (sheets == 1 && !plain && !cells_.is_crossed(at)) continue;
      const EdgeCrossing crossing = cells_.grid().crossing(at.block, at.sample, at.axis);
      const Vector3d held = cells_.crossing_point(at, crossing);
      Vector3d point = held;
      if (has_exact_planes()) point[at.axis] = cells_.corner(at.block, at.sample)[at.axis] + crossing.offset;
      const auto& n = crossing.normal;
      qef.add_plane(point, Vector3d(n[0], n[1], n[2]));
      sum += held;
    }
    return qef;
  }

  /// Returns true if a position is so near to another one that only the distance from a face of the cell
  /// parts them.
  bool is_at(const Vector3d& p, const Vector3d& q) const {
    return (p - q).cwiseAbs().maxCoeff() <= 2.0 * cells_.margin();
  }

  /// Returns true if the planes of the QEF are those of the data, even where a crossing is nearer to an end
  /// of its edge than margin(). Vertices on the faces of their cells, where this matters, then become
  /// targets.
  bool has_exact_planes() const {
    return reach_ > 0 && options_.placement != DualContouringOptions::Placement::average;
  }

  /// Returns the position within the cell, margin() off its faces, with the least error, drawn back on smooth
  /// surfaces. A better one nearer to a face is recorded as a target. If the position is far from the planes,
  /// as near a sharp feature that passes outside, or if these intersect elsewhere, the unconstrained
  /// minimiser is recorded instead.
  Vector3d best_place(std::int32_t block, int cell, const Qef& qef, const Vector3d& corner) {
    const Vector3d margin = Vector3d::Constant(cells_.margin());
    const Vector3d lower = corner + margin, upper = corner + Vector3d::Ones() - margin;
    const Vector3d free = qef.minimiser(options_.truncation), middle = qef.mass_point(),
                   mass = middle.cwiseMax(lower).cwiseMin(upper);
    const double share = qef.share_of_minimiser(options_.smooth_share(), options_.truncation);
    // Clamping the minimiser is cheap and usually sufficient, unlike the search over faces, edges and
    // corners.
    const Vector3d nearest = free.cwiseMax(lower).cwiseMin(upper);
    // Planes from a level set never intersect exactly in one point, and nearly do so only by chance.
    const bool meet = reach_ > 0 && !options_.linear_crossings && qef.planes_meet(free, nearest);
    if (reach_ > 0 && !options_.linear_crossings && cells_.is_plain(block, cell) &&
        qef.has_corner(free, options_.truncation))
      corners_of_planes_[block].push_back(cell);
    if (!meet && qef.error(nearest) <= kGoodEnough * kGoodEnough * qef.planes()) {
      const Vector3d place = mass + share * (nearest - mass), best = middle + share * (free - middle);
      if (has_exact_planes() && best != place && is_at(best, place))
        targets_[block].push_back({cell, best, best});
      return place;
    }
    const Vector3d held = qef.minimiser_within(lower, upper, options_.truncation);
    if (reach_ > 0 && (qef.error(held) > kWorthLeavingCell * kWorthLeavingCell * qef.planes() ||
                       (meet && qef.planes_meet(free, held)))) {
      const auto is_near = [&](const Vector3d& p) {
        return (p - corner - Vector3d::Constant(0.5)).cwiseAbs().maxCoeff() <= 0.5 + reach_;
      };
      // If the minima form a line or a plane, the one nearest to the position in the cell needs the shortest
      // move.
      const Vector3d nearer = qef.minimiser_near(held, options_.truncation);
      if (is_near(free)) targets_[block].push_back({cell, free, is_near(nearer) ? nearer : free});
    }
    return mass + share * (held - mass);
  }

  /// Turns back vertices on creases that lie beyond the corner where the crease ends: a cell next to that of
  /// the corner may not contain the third plane, so nothing else ends its line.
  void turn_spurs(RunContext& context) {
    std::vector<std::vector<std::pair<CellBlocks::Cell, PointTarget>>> turned(targets_.size());
    parallel_blocks(targets_.size(), context, [&](std::size_t b) {
      for (const int cell : corners_of_planes_[b])
        turn_spurs_at({static_cast<std::int32_t>(b), cell}, turned[b]);
    });
    for (const auto& list : turned)
      for (const auto& [cell, target] : list) {
        std::vector<PointTarget>& targets = targets_[cell.block];
        const auto at = std::ranges::lower_bound(targets, cell.cell, {}, &PointTarget::cell);
        if (at != targets.end() && at->cell == cell.cell)
          *at = target;
        else
          targets.insert(at, target);
      }
  }

  /// Adds targets for the vertices beyond a corner: those near it on a line through it that goes on for
  /// longer on the other side only.
  void turn_spurs_at(const CellBlocks::Cell& corner,
                     std::vector<std::pair<CellBlocks::Cell, PointTarget>>& turned) const {
    struct OnLine {
      CellBlocks::Cell cell;
      Vector3d along;  ///< direction of the crease
      double at;       ///< position from the corner
    };
    std::vector<OnLine> found;
    const Vector3d end = preferred_place(corner);
    cells_.for_each_about(corner, 2, [&](const CellBlocks::Cell& cell) {
      if (cell == corner || !cells_.is_plain(cell.block, cell.cell)) return;
      const Vector3d from_end = preferred_place(cell) - end;
      Vector3d ignored = Vector3d::Zero();
      const Vector3d along = planes_of(cell.block, cell.cell, 0, 1, ignored).line(options_.truncation);
      const double at = along.dot(from_end);
      if (!along.isZero() && (from_end - at * along).squaredNorm() < Qef::kMeet * Qef::kMeet)
        found.push_back({cell, along, at});
    });
    for (const OnLine& one : found) {
      double before = 0, beyond = 0, next = 1e30;  // farthest on either side, and nearest on the other side
      for (const OnLine& other : found) {
        const double turn = one.along.dot(other.along);
        if (std::abs(turn) < kSameLine) continue;
        const double at = std::copysign(other.at, other.at * turn * one.at);  // negative: on the other side
        if (at > 0) beyond = std::max(beyond, at);
        if (at < 0) before = std::max(before, -at), next = std::min(next, -at);
      }
      // Other lines, as a convex crease that becomes a concave one, go on.
      if (beyond > kLongestSpur || before < 1.5 * kLongestSpur) continue;
      // Distinct for distinct positions beyond the corner, and not so near to it that they block its vertex.
      const double far = kLeastBack + std::abs(one.at), back = std::min(next, 1.0) * far / (1.0 + far);
      const Vector3d place = end - std::copysign(back, one.at) * one.along;
      turned.emplace_back(one.cell, PointTarget{one.cell.cell, place, place});
    }
  }

  /// Returns the target of a cell of one sheet, or the position of its vertex if it has none.
  Vector3d preferred_place(const CellBlocks::Cell& cell) const {
    const std::vector<PointTarget>& list = targets_[cell.block];
    const auto target = std::ranges::lower_bound(list, cell.cell, {}, &PointTarget::cell);
    return target != list.end() && target->cell == cell.cell
               ? target->place
               : points_[cells_.point(cell.block, cell.cell, 0)];
  }

  /// Lets vertices leave their cells by the rule of tetrahedra. Cells of one parity share no face, so their
  /// vertices move independently: eight rounds, each with a result that does not depend on the order.
  void let_points_leave(RunContext& context) {
    Stage stage(context, "let points leave");
    turn_spurs(context);
    corners_.move(targets_);
    for (int parity = 0; parity < 8; ++parity)
      parallel_blocks(cells_.size(), context, [&](std::size_t b) {
        for (const PointTarget& target : targets_[b]) {
          const int x = target.cell >> 6, y = (target.cell >> 3) & 7, z = target.cell & 7;
          if (((x & 1) | (y & 1) << 1 | (z & 1) << 2) == parity) leave(static_cast<std::int32_t>(b), target);
        }
      });
  }

  /// Calls f(distance) for all vertices with a target: how far it is out of its cell along an axis, negative
  /// inside.
  template <class F>
  void for_each_with_target(F&& f) const {
    for (std::size_t b = 0; b < cells_.size(); ++b)
      for (const PointTarget& target : targets_[b]) {
        const auto block = static_cast<std::int32_t>(b);
        const Vector3d from_middle = points_[cells_.point(block, target.cell, 0)] -
                                     cells_.corner(block, target.cell) - Vector3d::Constant(0.5);
        f(from_middle.cwiseAbs().maxCoeff() - 0.5);
      }
  }

  /// Returns the targets that vertices have not reached although they are next to them.
  std::vector<MissedTarget> missed_targets() const {
    std::vector<MissedTarget> result;
    for (std::size_t b = 0; b < cells_.size(); ++b)
      for (const PointTarget& target : targets_[b]) {
        const std::uint32_t point = cells_.point(static_cast<std::int32_t>(b), target.cell, 0);
        const Vector3d place = file_.rounded(target.place);
        if (place != points_[point] && (place - points_[point]).norm() < kNextTo)
          result.push_back({point, place});
      }
    std::ranges::sort(result, {}, &MissedTarget::point);
    return result;
  }

  /// Moves the vertex of one cell as far towards its target as its 24 tetrahedra remain positive. Cells with
  /// explicit faces, and those next to them, do not move: the cones over their segments require it
  /// (uniform_mesh.h).
  void leave(std::int32_t block, const PointTarget& target) {
    if (cells_.has_explicit_face(block, target.cell)) return;
    Vector3d& point = points_[cells_.point(block, target.cell, 0)];
    const int x = target.cell >> 6, y = (target.cell >> 3) & 7, z = target.cell & 7;
    std::array<Vector3d, 8> corners;
    for (int c = 0; c < 8; ++c) {
      const std::array<int, 3> d = corner_offset(c);
      corners[c] = corners_.at(block, x + d[0], y + d[1], z + d[2]);
    }
    std::array<Vector3d, 6> beside;
    for (int face = 0; face < 6; ++face) {
      const std::optional<Vector3d> there = point_beside(block, target.cell, face);
      if (!there) return;
      beside[face] = *there;
    }
    unsigned crossed = 0;  // a bit an edge
    for (int edge = 0; edge < 12; ++edge)
      crossed |= unsigned(cells_.is_crossed(cells_.edge_of_cell(block, target.cell, edge))) << edge;
    const auto moves_to = [&](const Vector3d& place) {
      const Vector3d candidate = file_.rounded(place);
      if (!tetrahedra_are_positive(corners, candidate, beside, crossed, cells_.rounding())) return false;
      point = candidate;
      return true;
    };
    if (moves_to(target.place)) return;
    if (is_at(target.place, point)) return;  // a part of the margin is no gain
    // Fractions of the distance, because the target may be just out of reach.
    for (const double share : {0.75, 0.5, 0.25})
      if (moves_to(point + share * (target.place - point))) return;
  }

  /// Returns the vertex of the cell beyond a face, the centre of an inactive one (which no polygon uses, but
  /// the tetrahedra do), or nothing if that cell has an explicit face.
  std::optional<Vector3d> point_beside(std::int32_t block, int cell, int face) const {
    int at[3] = {cell >> 6, (cell >> 3) & 7, cell & 7};
    const int step = face & 1 ? 1 : -1;
    at[face >> 1] += step;
    const CellBlocks::Cell there = cells_.locate(block, at[0], at[1], at[2]);
    if (there.block < 0 || !test(cells_[there.block].active, there.cell)) {
      Vector3d middle = cells_.corner(block, cell) + Vector3d::Constant(0.5);
      middle[face >> 1] += step;
      return middle;
    }
    if (cells_.has_explicit_face(there.block, there.cell)) return std::nullopt;
    return points_[cells_.point(there.block, there.cell, 0)];
  }

  /// Returns true if all tetrahedra of a lattice edge of the cell, its vertex and that of an adjacent cell
  /// are positively oriented, and those of crossed edges remain so if divided by a point up to `aside` from
  /// the middle of the edge.
  static bool tetrahedra_are_positive(const std::array<Vector3d, 8>& at, const Vector3d& point,
                                      const std::array<Vector3d, 6>& beside, unsigned crossed,
                                      const Vector3d& aside) {
    for (int face = 0; face < 6; ++face) {
      const std::array<int, 4> corners = face_corners(face), edges = face_edges(face);
      for (int i = 0; i < 4; ++i) {
        // Corners run counter-clockwise for a viewer whom the face's axis points at.
        const double v = volume(at[corners[i]], at[corners[(i + 1) % 4]], point, beside[face]);
        if ((face & 1 ? v : -v) < kLeastVolume) return false;
        // Either part has half of the volume, of which the offset leaves at least a tenth (fan_point()).
        if (!(crossed >> edges[i] & 1)) continue;
        for (const int end : {i, (i + 1) % 4}) {
          const Vector3d to_point = point - at[corners[end]], to_beside = beside[face] - at[corners[end]];
          if (std::abs(v) < 2.5 * aside.dot(to_point.cross(to_beside).cwiseAbs())) return false;
        }
      }
    }
    return true;
  }

  /// Writes the polygons of each block to the positions counted by EdgePolygons, and the numbers of their
  /// edges if requested.
  void fill(const EdgePolygons& polygons, UniformMesh& mesh, RunContext& context) const {
    Stage stage(context, "connect");
    mesh.quads.resize(polygons.quad_count());
    mesh.triangles.resize(polygons.triangle_count());
    std::vector<std::uint64_t> first(cells_.size());  // number of each block's first edge
    if (numbers_) {
      for (std::size_t b = 0; b < cells_.size(); ++b)
        for (const BlockMask& edges : cells_.source(b).crossing) first[b] += count(edges);
      exclusive_scan(first, "edge crossings");
      numbers_->quads.resize(mesh.quads.size());
      numbers_->triangles.resize(mesh.triangles.size());
    }
    parallel_blocks(cells_.size(), context, [&](std::size_t b) {
      const auto block = static_cast<std::int32_t>(b);
      std::uint32_t quad = polygons.first_quad(block), triangle = polygons.first_triangle(block);
      auto number = static_cast<std::uint32_t>(first[b]);
      PlainPoints near;
      near.read(cells_, block);
      cells_.for_each_crossing_edge(block, [&](const CellBlocks::Edge& edge) {
        const std::uint32_t own = number++;
        if (!test(polygons.edges(block, edge.axis), edge.sample)) return;
        polygons.polygons_of(
            edge,
            [&](const Quad& q) {
              if (numbers_) numbers_->quads[quad] = own;
              mesh.quads[quad++] = q;
            },
            [&](const Triangle& t) {
              if (numbers_) numbers_->triangles[triangle] = own;
              mesh.triangles[triangle++] = t;
            },
            &near);
      });
    });
  }

  PolygonEdges* const numbers_;
  const UniformTiling tiling_;
  CellBlocks cells_;
  const DualContouringOptions options_;
  const double reach_;  ///< largest distance of vertices from their cells, voxels
  const NearVoxels near_;
  const FilePoints& file_;
  const leaf_kernels::Kernels& kernels_ = chosen_kernels<leaf_kernels::Kernels>();
  std::vector<std::vector<PointTarget>> targets_;    ///< one list per block, ascending by cell
  std::vector<std::vector<int>> corners_of_planes_;  ///< cells whose planes meet in one point, by block
  TetrahedronCorners corners_;
  UniformPoints points_;
  UniformCounts counts_;
  /// The cells held, as found by the first connect(): the edges that they depend on are part of every
  /// request.
  std::optional<std::vector<CellBlocks::Cell>> held_;
  std::vector<CellBlocks::Cell> centred_;  ///< likewise
};

/// The lattice of Hermite data, which have no cuts.
class HermiteCells : public CellGrid {
 public:
  explicit HermiteCells(const HermiteView& view, const UniformTiling& tiling = {})
      : view_(view), tiling_(tiling) {}
  const HermiteView::Blocks& blocks() const override { return view_.blocks(); }
  const IndexToWorld& placement() const override { return view_.placement(); }
  bool is_complete(const std::array<std::int32_t, 3>& lower) const override {
    for (int a = 0; a < 3; ++a)
      if (lower[a] < tiling_.known.lower[a] || lower[a] >= tiling_.known.upper[a]) return false;
    return true;
  }
  SampleBox whole() const override { return tiling_.whole; }
  EdgeCrossing crossing(std::int32_t block, int sample, int axis) const override {
    return view_.crossing(block, sample, axis);
  }
  void crossings(std::int32_t block, EdgeCrossing* out) const override { view_.crossings(block, out); }

 private:
  const HermiteView& view_;
  const UniformTiling tiling_;
};

}  // namespace

UniformMesh uniform_mesh(const HermiteView& grid, const DualContouringOptions& options,
                         const FilePoints& file, RunContext& context, const UniformTiling& tiling) {
  return UniformContourer(HermiteCells(grid, tiling), options, file, context, nullptr, tiling).run(context);
}

struct UniformCells::Made {
  Made(const HermiteView& view, const DualContouringOptions& options, const FilePoints& file,
       RunContext& context)
      : grid(view),
        contourer(grid, options, file, context, nullptr),
        placed(filled(contourer.cells().size(), BlockMask{}, context)) {}

  // Before the contourer, which refers to it.
  const HermiteCells grid;
  UniformContourer contourer;
  LargeArray<BlockMask> placed;  ///< cells of each block with vertices
};

UniformCells::UniformCells(const HermiteView& grid, const DualContouringOptions& options,
                           const FilePoints& file, RunContext& context)
    : made_(std::make_unique<Made>(grid, options, file, context)) {}
UniformCells::~UniformCells() = default;

const CellBlocks& UniformCells::cells() const { return made_->contourer.cells(); }
const UniformPoints& UniformCells::points() const { return made_->contourer.points(); }
const UniformCounts& UniformCells::counts() const { return made_->contourer.counts(); }

void UniformCells::place(std::span<const BlockMask> wanted, RunContext& context) {
  // Vertices that polygons were made from must not move.
  LargeArray<BlockMask> missing(wanted.size());
  parallel_blocks(missing.size(), context, [&](std::size_t b) {
    for (std::size_t word = 0; word < missing[b].size(); ++word) {
      missing[b][word] = wanted[b][word] & ~made_->placed[b][word];
      made_->placed[b][word] |= wanted[b][word];
    }
  });
  made_->contourer.place_points(missing, context);
}

void UniformCells::place_all(RunContext& context) {
  for (std::size_t b = 0; b < made_->placed.size(); ++b) made_->placed[b] = cells()[b].active_mask();
  made_->contourer.place_all_points(context);
}

EdgePolygons UniformCells::connect(const EdgeMasks* edges, RunContext& context) {
  return made_->contourer.connect(edges, context);
}

UniformMesh uniform_mesh(const CellGrid& grid, const DualContouringOptions& options, const FilePoints& file,
                         RunContext& context, PolygonEdges* edges) {
  return UniformContourer(grid, options, file, context, edges).run(context);
}

UniformMesh uniform_mesh_near_voxels(const CellGrid& grid, DualContouringOptions options,
                                     const NearVoxels& near, const FilePoints& file, RunContext& context,
                                     PolygonEdges* edges) {
  options.reach = 0.0;
  return UniformContourer(grid, options, file, context, edges, {}, near).run(context);
}

}  // namespace hermesh
