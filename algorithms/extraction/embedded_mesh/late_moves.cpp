#include "algorithms/extraction/embedded_mesh/late_moves.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <optional>

#include "algorithms/core/bounds.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/embedded_mesh/polygon_neighbourhood.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

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

  /// Returns the direction from a place to that vertex around this one which is most towards it: on a
  /// polyhedron such a vertex lies in a plane through the place, and so does the segment.
  Vector3d direction_from(const Vector3d& place) const {
    const Vector3d back = (points_[point_] - place).normalized();
    Vector3d best = back;
    double most = -1.0;
    for (const SidedTriangle& t : star_)
      for (const std::uint32_t p : t.corners) {
        const Vector3d there = points_[p] - place;
        if (p == point_ || there.norm() < 10.0 * kBefore) continue;
        if (const double along = there.normalized().dot(back); along > most)
          most = along, best = there.normalized();
      }
    return best;
  }

  /// Moves the vertex if the mesh stays embedded and its orientation is unchanged. Quads one of whose
  /// triangles has no area then, as with three corners on a crease, are cut along the other diagonal, and
  /// added to `turned`. The trial modifies the mesh itself, of which no other thread reads this part
  /// meanwhile (move_points()), and reverts it on failure.
  bool moves_to(const Vector3d& place, std::vector<CellBlocks::Edge>& turned) {
    const Vector3d before = points_[point_];
    areas_.clear();
    for (const SidedTriangle& t : star_) areas_.push_back(area(t.corners));
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
  double area(const Triangle& t) const {
    return (points_[t[1]] - points_[t[0]]).cross(points_[t[2]] - points_[t[0]]).norm();
  }
  /// Returns true if the triangle of number i in the star, or in its place, has an area: at least half of
  /// what it had before the move if that was small, as at margins of cells.
  bool has_area(std::size_t i, const Triangle& t) const {
    return area(t) >= std::min(kLeastArea, t == star_[i].corners ? 0.5 * areas_[i] : kLeastArea);
  }

  /// Sets `moved_` to the star with other diagonals where needed, and returns where their first triangles
  /// are.
  std::vector<std::size_t> turn_quads() {
    std::vector<std::size_t> turned;
    moved_ = star_;
    for (std::size_t i = 0; i + 1 < moved_.size(); ++i) {
      if (moved_[i].edge != moved_[i + 1].edge || polygons_.is_fanned(moved_[i].edge)) continue;
      const Triangle first = moved_[i].corners, second = moved_[i + 1].corners;
      if (!has_area(i, first) || !has_area(i + 1, second)) {
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
      if (!has_area(i, t)) return false;
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
  std::vector<double> areas_;         ///< of the star before the move, twice
  std::vector<SidedTriangle> moved_;  ///< the same after the move that is tried
  std::optional<std::vector<SidedTriangle>> nearby_;
};

/// Returns true if the cells of a block are fewer than kStillCells from the faces of their tile: with a whole
/// number of blocks in either length, all or none are.
bool is_at_face_of_tile(const std::array<std::int32_t, 3>& lower, int tile) {
  static_assert(kStillCells == 8);
  return std::ranges::any_of(lower, [&](std::int32_t from) {
    const int within = (from % tile + tile) % tile;
    return within < kStillCells || within >= tile - kStillCells;
  });
}

}  // namespace

void move_points(const CellBlocks& cells, EdgePolygons& polygons,
                 const std::vector<std::vector<PointTarget>>& targets, const FilePoints& file,
                 UniformPoints& points, int tile, RunContext& context) {
  Stage stage(context, "move points");
  PolygonNeighbourhood mesh(cells, polygons, points, kFarthestFromCell);
  std::vector<std::vector<CellBlocks::Edge>> turned(cells.size());
  // A vertex so near to its target moves to the target itself or not at all.
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
        if (tile > 0 && is_at_face_of_tile(lower, tile)) return;
        Star star(cells, polygons, mesh, points);
        for (const PointTarget& target : targets[b]) {
          const Vector3d from = points[cells.point(block, target.cell, 0)];
          if (file.rounded(target.place) == from || polygons.is_crowded({block, target.cell})) continue;
          star.gather(block, target.cell, {target.place, target.nearer});
          const Vector3d between = 0.5 * (target.place + target.nearer),
                         halfway = 0.5 * (from + target.nearer);
          // From the best position to the least move: the target, halfway from it to the nearer position,
          // that, just before the target, which may be the vertex of another cell, and one half and one
          // quarter of the distance to the nearer position.
          const Vector3d before = target.place + kBefore * star.direction_from(target.place);
          for (const Vector3d& place :
               {target.place, between, target.nearer, before, halfway, Vector3d(0.5 * (from + halfway))}) {
            if (star.moves_to(file.rounded(place), turned[b]) || (place - from).norm() < fulfilled) break;
          }
        }
      });
  // Only now, because bits of several edges share a word.
  for (const auto& edges : turned)
    for (const CellBlocks::Edge& edge : edges) polygons.turn_quad(edge);
}

}  // namespace hermesh
