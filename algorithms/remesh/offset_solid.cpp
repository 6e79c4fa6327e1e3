#include "algorithms/remesh/offset_solid.h"

#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/number_text.h"
#include "algorithms/core/openvdb_leaf.h"
#include "algorithms/core/parallel.h"
#include "algorithms/lattice/grid_placement.h"
#include "algorithms/remesh/shown_surface.h"
#include "algorithms/search/triangle_point.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {
namespace {

using openvdb::Coord;

constexpr double kBand = 3.0;   ///< voxels on both sides of the surface
constexpr double kSame = 1e-8;  ///< voxels: a crossing is found to this
/// Voxels by which a cube of samples is larger than its samples, since both ends of a crossing edge need
/// their distances.
constexpr double kEdge = 1.01;

/// The distance to polygons less a radius, in voxels.
class DistanceField {
 public:
  DistanceField(const PolygonMesh& mesh, const LevelSet& solid, double voxel_size, const Offset& offset)
      : triangles_(triangulated(mesh)),
        tree_(mesh.points, triangles_, 1.0 / voxel_size),
        signs_(offset.kind == Offset::Kind::solid ? &*solid.grid().grid : nullptr),
        offset_((offset.kind == Offset::Kind::shell ? 0.5 : 1.0) * offset.distance / voxel_size),
        radius_(std::abs(offset_)) {}

  double radius() const { return radius_; }
  bool grows_inwards() const { return offset_ < 0.0; }

  /// Returns the unsigned distance of a position, or `most` if it is farther away. @param last the nearest
  /// triangle of a position nearby, or kNone; set to the one found. With it, the search is much faster.
  double distance(const Eigen::Vector3d& p, double most, std::uint32_t& last) const {
    if (last != TriangleTree::kNone) most = std::min(most, (p - on(last, p)).norm() + kSame);
    const NearestTriangle found = tree_.nearest(p, most * most);
    if (found.triangle != TriangleTree::kNone) last = found.triangle;
    return std::sqrt(found.squared);
  }
  /// Returns the point of a triangle that is nearest to a position.
  Eigen::Vector3d on(std::uint32_t t, const Eigen::Vector3d& p) const {
    return closest_point(p, tree_.corner(t, 0), tree_.corner(t, 1), tree_.corner(t, 2)).position;
  }
  using Signs = openvdb::FloatGrid::ConstUnsafeAccessor;
  /// Returns the value of a sample at the given distance, negative inside the offset.
  double value(const Coord& sample, double distance, std::optional<Signs>& signs) const {
    return (signs && signs->getValue(sample) < 0.0f ? -distance : distance) - offset_;
  }
  std::optional<Signs> signs() const {
    return signs_ ? std::optional<Signs>(signs_->getConstUnsafeAccessor()) : std::nullopt;
  }

 private:
  std::vector<Triangle> triangles_;
  TriangleTree tree_;
  const openvdb::FloatGrid* signs_;
  double offset_, radius_;
};

Eigen::Vector3d position(const Coord& c) { return {double(c.x()), double(c.y()), double(c.z())}; }

/// Returns the lower corner of one of the eight cubes of a side, relative to that of all.
Coord octant(int number, int side) {
  return {side * (number >> 2), side * ((number >> 1) & 1), side * (number & 1)};
}

/// Appends the lower corners of the leaves near the surface within a cube of samples, in a fixed order.
void find_leaves(const DistanceField& field, const Coord& lower, int side, std::uint32_t nearest,
                 std::vector<Coord>& leaves, const RunContext& context) {
  const double half = 0.5 * (side - 1);
  const double reach = std::sqrt(3.0) * half + kEdge;
  const Eigen::Vector3d centre = position(lower) + Eigen::Vector3d::Constant(half);
  const double most = field.radius() + reach, d = field.distance(centre, most, nearest);
  if (d >= most || d < field.radius() - reach) return;
  if (side == 8) return leaves.push_back(lower);
  context.check();
  for (int child = 0; child < 8; ++child)
    find_leaves(field, lower + octant(child, side / 2), side / 2, nearest, leaves, context);
}

/// Fills in the values of a leaf, in world units, exact at both ends of all crossing edges.
class LeafValues {
 public:
  LeafValues(FloatLeaf& leaf, const DistanceField& field, double voxel_size, float background)
      : leaf_(leaf), field_(field), signs_(field.signs()), voxel_size_(voxel_size), background_(background) {}

