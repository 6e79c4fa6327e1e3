#include "algorithms/extraction/manifold_dual_contouring/late_moves.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <initializer_list>
#include <optional>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/manifold_dual_contouring/polygon_neighbourhood.h"
#include "algorithms/voxelization/triangle_tree.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Twice the area, in squared voxels, that a triangle must keep.
constexpr double kLeastArea = 1e-4;

/// Voxels from where it would rather be that are not worth a move.
constexpr double kFulfilled = 1e-3;

/// More than rounding to the file's precision may move a place, in voxels.
constexpr double kRounding = 0.05;

/// Fans at a cell that are made quads together.
constexpr std::size_t kMostFans = 4;

/// One move makes room for another.
constexpr int kSweeps = 2;

/// The point of one cell with the triangles around it and those nearby.
class Star {
 public:
  Star(const CellBlocks& cells, EdgePolygons& polygons, std::vector<Vector3d>& points)
      : cells_(cells), polygons_(polygons), mesh_(cells, polygons, points), points_(points) {}

  /// With the box of all places that it might move to.
  void gather(std::int32_t block, int cell, std::initializer_list<Vector3d> places) {
    block_ = block;
    cell_ = cell;
    point_ = cells_.point(block, cell, 0);
    gather_triangles();
    fans_.clear();
    for_each_edge([&](const CellBlocks::Edge& edge) {
      if (polygons_.is_fanned(edge) && polygons_.can_be_flattened(edge)) fans_.push_back(edge);
    });
    box_ = {};
    for (const Vector3d& place : places) box_.add(place);
    for (const Triangle& t : star_)
      for (const std::uint32_t p : t) box_.add(points_[p]);
    for (const CellBlocks::Edge& edge : fans_)
      for (const std::uint32_t p : cells_.around(edge).points) box_.add(points_[p]);
    box_.lower.array() -= kRounding;
    box_.upper.array() += kRounding;
  }

  /// Moves the point, if the mesh stays embedded; if need be the fans at its edges become quads.
  bool moves_to(const Vector3d& place) {
    const Vector3d before = points_[point_];
    points_[point_] = place;
    if (fits() || fits_without_fans()) return true;
    points_[point_] = before;
    return false;
  }

 private:
  template <class F>
  void for_each_edge(F&& f) const {
    for (int edge = 0; edge < 12; ++edge)
      if (const CellBlocks::Edge at = cells_.edge_of_cell(block_, cell_, edge); cells_.is_crossed(at)) f(at);
  }
  bool has_point(const Triangle& t) const { return t[0] == point_ || t[1] == point_ || t[2] == point_; }
  bool is_flattened(const CellBlocks::Edge& edge) const {
    return std::ranges::any_of(flattened_, [&](const CellBlocks::Edge& other) {
      return edge.block == other.block && edge.sample == other.sample && edge.axis == other.axis;
    });
  }
  /// Those that change: with the point, or of an edge that is being flattened.
  bool changes(const CellBlocks::Edge& edge, const Triangle& t) const { return has_point(t) || is_flattened(edge); }

  void gather_triangles() {
    star_.clear();
    nearby_.reset();
    for_each_edge([&](const CellBlocks::Edge& edge) {
      mesh_.for_each_triangle(edge, [&](const Triangle& t) {
        if (changes(edge, t)) star_.push_back(t);
      });
    });
  }

  bool fits() { return is_embedded() && meets_nothing(); }

