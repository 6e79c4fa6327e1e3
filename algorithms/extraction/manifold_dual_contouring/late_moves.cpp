#include "algorithms/extraction/manifold_dual_contouring/late_moves.h"

#include <Eigen/Geometry>
#include <cmath>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/manifold_dual_contouring/triangle_contact.h"
#include "algorithms/extraction/manifold_dual_contouring/triangle_grid.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Twice the area, in squared voxels, that a triangle must keep.
constexpr double kLeastArea = 1e-4;

/// Voxels from where it would rather be that are not worth a move.
constexpr double kFulfilled = 1e-3;

/// One move makes room for another.
constexpr int kSweeps = 3;

/// The point of one cell with the triangles around it and those nearby. Kept from point to point for its memory.
class Neighbourhood {
 public:
  Neighbourhood(const CellBlocks& cells, const EdgePolygons& polygons, std::vector<Vector3d>& points)
      : cells_(cells), polygons_(polygons), points_(points) {}

  void gather(std::int32_t block, int cell, std::uint32_t point, std::initializer_list<Vector3d> places) {
    point_ = point;
    star_.clear();
    nearby_.clear();
    for (int edge = 0; edge < 12; ++edge)
      if (const CellBlocks::Edge at = cells_.edge_of_cell(block, cell, edge); cells_.is_crossed(at))
        for_each_triangle(at, [&](const Triangle& t) {
          if (has_point(t)) star_.push_back(t);
        });
    box_ = {};
    for (const Vector3d& place : places) box_.add(place);
    for (const Triangle& t : star_)
      for (const std::uint32_t p : t) box_.add(points_[p]);
    gather_nearby(block);
  }

  /// Whether the mesh stays embedded if the point, now at its old place, is moved.
  bool may_move_to(const Vector3d& place) {
    const Vector3d before = points_[point_];
    points_[point_] = place;
    const bool fits = star_is_embedded() && star_meets_nothing();
    if (!fits) points_[point_] = before;
    return fits;
  }

 private:
  template <class F>
  void for_each_triangle(const CellBlocks::Edge& edge, F&& f) const {
    polygons_.polygons_of(
        edge,
        [&](const Quad& q) {
          f(Triangle{q[0], q[1], q[2]});
          f(Triangle{q[0], q[2], q[3]});
        },
        f);
  }
  bool has_point(const Triangle& t) const { return t[0] == point_ || t[1] == point_ || t[2] == point_; }

  /// The triangles of an edge lie in the box of its four cells and kFarthestFromCell around it.
  void gather_nearby(std::int32_t block) {
    const Vector3d origin = cells_.corner(block, 0);
    int first[3], last[3];
    for (int a = 0; a < 3; ++a) {
      first[a] = static_cast<int>(std::floor(box_.lower[a] - origin[a] - 2.0 - kFarthestFromCell));
      last[a] = static_cast<int>(std::ceil(box_.upper[a] - origin[a] + 1.0 + kFarthestFromCell));
    }
    for (int x = first[0]; x <= last[0]; ++x)
      for (int y = first[1]; y <= last[1]; ++y)
        for (int z = first[2]; z <= last[2]; ++z) {
          const CellBlocks::Cell at = cells_.locate(block, x, y, z);
          if (at.block < 0) continue;
          for (int axis = 0; axis < 3; ++axis)
            if (const CellBlocks::Edge edge{at.block, at.cell, axis}; cells_.is_crossed(edge))
              for_each_triangle(edge, [&](const Triangle& t) {
                if (!has_point(t) && box_.overlaps(box_of(t))) nearby_.push_back(t);
              });
        }
  }

  Box3 box_of(const Triangle& t) const {
    Box3 box;
    for (const std::uint32_t p : t) box.add(points_[p]);
    return box;
  }

  bool apart(Triangle a, Triangle b) const {
    int shared = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = shared; j < 3; ++j)
        if (a[i] == b[j]) {
          std::swap(a[i], a[shared]);
          std::swap(b[j], b[shared]);
          ++shared;
          break;
        }
    if (shared == 3) return false;
    const auto corners = [&](const Triangle& t) { return Corners{points_[t[0]], points_[t[1]], points_[t[2]]}; };
    return certainly_apart(corners(a), corners(b), shared);
  }

  bool star_is_embedded() const {
    for (std::size_t i = 0; i < star_.size(); ++i) {
      const Triangle& t = star_[i];
      const Vector3d across = (points_[t[1]] - points_[t[0]]).cross(points_[t[2]] - points_[t[0]]);
      if (across.norm() < kLeastArea) return false;
      for (std::size_t j = i + 1; j < star_.size(); ++j)
        if (!apart(t, star_[j])) return false;
    }
    return true;
  }

  bool star_meets_nothing() const {
    for (const Triangle& t : star_) {
      const Box3 box = box_of(t);
      for (const Triangle& other : nearby_)
        if (box.overlaps(box_of(other)) && !apart(t, other)) return false;
    }
    return true;
  }

  const CellBlocks& cells_;
  const EdgePolygons& polygons_;
  std::vector<Vector3d>& points_;
  std::uint32_t point_ = 0;
  Box3 box_;
  std::vector<Triangle> star_, nearby_;
};

}  // namespace

std::uint64_t move_points(const CellBlocks& cells, const EdgePolygons& polygons,
                          const std::vector<std::vector<PointWish>>& wishes, const FilePoints& file,
                          std::vector<Vector3d>& points, RunContext& context) {
  Stage stage(context, "move points");
  std::vector<std::uint64_t> moved(cells.size());
  // A point's polygons end two voxels from its cell. Those that might meet them belong to edges at most five samples away,
  // and have their points in cells at most six away. So blocks of one parity, eight apart, do not see one another's moves.
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (int parity = 0; parity < 8; ++parity)
      parallel_blocks(cells.size(), context, [&](std::size_t b) {
        if (wishes[b].empty()) return;
        const auto block = static_cast<std::int32_t>(b);
        const auto& lower = cells.grid().blocks()[b].lower;
        if (((lower[0] >> 3 & 1) | (lower[1] >> 3 & 1) << 1 | (lower[2] >> 3 & 1) << 2) != parity) return;
        Neighbourhood around(cells, polygons, points);
        for (const PointWish& wish : wishes[b]) {
          const std::uint32_t point = cells.point(block, wish.cell, 0);
          const Vector3d from = points[point];
          if ((wish.place - from).norm() < kFulfilled) continue;
          around.gather(block, wish.cell, point, {wish.place, wish.nearer});
          const Vector3d between = 0.5 * (wish.place + wish.nearer), halfway = 0.5 * (from + wish.nearer);
          for (const Vector3d& place :
               {wish.place, between, wish.nearer, halfway, Vector3d(0.5 * (from + halfway))}) {
            if ((place - from).norm() < kFulfilled) break;
            if (!around.may_move_to(file.rounded(place))) continue;
            ++moved[b];
            break;
          }
        }
      });
  std::uint64_t sum = 0;
  for (const std::uint64_t n : moved) sum += n;
  return sum;
}

}  // namespace hermesh
