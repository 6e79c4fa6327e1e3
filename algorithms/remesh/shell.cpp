#include "algorithms/remesh/shell.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/lattice/grid_placement.h"
#include "algorithms/search/triangle_point.h"
#include "algorithms/search/triangle_tree.h"
#include "algorithms/voxelization/distance/band.h"

namespace hermesh {
namespace {

constexpr int kSteps = 40;       ///< radii to a voxel
constexpr double kSlack = 1e-5;  ///< voxels: rounding of the distances in single precision
constexpr double kSame = 1e-9;   ///< voxels: the crossing is found to this

/// Triangles with their radii in voxels.
struct Shell {
  PolygonMesh mesh;
  std::vector<double> radius;
};

/// Lowers the grid's values to the distances from triangles that share one radius, less that radius.
void lower_to(openvdb::FloatGrid& grid, const PolygonMesh& mesh, double radius, double voxel_size,
              double exterior, RunContext& context) {
  const IndexSoup soup(mesh, voxel_size);
  const double reach = std::max(1.0, exterior + radius);
  TriangleBins bins(soup, reach, context);
  const Band band = compute_band(soup, bins, {.reach = reach, .voxel_size = voxel_size}, context);
  const auto less = static_cast<float>(radius * voxel_size);
  const float background = grid.background();
  for (const std::unique_ptr<FloatLeaf>& from : band.leaves) {
    if (!from) continue;
    FloatLeaf* to = nullptr;
    for (auto value = from->cbeginValueOn(); value; ++value) {
      const float distance = *value - less;
      if (distance >= background) continue;
      if (!to) to = grid.tree().touchLeaf(from->origin());
      if (distance < to->getValue(value.pos())) to->setValueOn(value.pos(), distance);
    }
  }
}

/// Moves crossings to where edges leave the shell.
class ShellEdges {
 public:
  ShellEdges(const Shell& shell, double voxel_size)
      : shell_(shell),
        tree_(shell.mesh.points, shell.mesh.triangles, 1.0 / voxel_size),
        largest_(*std::max_element(shell.radius.begin(), shell.radius.end())) {}

  /// Where all crossings of a leaf begin.
  enum class Start {
    inside_end,  ///< the inside end lies in the shell
    crossing     ///< the solid, or a part of the shell, reaches as far as the crossing
  };

  void move_crossings(FloatHermite& hermite, std::size_t number, Start start) const {
    const SignLeaf& leaf = hermite.leaves[number];
    EdgeCrossing* crossing = hermite.crossings.data() + leaf.first;
    const std::array<BlockMask, 3> edges = crossing_edges(leaf);
    const std::array<std::int32_t, 3>& lower = leaf.lower;
    std::vector<std::uint32_t> near;
    for (int axis = 0; axis < 3; ++axis)
      for_each_bit(edges[std::size_t(axis)], [&](int sample) {
        const Eigen::Vector3d first(lower[0] + (sample >> 6), lower[1] + ((sample >> 3) & 7),
                                    lower[2] + (sample & 7));
        move(first, axis, test(leaf.inside, sample), start, *crossing++, near);
      });
  }

 private:
  /// Follows the edge from its inside end. Each body of the shell is convex, so the edge leaves it once;
  /// where it does, another body may go on.
  void move(const Eigen::Vector3d& first, int axis, bool first_inside, Start start, EdgeCrossing& crossing,
            std::vector<std::uint32_t>& near) const {
    const Eigen::Vector3d inside = first + (first_inside ? 0.0 : 1.0) * Eigen::Vector3d::Unit(axis);
    const Eigen::Vector3d along = (first_inside ? 1.0 : -1.0) * Eigen::Vector3d::Unit(axis);
    const double given = first_inside ? crossing.offset : 1.0 - crossing.offset;
    const double from = start == Start::inside_end ? 0.0 : given;
    near.clear();
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(largest_ + kSlack), end = inside + along;
    tree_.for_each_near(inside.cwiseMin(end) - reach, inside.cwiseMax(end) + reach,
                        [&](std::uint32_t t) { near.push_back(t); });
    double reached = from;
    std::uint32_t last = TriangleTree::kNone;
    for (bool moved = true; moved && reached < 1.0;) {
      moved = false;
      for (const std::uint32_t t : near) {
        if (beyond(t, inside + reached * along) > (last == TriangleTree::kNone ? kSlack : 0.0)) continue;
        const double low = leaves(t, inside, along, reached);
        if (low <= reached + kSame && last != TriangleTree::kNone) continue;
        reached = low;
        last = t;
        moved = true;
      }
    }
    // Where the shell goes no farther, the crossing stays that of the solid.
    if (last == TriangleTree::kNone || (start == Start::crossing && reached <= from + kSlack)) return;
    crossing.offset = static_cast<float>(first_inside ? reached : 1.0 - reached);
    const Eigen::Vector3d p = inside + reached * along;
    const Eigen::Vector3d away =
        p - closest_point(p, tree_.corner(last, 0), tree_.corner(last, 1), tree_.corner(last, 2)).position;
    const Eigen::Vector3d normal = away.norm() > kSlack ? away.normalized() : along;
    for (int i = 0; i < 3; ++i) crossing.normal[std::size_t(i)] = static_cast<float>(normal[i]);
  }

