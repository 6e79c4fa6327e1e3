#include "algorithms/extraction/frustum.h"

#include <openvdb/tools/SignedFloodFill.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "algorithms/core/error.h"
#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using SampleLeaf = openvdb::FloatTree::LeafNodeType;

/// The frustum as a convex solid.
class Solid {
 public:
  explicit Solid(const Frustum& frustum) {
    check(frustum);
    const Vector3d forward = (frustum.look_at - frustum.position).normalized();
    // An orthonormal frame: `up` is made perpendicular to the view.
    const Vector3d right = forward.cross(frustum.up).normalized(), up = right.cross(forward);
    const double slope = std::tan(0.5 * frustum.field_of_view * std::numbers::pi / 180.0);
    for (int corner = 0; corner < 8; ++corner) {
      const double depth = corner & 4 ? frustum.far : frustum.near, half = slope * depth;
      corners_[corner] = frustum.position + depth * forward +
                         (corner & 1 ? half : -half) * frustum.aspect * right +
                         (corner & 2 ? half : -half) * up;
    }
    const Vector3d middle = mean();
    for (int f = 0; f < 6; ++f) {
      normals_[f] = (corner(f, 1) - corner(f, 0)).cross(corner(f, 3) - corner(f, 0)).normalized();
      // Turned outwards, since the order of corners in the table differs between faces.
      if (normals_[f].dot(middle - corner(f, 0)) > 0) normals_[f] = -normals_[f];
    }
  }

  /// Returns the largest signed distance to the planes of the faces: exact inside, elsewhere a lower bound.
  double lower_bound(const Vector3d& point) const {
    double largest = -std::numeric_limits<double>::infinity();
    for (int f = 0; f < 6; ++f) largest = std::max(largest, normals_[f].dot(point - corner(f, 0)));
    return largest;
  }
  /// Returns the signed distance to the surface; outside, the nearest position is on one of the faces.
  double distance(const Vector3d& point) const {
    const double bound = lower_bound(point);
    if (bound <= 0) return bound;
    double least = std::numeric_limits<double>::infinity();
    for (int f = 0; f < 6; ++f) least = std::min(least, to_face(f, point));
    return least;
  }

  /// Returns the shorter side of the near plane.
  double near_side() const {
    return std::min((corners_[1] - corners_[0]).norm(), (corners_[2] - corners_[0]).norm());
  }

  Eigen::AlignedBox3d box() const {
    Eigen::AlignedBox3d box;
    for (const Vector3d& corner : corners_) box.extend(corner);
    return box;
  }

 private:
  static void check(const Frustum& f) {
    const double numbers[] = {f.field_of_view, f.aspect, f.near, f.far};
    if (!f.position.allFinite() || !f.look_at.allFinite() || !f.up.allFinite() ||
        !std::all_of(std::begin(numbers), std::end(numbers),
                     [](double value) { return std::isfinite(value); }))
      throw Error("a frustum needs finite numbers");
    if (!(f.field_of_view > 0 && f.field_of_view < 180))
      throw Error("a frustum's angle must be between 0 and 180 degrees");
    if (!(f.aspect > 0)) throw Error("a frustum's aspect ratio must be above 0");
    if (!(f.near > 0 && f.near < f.far)) throw Error("a frustum's near and far plane must be 0 < near < far");
    const Vector3d view = f.look_at - f.position;
    if (!(view.norm() > 0)) throw Error("a frustum must look at another point than its own position");
    // Sine of the angle between the two; below this the frame would be rounding errors.
    if (!(view.normalized().cross(f.up.normalized()).norm() > 1e-6))
      throw Error("a frustum's up must not be zero, nor lie along its view");
  }

  /// Returns corner i of a face, in order around it. Bits of a corner: right, up, far.
  const Vector3d& corner(int face, int i) const {
    static constexpr int kFaces[6][4] = {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 2, 6, 4},
                                         {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 3, 7, 6}};
    return corners_[kFaces[face][i & 3]];
  }
  Vector3d mean() const {
    Vector3d sum = Vector3d::Zero();
    for (const Vector3d& corner : corners_) sum += corner;
    return sum / 8.0;
  }
  /// Returns the distance to one face: to its plane, if the foot of the perpendicular lies on the same side
  /// of all four edges, otherwise to the nearest edge.
  double to_face(int f, const Vector3d& point) const {
    const double height = normals_[f].dot(point - corner(f, 0));
    const Vector3d foot = point - height * normals_[f];
    double least = std::numeric_limits<double>::infinity();
    int left = 0;
    for (int i = 0; i < 4; ++i) {
      const Vector3d edge = corner(f, i + 1) - corner(f, i), to = point - corner(f, i);
      const double along = std::clamp(edge.dot(to) / edge.squaredNorm(), 0.0, 1.0);
      least = std::min(least, (to - along * edge).norm());
      left += edge.cross(foot - corner(f, i)).dot(normals_[f]) > 0 ? 1 : -1;
    }
    return left == 4 || left == -4 ? std::fabs(height) : least;
  }

  std::array<Vector3d, 8> corners_;
  std::array<Vector3d, 6> normals_;  ///< unit normals of the faces, outwards
};