  /// Returns true if a sample is inside.
  bool fill() {
    fill(leaf_.origin(), 8);
    return any_inside_;
  }

 private:
  void fill(const Coord& lower, int side) {
    const double half = 0.5 * (side - 1), reach = std::sqrt(3.0) * half + kEdge;
    const double d =
        field_.distance(position(lower) + Eigen::Vector3d::Constant(half), field_.radius() + reach, nearest_);
    if (side > 1 && std::abs(d - field_.radius()) < reach) {
      for (int child = 0; child < 8; ++child) fill(lower + octant(child, side / 2), side / 2);
      return;
    }
    for (int i = 0; i < side * side * side; ++i) {
      const Coord at = lower + Coord(i / (side * side), i / side % side, i % side);
      const double value = field_.value(at, d, signs_);
      any_inside_ = any_inside_ || value < 0.0;
      if (side == 1 && std::abs(value) < kBand)
        leaf_.setValueOn(at, static_cast<float>(value * voxel_size_));
      else
        leaf_.setValueOff(at, value < 0.0 ? -background_ : background_);
    }
  }

  FloatLeaf& leaf_;
  const DistanceField& field_;
  std::optional<DistanceField::Signs> signs_;
  double voxel_size_;
  float background_;
  std::uint32_t nearest_ = TriangleTree::kNone;
  bool any_inside_ = false;
};

/// Returns the position in 0 … `high` at which the distance to one triangle becomes the radius, along an edge
/// that starts farther away and is at most as far at `high`. The distance is a convex function of the
/// position, so there is one.
double reaches(const DistanceField& field, std::uint32_t triangle, const Eigen::Vector3d& far,
               const Eigen::Vector3d& along, double high) {
  const auto beyond = [&](double t) {
    const Eigen::Vector3d p = far + t * along;
    return (p - field.on(triangle, p)).norm() - field.radius();
  };
  double low = 0.0, at_low = beyond(low), at_high = beyond(high);
  if (at_low <= 0.0) return 0.0;
  // Regula falsi (Illinois).
  for (int last = 0; high - low > kSame;) {
    const double part = std::clamp(at_low / (at_low - at_high), 0.01, 0.99);
    const double t = low + part * (high - low), at = beyond(t);
    if (std::abs(at) < kSame) return t;
    const int side = at > 0.0 ? 1 : -1;
    (side > 0 ? low : high) = t;
    (side > 0 ? at_low : at_high) = at;
    if (side == last) (side > 0 ? at_high : at_low) *= 0.5;
    last = side;
  }
  return high;
}

/// Returns where an edge crosses the offset surface, from 0 at the end farther from the polygons to 1, and
/// the nearest triangle there; −1 if it is nowhere near enough.
double crossing_from_far(const DistanceField& field, const Eigen::Vector3d& far, const Eigen::Vector3d& along,
                         std::uint32_t& nearest) {
  const auto distance = [&](double t) {
    return field.distance(far + t * along, field.radius() + 2.0, nearest);
  };
  double high = 1.0;
  if (distance(1.0) > field.radius()) {
    // The near end lies beyond the polygons, on the other side of the solid's boundary.
    constexpr int kSteps = 32;
    int step = 1;
    while (step < kSteps && distance(double(step) / kSteps) > field.radius()) ++step;
    if (step == kSteps) return -1.0;
    high = double(step) / kSteps;
  }
  // Other triangles can only be reached sooner.
  for (;;) {
    const std::uint32_t reached = nearest;
    high = reaches(field, reached, far, along, high);
    if (high <= kSame || distance(high) >= field.radius() - kSame || nearest == reached) return high;
  }
}

/// Moves the crossings of a leaf from those of the samples to the offset surface.
void make_exact(FloatHermite& hermite, std::size_t number, const DistanceField& field) {
  const SignLeaf& leaf = hermite.leaves[number];
  EdgeCrossing* crossing = hermite.crossings.data() + leaf.first;
  std::uint32_t nearest = TriangleTree::kNone;
  const std::array<BlockMask, 3> edges = crossing_edges(leaf);
  for (int axis = 0; axis < 3; ++axis)
    for_each_bit(edges[std::size_t(axis)], [&](int sample) {
      EdgeCrossing& to = *crossing++;
      const Eigen::Vector3d first(leaf.lower[0] + (sample >> 6), leaf.lower[1] + ((sample >> 3) & 7),
                                  leaf.lower[2] + (sample & 7));
      const bool far_first = test(leaf.inside, sample) == field.grows_inwards();
      const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
      const double t = crossing_from_far(field, far_first ? first : Eigen::Vector3d(first + unit),
                                         far_first ? unit : Eigen::Vector3d(-unit), nearest);
      if (t < 0.0) return;
      to.offset = static_cast<float>(far_first ? t : 1.0 - t);
      const Eigen::Vector3d p = first + (far_first ? t : 1.0 - t) * unit;
      const Eigen::Vector3d away = p - field.on(nearest, p);
      if (away.norm() < 1e-6) return;
      const Eigen::Vector3d normal = (field.grows_inwards() ? -1.0 : 1.0) * away.normalized();
      for (int i = 0; i < 3; ++i) to.normal[std::size_t(i)] = static_cast<float>(normal[i]);
    });
}

}  // namespace