  /// Returns where a ray that is inside the body around a triangle at `low` leaves it, at most 1.
  double leaves(std::uint32_t t, const Eigen::Vector3d& from, const Eigen::Vector3d& along,
                double low) const {
    double high = 1.0, at_low = beyond(t, from + low * along), at_high = beyond(t, from + along);
    if (at_high <= 0.0) return 1.0;
    // Regula falsi (Illinois): the distance is a convex function of the position along the ray.
    for (int last = 0; high - low > kSame;) {
      const double part = at_low < 0.0 ? std::clamp(at_low / (at_low - at_high), 0.01, 0.99) : 0.5;
      const double between = low + part * (high - low);
      const double at = beyond(t, from + between * along);
      const int side = at <= 0.0 ? -1 : 1;
      (side < 0 ? low : high) = between;
      (side < 0 ? at_low : at_high) = at;
      if (side == last) (side < 0 ? at_high : at_low) *= 0.5;
      last = side;
    }
    return low;
  }

  /// Returns the distance of a position from the body around a triangle; not positive within.
  double beyond(std::uint32_t t, const Eigen::Vector3d& p) const {
    return std::sqrt(squared_distance(p, tree_.corner(t, 0), tree_.corner(t, 1), tree_.corner(t, 2))) -
           shell_.radius[t];
  }

  const Shell& shell_;
  TriangleTree tree_;
  double largest_;
};

}  // namespace

CombinedSolid with_shell(const SampledSolid& solid, const std::vector<ShellTriangle>& triangles,
                         const Eigen::Vector3d& origin, RunContext& context) {
  const Stage stage(context, "shell around thin parts");
  const double voxel_size = solid.level_set.voxel_size(),
               exterior = solid.level_set.background() / voxel_size;
  // Distances to triangles of one radius are computed together.
  std::map<int, PolygonMesh> by_radius;
  Shell shell;
  const auto append = [](PolygonMesh& mesh, const ShellTriangle& triangle) {
    const auto first = static_cast<std::uint32_t>(mesh.points.size());
    mesh.points.insert(mesh.points.end(), triangle.corner.begin(), triangle.corner.end());
    mesh.triangles.push_back({first, first + 1, first + 2});
  };
  for (const ShellTriangle& triangle : triangles) {
    const int steps = static_cast<int>(std::ceil(triangle.radius * kSteps - 1e-6));
    append(by_radius[steps], triangle);
    append(shell.mesh, triangle);
    shell.radius.push_back(double(steps) / kSteps);
  }
  const auto grid = openvdb::FloatGrid::create(static_cast<float>(solid.level_set.background()));
  grid->setName("sdf");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  for (const auto& [steps, mesh] : by_radius)
    lower_to(*grid, mesh, double(steps) / kSteps, voxel_size, exterior, context);
  grid->setTransform(transform_at(origin, voxel_size));
  SampledSolid around;
  around.level_set = make_level_set(grid);
  around.hermite = sample_level_set(around.level_set, 0.0, context);
  const ShellEdges edges(shell, voxel_size);
  const auto move_all = [&](FloatHermite& hermite, ShellEdges::Start start) {
    parallel_blocks(hermite.leaves.size(), context,
                    [&](std::size_t i) { edges.move_crossings(hermite, i, start); });
  };
  move_all(around.hermite, ShellEdges::Start::inside_end);
  CombinedSolid result = combine(Boolean::unite, solid, around, context);
  move_all(result.hermite, ShellEdges::Start::crossing);
  return result;
}

}  // namespace hermesh