  /// All fans at once, cut in every way, first along the diagonals that pass nearer to the crossings.
  bool fits_without_fans() {
    if (fans_.empty() || fans_.size() > kMostFans) return false;
    unsigned nearer = 0;
    for (std::size_t i = 0; i < fans_.size(); ++i)
      nearer |= static_cast<unsigned>(distance(fans_[i], 1) < distance(fans_[i], 0)) << i;
    flattened_ = fans_;
    bool fit = false;
    for (unsigned turned = 0; turned < 1u << fans_.size() && !fit; ++turned) {
      for (std::size_t i = 0; i < fans_.size(); ++i)
        polygons_.flatten(fans_[i], static_cast<int>(((nearer ^ turned) >> i) & 1));
      gather_triangles();
      fit = fits();
    }
    if (fit) {
      fans_.clear();
    } else {
      for (const CellBlocks::Edge& edge : flattened_) polygons_.undo_flatten(edge);
    }
    flattened_.clear();
    gather_triangles();
    return fit;
  }

  /// Squared, of the crossing from the two triangles of a quad.
  double distance(const CellBlocks::Edge& edge, int diagonal) const {
    const std::array<std::uint32_t, 4> p = cells_.around(edge).points;
    const auto corner = [&](int i) { return points_[p[static_cast<std::size_t>((diagonal + i) % 4)]]; };
    const Vector3d& crossing = points_[polygons_.crossing_point(edge)];
    return std::min(squared_distance(crossing, corner(0), corner(1), corner(2)),
                    squared_distance(crossing, corner(0), corner(2), corner(3)));
  }

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

  /// The triangles nearby are only looked for where a place has got so far.
  bool meets_nothing() {
    if (!nearby_) {
      nearby_.emplace();
      mesh_.for_each_near(block_, box_, [&](const CellBlocks::Edge& edge, const Triangle& t) {
        if (!changes(edge, t)) nearby_->push_back(t);
      });
    }
    for (const Triangle& t : star_) {
      const Box3 box = mesh_.box_of(t);
      for (const Triangle& other : *nearby_)
        if (box.overlaps(mesh_.box_of(other)) && !mesh_.apart(t, other)) return false;
    }
    return true;
  }

  const CellBlocks& cells_;
  EdgePolygons& polygons_;
  const PolygonNeighbourhood mesh_;
  std::vector<Vector3d>& points_;
  std::int32_t block_ = 0;
  int cell_ = 0;
  std::uint32_t point_ = 0;
  Box3 box_;
  std::vector<Triangle> star_;
  std::optional<std::vector<Triangle>> nearby_;
  std::vector<CellBlocks::Edge> fans_, flattened_;  ///< that can be made quads; that are being made so
};

}  // namespace

void move_points(const CellBlocks& cells, EdgePolygons& polygons,
                 const std::vector<std::vector<PointWish>>& wishes, const FilePoints& file,
                 std::vector<Vector3d>& points, RunContext& context) {
  Stage stage(context, "move points");
  // A point's polygons end two voxels from its cell. Those that might meet them belong to edges at most six samples away,
  // and have their points in cells at most seven away. So blocks of one parity, eight apart, do not see one another's moves.
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (int parity = 0; parity < 8; ++parity)
      parallel_blocks(cells.size(), context, [&](std::size_t b) {
        if (wishes[b].empty()) return;
        const auto block = static_cast<std::int32_t>(b);
        const auto& lower = cells.grid().blocks()[b].lower;
        if (((lower[0] >> 3 & 1) | (lower[1] >> 3 & 1) << 1 | (lower[2] >> 3 & 1) << 2) != parity) return;
        Star star(cells, polygons, points);
        for (const PointWish& wish : wishes[b]) {
          const Vector3d from = points[cells.point(block, wish.cell, 0)];
          if ((wish.place - from).norm() < kFulfilled || polygons.is_crowded({block, wish.cell})) continue;
          star.gather(block, wish.cell, {wish.place, wish.nearer});
          const Vector3d between = 0.5 * (wish.place + wish.nearer), halfway = 0.5 * (from + wish.nearer);
          for (const Vector3d& place :
               {wish.place, between, wish.nearer, halfway, Vector3d(0.5 * (from + halfway))}) {
            if ((place - from).norm() < kFulfilled) break;
            if (star.moves_to(file.rounded(place))) break;
          }
        }
      });
}

}  // namespace hermesh