SampledSolid offset_solid(const PolygonMesh& mesh, const LevelSet& solid, double voxel_size,
                          const Offset& offset, RunContext& context) {
  const Stage stage(context, "offset of the polygons");
  const DistanceField field(mesh, solid, voxel_size, offset);
  if (offset.kind == Offset::Kind::shell && field.radius() < kLeastShellRadius)
    throw Error("a shell must be at least " + text(2.0 * kLeastShellRadius) +
                " voxels thick, and this one has " + text(2.0 * field.radius()) + "; use voxels of at most " +
                text(offset.distance / (2.0 * kLeastShellRadius)));
  // Cubes of samples around the polygons.
  constexpr int kCube = 64;
  const Bounds box = bounds(mesh);
  const double reach = field.grows_inwards() ? 0.0 : field.radius();
  std::vector<Coord> cubes;
  Coord low, high;
  for (int a = 0; a < 3; ++a) {
    const double lower = (box.lower[a] - mesh.origin[a]) / voxel_size - reach - kBand,
                 upper = (box.upper[a] - mesh.origin[a]) / voxel_size + reach + kBand;
    low[a] = int(std::floor(lower / kCube));
    high[a] = int(std::floor(upper / kCube));
  }
  for (int x = low.x(); x <= high.x(); ++x)
    for (int y = low.y(); y <= high.y(); ++y)
      for (int z = low.z(); z <= high.z(); ++z) cubes.emplace_back(x * kCube, y * kCube, z * kCube);
  std::vector<std::vector<Coord>> found(cubes.size());
  parallel_blocks(
      cubes.size(), context,
      [&](std::size_t i) { find_leaves(field, cubes[i], kCube, TriangleTree::kNone, found[i], context); }, 1);
  std::vector<Coord> lowers;
  for (const std::vector<Coord>& some : found) lowers.insert(lowers.end(), some.begin(), some.end());
  initialize_openvdb();
  const auto background = static_cast<float>(kBand * voxel_size);
  const auto grid = openvdb::FloatGrid::create(background);
  grid->setName("sdf");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  std::vector<std::unique_ptr<FloatLeaf>> leaves(lowers.size());
  std::atomic<bool> any_inside = false;
  parallel_blocks(leaves.size(), context, [&](std::size_t i) {
    leaves[i] = std::make_unique<FloatLeaf>(lowers[i], background);
    if (LeafValues(*leaves[i], field, voxel_size, background).fill()) any_inside = true;
  });
  if (!any_inside)
    throw Error("nothing is left: no sample is deeper than " + text(-offset.distance) +
                " within the solid; use a smaller offset or smaller voxels");
  for (std::unique_ptr<FloatLeaf>& leaf : leaves) grid->tree().addLeaf(leaf.release());
  openvdb::tools::signedFloodFill(grid->tree());
  grid->setTransform(transform_at(mesh.origin, voxel_size));
  SampledSolid result;
  result.level_set = make_level_set(grid);
  result.hermite = sample_level_set(result.level_set, 0.0, context);
  parallel_blocks(result.hermite.leaves.size(), context,
                  [&](std::size_t i) { make_exact(result.hermite, i, field); });
  return result;
}

