#include "algorithms/extraction/embedded_mesh/late_moves.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <optional>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/embedded_mesh/polygon_neighbourhood.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Twice the area, in squared voxels, that a triangle must keep.
constexpr double kLeastArea = 1e-4;

/// A point this near to where it would rather be, in voxels, is not worth a move.
constexpr double kFulfilled = 1e-3;

/// More than rounding to the file's precision may move a place, in voxels: a place is tried as the file will
/// hold it.
constexpr double kBoxMargin = 0.05;

/// How often all points are tried: one move makes room for another.
constexpr int kSweeps = 2;

/// Returns the solid angle of a triangle seen from q (van Oosterom & Strackee 1983), from −2π to 2π.
double solid_angle(const Vector3d& q, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d u = a - q, v = b - q, w = c - q;
  const double lu = u.norm(), lv = v.norm(), lw = w.norm();
  return 2.0 * std::atan2(u.dot(v.cross(w)), lu * lv * lw + u.dot(v) * lw + v.dot(w) * lu + w.dot(u) * lv);
}

/// A triangle with the pieces behind and in front of it.
struct SidedTriangle {
  Triangle corners;
  std::array<std::uint32_t, 2> pieces;
};

/// The triangles around the point of one cell, and those nearby that they might meet.
class Star {
 public:
  Star(const CellBlocks& cells, const PolygonNeighbourhood& mesh, UniformPoints& points)
      : cells_(cells), mesh_(mesh), points_(points) {}

  /// Takes up the point of a cell, with its triangles and the box of all places that it might move to.
  void gather(std::int32_t block, int cell, std::initializer_list<Vector3d> places) {
    block_ = block;
    point_ = cells_.point(block, cell, 0);
    star_.clear();
    nearby_.reset();
    // All polygons that have the point belong to crossing edges of its cell.
    for (int edge = 0; edge < 12; ++edge)
      if (const CellBlocks::Edge at = cells_.edge_of_cell(block, cell, edge); cells_.is_crossed(at))
        mesh_.for_each_triangle(at, [&](const Triangle& t) {
          if (has_point(t)) star_.push_back(sided(t, at));
        });
    // The places tried later lie between these and the point as it is, so all of them are in the box.
    box_ = {};
    for (const Vector3d& place : places) box_.add(place);
    for (const SidedTriangle& t : star_)
      for (const std::uint32_t p : t.corners) box_.add(points_[p]);
    box_.lower.array() -= kBoxMargin;
    box_.upper.array() += kBoxMargin;
  }

  /// Moves the point, if the mesh stays embedded and keeps its orientation. The mesh itself is changed for
  /// the trial, and changed back: no other thread looks at this part of it meanwhile (move_points()).
  bool moves_to(const Vector3d& place) {
    const Vector3d before = points_[point_];
    points_[point_] = place;
    const bool fits = is_embedded() && meets_nothing() && keeps_orientation(before);
    if (!fits) points_[point_] = before;
    return fits;
  }

 private:
  SidedTriangle sided(const Triangle& t, const CellBlocks::Edge& edge) const {
    return {t, cells_.grid().pieces(edge.block, edge.sample, edge.axis)};
  }
  bool has_point(const Triangle& t) const { return t[0] == point_ || t[1] == point_ || t[2] == point_; }

  bool is_embedded() const {
    for (std::size_t i = 0; i < star_.size(); ++i) {
      const Triangle& t = star_[i].corners;
      const Vector3d across = (points_[t[1]] - points_[t[0]]).cross(points_[t[2]] - points_[t[0]]);
      if (across.norm() < kLeastArea) return false;
      for (std::size_t j = i + 1; j < star_.size(); ++j)
        if (!mesh_.apart(t, star_[j].corners)) return false;
    }
    return true;
  }

  /// Whether the star meets no triangle around it. Those nearby are only looked for where a place has got so
  /// far.
  bool meets_nothing() {
    if (!nearby_) {
      nearby_.emplace();
      mesh_.for_each_near(block_, box_, [&](const CellBlocks::Edge& edge, const Triangle& t) {
        if (!has_point(t)) nearby_->push_back(sided(t, edge));
      });
    }
    for (const SidedTriangle& t : star_) {
      const Bounds box = mesh_.box_of(t.corners);
      for (const SidedTriangle& other : *nearby_)
        if (box.overlaps(mesh_.box_of(other.corners)) && !mesh_.apart(t.corners, other.corners)) return false;
    }
    return true;
  }

