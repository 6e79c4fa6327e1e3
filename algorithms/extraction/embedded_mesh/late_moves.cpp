#include "algorithms/extraction/embedded_mesh/late_moves.h"

#include <Eigen/Geometry>
#include <initializer_list>
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

/// More than rounding to the file's precision may move a place, in voxels: a place is tried as the file will hold it.
constexpr double kBoxMargin = 0.05;

/// How often all points are tried: one move makes room for another.
constexpr int kSweeps = 2;

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
          if (has_point(t)) star_.push_back(t);
        });
    // The places tried later lie between these and the point as it is, so all of them are in the box.
    box_ = {};
    for (const Vector3d& place : places) box_.add(place);
    for (const Triangle& t : star_)
      for (const std::uint32_t p : t) box_.add(points_[p]);
    box_.lower.array() -= kBoxMargin;
    box_.upper.array() += kBoxMargin;
  }

  /// Moves the point, if the mesh stays embedded. The mesh itself is changed for the trial, and changed back: no other
  /// thread looks at this part of it meanwhile (move_points()).
  bool moves_to(const Vector3d& place) {
    const Vector3d before = points_[point_];
    points_[point_] = place;
    const bool fits = is_embedded() && meets_nothing();
    if (!fits) points_[point_] = before;
    return fits;
  }

 private:
  bool has_point(const Triangle& t) const { return t[0] == point_ || t[1] == point_ || t[2] == point_; }

  bool is_embedded() const {
    for (std::size_t i = 0; i < star_.size(); ++i) {
      const Triangle& t = star_[i];
      const Vector3d across = (points_[t[1]] - points_[t[0]]).cross(points_[t[2]] - points_[t[0]]);
      if (across.norm() < kLeastArea) return false;
      for (std::size_t j = i + 1; j < star_.size(); ++j)
        if (!mesh_.apart(t, star_[j])) return false;
    }
    return true;
  }

  /// Whether the star meets no triangle around it. Those nearby are only looked for where a place has got so far.
  bool meets_nothing() {
    if (!nearby_) {
      nearby_.emplace();
      mesh_.for_each_near(block_, box_, [&](const CellBlocks::Edge&, const Triangle& t) {
        if (!has_point(t)) nearby_->push_back(t);
      });
    }
    for (const Triangle& t : star_) {
      const Bounds box = mesh_.box_of(t);
      for (const Triangle& other : *nearby_)
        if (box.overlaps(mesh_.box_of(other)) && !mesh_.apart(t, other)) return false;
    }
    return true;
  }

  const CellBlocks& cells_;
  const PolygonNeighbourhood& mesh_;
  UniformPoints& points_;
  std::int32_t block_ = 0;
  std::uint32_t point_ = 0;
  Bounds box_;
  std::vector<Triangle> star_;
  std::optional<std::vector<Triangle>> nearby_;
};

}  // namespace

void move_points(const CellBlocks& cells, const EdgePolygons& polygons,
                 const std::vector<std::vector<PointTarget>>& targets, const FilePoints& file,
                 UniformPoints& points, RunContext& context) {
  Stage stage(context, "move points");
  const PolygonNeighbourhood mesh(cells, polygons, points, kFarthestFromCell);
  // A point's polygons end two voxels from its cell. Those that might meet them belong to edges at most six samples away,
  // and have their points in cells at most seven away. So blocks of one parity, eight apart, do not see one another's moves.
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
          if ((target.place - from).norm() < kFulfilled || polygons.is_crowded({block, target.cell})) continue;
          star.gather(block, target.cell, {target.place, target.nearer});
          const Vector3d between = 0.5 * (target.place + target.nearer), halfway = 0.5 * (from + target.nearer);
          // From the best place to the least move: the target, half way from it to the nearer place, that, and the way
          // there by halves.
          for (const Vector3d& place :
               {target.place, between, target.nearer, halfway, Vector3d(0.5 * (from + halfway))}) {
            if ((place - from).norm() < kFulfilled) break;
            if (star.moves_to(file.rounded(place))) break;
          }
        }
      });
}

}  // namespace hermesh