bool bound_their_solid(const PolygonMesh& mesh, const LevelSet& solid, RunContext& context) {
  PolygonSampling sampling;
  const FloatHermite hermite = sample_polygons(solid, 0.0, mesh, context, &sampling);
  if (sampling.nearest + sampling.fallback > 0) return false;
  const ShownSurface shown(solid, hermite, mesh.origin, context);
  const std::vector<Triangle> triangles = triangulated(mesh);
  const double voxel_size = solid.voxel_size();
  std::atomic<bool> all = true;
  parallel_blocks(triangles.size(), context, [&](std::size_t i) {
    if (!all) return;
    for_each_piece(corners_of(mesh, triangles[i], voxel_size), kPiece, [&](const Corners& piece) {
      if (shown.is_all(true, centre(piece))) all = false;
    });
  });
  return all;
}

OffsetErrors offset_errors(const PolygonMesh& polygons, const FloatHermite& offset, const PolygonMesh& mesh,
                           double radius, RunContext& context) {
  const std::vector<Triangle> source = triangulated(polygons), triangles = triangulated(mesh);
  const TriangleTree tree(polygons.points, source, 1.0), shown(mesh.points, triangles, 1.0);
  std::vector<double> found(mesh.points.size() + triangles.size());
  const auto at = [&](const Eigen::Vector3d& p) {
    return std::sqrt(tree.nearest(p - polygons.origin).squared) - radius;
  };
  parallel_blocks(found.size(), context, [&](std::size_t i) {
    if (i < mesh.points.size()) {
      found[i] = at(mesh.world(i));
    } else {
      const Triangle& t = triangles[i - mesh.points.size()];
      found[i] = at((mesh.world(t[0]) + mesh.world(t[1]) + mesh.world(t[2])) / 3.0);
    }
  });
  std::vector<double> back(offset.leaves.size());
  const IndexToWorld& placement = offset.placement;
  parallel_blocks(back.size(), context, [&](std::size_t leaf) {
    const std::array<std::int32_t, 3>& lower = offset.leaves[leaf].lower;
    for_each_crossing(offset, leaf, [&](int axis, int sample, const EdgeCrossing& crossing) {
      Eigen::Vector3d local(sample >> 6, (sample >> 3) & 7, sample & 7);
      local[axis] += double(crossing.offset);
      for (int a = 0; a < 3; ++a) local[a] += double(lower[std::size_t(a)]) - double(placement.base[a]);
      const Eigen::Vector3d p = placement.local(local) + placement.origin - mesh.origin;
      back[leaf] = std::max(back[leaf], shown.nearest(p).squared);
    });
  });
  OffsetErrors errors{.samples = found.size(), .offset_samples = offset.crossings.size()};
  for (const double value : found) {
    errors.above = std::max(errors.above, value);
    errors.below = std::max(errors.below, -value);
  }
  for (const double squared : back) errors.from_offset = std::max(errors.from_offset, std::sqrt(squared));
  return errors;
}

}  // namespace hermesh