  /// Returns whether the boundary of each piece at the point is oriented as it was when the point was at
  /// `before` (late_moves.h). To be called after meets_nothing().
  bool keeps_orientation(const Vector3d& before) const {
    std::array<std::uint32_t, 2> last{};
    for (const auto& [t, pieces] : star_) {
      if (pieces == last) continue;
      last = pieces;
      for (const std::uint32_t piece : pieces) {
        if (piece == 0) continue;
        const std::optional<Vector3d> beyond = place_beyond(t, piece);
        if (!beyond || std::abs(swept_angle(before, *beyond, piece)) > 2.0 * std::numbers::pi) return false;
      }
    }
    return true;
  }

  /// Returns the middle of the triangle of a piece's boundary that lies across the side opposite the point.
  std::optional<Vector3d> place_beyond(const Triangle& t, std::uint32_t piece) const {
    for (const auto& [other, pieces] : *nearby_) {
      if (pieces[0] != piece && pieces[1] != piece) continue;
      int common = 0;
      for (const std::uint32_t p : t) common += p != point_ && std::ranges::find(other, p) != other.end();
      if (common == 2) return (points_[other[0]] + points_[other[1]] + points_[other[2]]) / 3.0;
    }
    return std::nullopt;
  }

  /// Returns 4π times the winding number about q of what a piece's boundary has swept over since the point
  /// was at `before`.
  double swept_angle(const Vector3d& before, const Vector3d& q, std::uint32_t piece) const {
    double sum = 0.0;
    for (const auto& [t, pieces] : star_) {
      if (pieces[0] != piece && pieces[1] != piece) continue;
      const std::size_t k = t[0] == point_ ? 0 : t[1] == point_ ? 1 : 2;
      const Vector3d &a = points_[t[(k + 1) % 3]], &b = points_[t[(k + 2) % 3]];
      const double angle = solid_angle(q, points_[point_], a, b) - solid_angle(q, before, a, b);
      sum += pieces[0] == piece ? angle : -angle;
    }
    return sum;
  }

  const CellBlocks& cells_;
  const PolygonNeighbourhood& mesh_;
  UniformPoints& points_;
  std::int32_t block_ = 0;
  std::uint32_t point_ = 0;
  Bounds box_;
  std::vector<SidedTriangle> star_;
  std::optional<std::vector<SidedTriangle>> nearby_;
};

}  // namespace

void move_points(const CellBlocks& cells, const EdgePolygons& polygons,
                 const std::vector<std::vector<PointTarget>>& targets, const FilePoints& file,
                 UniformPoints& points, RunContext& context) {
  Stage stage(context, "move points");
  const PolygonNeighbourhood mesh(cells, polygons, points, kFarthestFromCell);
  // A point's polygons end two voxels from its cell. Those that might meet them belong to edges at most six
  // samples away, and have their points in cells at most seven away. So blocks of one parity, eight apart, do
  // not see one another's moves.
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (int parity = 0; parity < 8; ++parity)
      parallel_blocks(cells.size(), context, [&](std::size_t b) {
        if (targets[b].empty()) return;
        const auto block = static_cast<std::int32_t>(b);
        const auto& lower = cells.grid().blocks()[b].lower;
        if (((lower[0] >> 3 & 1) | (lower[1] >> 3 & 1) << 1 | (lower[2] >> 3 & 1) << 2) != parity) return;
        Star star(cells, mesh, points);
        for (const PointTarget& target : targets[b]) {
          const Vector3d from = points[cells.point(block, target.cell, 0)];
          if ((target.place - from).norm() < kFulfilled || polygons.is_crowded({block, target.cell}))
            continue;
          star.gather(block, target.cell, {target.place, target.nearer});
          const Vector3d between = 0.5 * (target.place + target.nearer),
                         halfway = 0.5 * (from + target.nearer);
          // From the best place to the least move: the target, half way from it to the nearer place, that,
          // and the way there by halves.
          for (const Vector3d& place :
               {target.place, between, target.nearer, halfway, Vector3d(0.5 * (from + halfway))}) {
            if ((place - from).norm() < kFulfilled) break;
            if (star.moves_to(file.rounded(place))) break;
          }
        }
      });
}

}  // namespace hermesh