/// Returns the leaf with its first sample at `lower`, or null if no sample is within the band.
std::unique_ptr<SampleLeaf> make_leaf(const Solid& solid, const openvdb::Coord& lower, double voxel,
                                      double band) {
  const auto at = [&](double x, double y, double z) -> Vector3d {
    return Vector3d(lower.x() + x, lower.y() + y, lower.z() + z) * voxel;
  };
  // The bound is 1-Lipschitz: if it exceeds band and radius of the samples at the middle, no sample is in the
  // band.
  const double radius = std::sqrt(3.0) * 3.5 * voxel, middle = solid.lower_bound(at(3.5, 3.5, 3.5));
  if (std::fabs(middle) > band + radius) return nullptr;
  auto leaf = std::make_unique<SampleLeaf>(lower, static_cast<float>(band), false);
  for (int sample = 0; sample < 512; ++sample) {
    const Vector3d point = at(sample >> 6, (sample >> 3) & 7, sample & 7);
    // The bound decides most samples outside of the band.
    const double bound = solid.lower_bound(point);
    const double value = bound >= band ? band : std::clamp(solid.distance(point), -band, band);
    leaf->setValueOnly(static_cast<openvdb::Index>(sample), static_cast<float>(value));
    if (std::fabs(value) < band) leaf->setValueOn(static_cast<openvdb::Index>(sample));
  }
  return leaf->isEmpty() ? nullptr : std::move(leaf);
}

}  // namespace

double signed_distance(const Frustum& frustum, const Vector3d& point) {
  return Solid(frustum).distance(point);
}

LevelSet frustum_mask(const Frustum& frustum, int resolution, RunContext& context) {
  Stage stage(context, "frustum");
  const Solid solid(frustum);
  const Eigen::AlignedBox3d box = solid.box();
  const double voxel = box.sizes().maxCoeff() / resolution, band = 3.0 * voxel;
  constexpr double kLeastVoxel = 1.5e-5;  // OpenVDB takes no transform whose determinant is below 3e-15
  if (!(voxel > kLeastVoxel))
    throw Error("the frustum is too small for a mask of " + std::to_string(resolution) +
                " voxels along it; use larger units, or fewer voxels");
  constexpr double kNarrow = 2.0;  // voxels whose samples may miss the frustum; the rest of the mask is right
  if (solid.near_side() < kNarrow * voxel)
    context.note(
        "the frustum's near end is narrower than two voxels of its mask, which may lose it there; "
        "take planes nearer to what is seen, or more voxels");
  // The leaves that overlap the box and the band around it; index zero is at the world's origin.
  std::array<int, 3> first, count;
  for (int a = 0; a < 3; ++a) {
    first[a] = static_cast<int>(std::floor((box.min()[a] - band) / voxel / 8.0));
    count[a] = static_cast<int>(std::floor((box.max()[a] + band) / voxel / 8.0)) - first[a] + 1;
  }
  // Leaves are made in parallel, and added to the tree in order.
  std::vector<std::unique_ptr<SampleLeaf>> leaves(std::size_t(count[0]) * count[1] * count[2]);
  parallel_blocks(leaves.size(), context, [&](std::size_t i) {
    const int n = static_cast<int>(i), z = n % count[2], y = n / count[2] % count[1],
              x = n / (count[2] * count[1]);
    leaves[i] = make_leaf(solid, openvdb::Coord(8 * (first[0] + x), 8 * (first[1] + y), 8 * (first[2] + z)),
                          voxel, band);
  });
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(static_cast<float>(band));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
  for (auto& leaf : leaves)
    if (leaf) grid->tree().addLeaf(leaf.release());
  // Gives the tiles within the frustum their sign.
  openvdb::tools::signedFloodFill(grid->tree());
  return make_level_set(grid);
}

}  // namespace hermesh
