#include "reference/pseudo_normal_voxelizer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/lattice/grid_placement.h"
#include "algorithms/lattice/memory_estimate.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using Leaf = openvdb::FloatTree::LeafNodeType;
using BlockOrigin = std::array<int, 3>;

/// Depth, in voxels, that a voxel inside gets if it lies on the surface, so that its value has a sign.
constexpr double kLeastInnerDepth = 0x1p-24;
constexpr int kBlock = 8, kBlockSamples = kBlock * kBlock * kBlock;

TrianglePart edge(int i) { return static_cast<TrianglePart>(static_cast<int>(TrianglePart::kEdge0) + i); }
TrianglePart corner(int i) { return static_cast<TrianglePart>(static_cast<int>(TrianglePart::kCorner0) + i); }

/// Numbers of points such that those with the same coordinates have one number; -0 is 0.
std::vector<std::uint32_t> weld(const std::vector<Eigen::Vector3f>& points) {
  std::vector<std::uint32_t> order(points.size()), numbers(points.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t i) {
    return std::array{points[i].x() + 0.0f, points[i].y() + 0.0f, points[i].z() + 0.0f};
  };
  std::ranges::sort(order, {}, key);
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i > 0 && key(order[i]) != key(order[i - 1])) ++number;
    numbers[order[i]] = number;
  }
  return numbers;
}

Vector3d unit_or_zero(const Vector3d& v) {
  const double length = v.norm();
  return length > 0.0 ? Vector3d(v / length) : Vector3d(Vector3d::Zero());
}

/// Origins of the blocks that come within a distance of a triangle's box, each once, in order.
std::vector<BlockOrigin> blocks_near(const TriangleTree& tree, double reach) {
  std::vector<BlockOrigin> blocks;
  for (std::uint32_t t = 0; t < tree.triangle_count(); ++t) {
    const Vector3d a = tree.corner(t, 0), b = tree.corner(t, 1), c = tree.corner(t, 2);
    std::array<int, 3> low, high;
    for (int axis = 0; axis < 3; ++axis) {
      const auto block = [](double place) { return static_cast<int>(std::floor(place / kBlock)) * kBlock; };
      low[axis] = block(std::min({a[axis], b[axis], c[axis]}) - reach);
      high[axis] = block(std::max({a[axis], b[axis], c[axis]}) + reach);
    }
    for (int x = low[0]; x <= high[0]; x += kBlock)
      for (int y = low[1]; y <= high[1]; y += kBlock)
        for (int z = low[2]; z <= high[2]; z += kBlock) blocks.push_back({x, y, z});
    // Large triangles name a block many times over, and so do many small ones.
    if (blocks.size() > (std::size_t{1} << 22)) {
      std::ranges::sort(blocks);
      blocks.erase(std::ranges::unique(blocks).begin(), blocks.end());
    }
  }
  std::ranges::sort(blocks);
  blocks.erase(std::ranges::unique(blocks).begin(), blocks.end());
  return blocks;
}

struct Machinery {
  const TriangleTree& tree;
  const PseudoNormals& normals;
  double exterior, interior, voxel_size;

  /// The vector from a point's nearest point on the surface to the point, and its side: inside if the
  /// pseudo-normal there points away from the point.
  struct Side {
    Vector3d away;
    bool inside;
  };
  Side side(const Vector3d& p) const {
    const std::uint32_t triangle = tree.nearest(p).triangle;
    const NearestPart found =
        nearest_part(p, {tree.corner(triangle, 0), tree.corner(triangle, 1), tree.corner(triangle, 2)});
    const Vector3d away = p - found.point;
    return {away, away.dot(normals.of(triangle, found.part)) < 0.0};
  }

  /// The leaf of a block; null if no voxel of it is in the band.
  std::unique_ptr<Leaf> leaf(const BlockOrigin& origin) const {
    const double widest = std::max(exterior, interior), diagonal = 3.5 * std::sqrt(3.0);
    const Vector3d middle(origin[0] + 3.5, origin[1] + 3.5, origin[2] + 3.5);
    const double near = widest + diagonal;
    if (tree.nearest(middle, near * near).triangle == TriangleTree::kNone) return nullptr;
    auto result = std::make_unique<Leaf>(openvdb::Coord(origin[0], origin[1], origin[2]));
    bool any = false;
    for (int i = 0; i < kBlockSamples; ++i) {
      const Vector3d p(origin[0] + (i >> 6), origin[1] + (i >> 3 & 7), origin[2] + (i & 7));
      const auto [away, inside] = side(p);
      const double limit = inside ? interior : exterior, distance = away.norm();
      const double value = std::clamp(distance, inside ? kLeastInnerDepth : 0.0, limit) * voxel_size;
      const auto offset = static_cast<openvdb::Index>(i);
      result->setValueOnly(offset, static_cast<float>(inside ? -value : value));
      result->setActiveState(offset, distance < limit);
      any |= distance < limit;
    }
    return any ? std::move(result) : nullptr;
  }

  /// No surface passes through a tile, so the sign at its centre holds for all of it. Tiles beyond the
  /// polygons' box are outside.
  void sign_tiles(openvdb::FloatTree& grid, float outside, float inside) const {
    Vector3d low = tree.corner(0, 0), high = low;
    for (std::uint32_t t = 0; t < tree.triangle_count(); ++t)
      for (int i = 0; i < 3; ++i) {
        low = low.cwiseMin(tree.corner(t, i));
        high = high.cwiseMax(tree.corner(t, i));
      }
    auto tile = grid.beginValueAll();
    tile.setMaxDepth(openvdb::FloatTree::ValueAllIter::LEAF_DEPTH - 1);
    for (; tile; ++tile) {
      openvdb::CoordBBox box;
      tile.getBoundingBox(box);
      const openvdb::Vec3d centre = box.getCenter();
      const Vector3d p(centre.x(), centre.y(), centre.z());
      const bool within = (p.array() >= low.array()).all() && (p.array() <= high.array()).all();
      tile.setValue(within && side(p).inside ? inside : outside);
    }
  }
};

}  // namespace

NearestPart nearest_part(const Vector3d& p, const std::array<Vector3d, 3>& corners) {
  const auto& [a, b, c] = corners;
  const Vector3d normal = (b - a).cross(c - a);
  const double area = normal.squaredNorm();
  if (area > 0.0) {
    // Within the prism over the face the foot of the perpendicular is nearest.
    const double of_c = (b - a).cross(p - a).dot(normal), of_a = (c - b).cross(p - b).dot(normal),
                 of_b = (a - c).cross(p - c).dot(normal);
    if (of_a > 0.0 && of_b > 0.0 && of_c > 0.0)
      return {p - (p - a).dot(normal) / area * normal, TrianglePart::kFace};
  }
  NearestPart best{a, TrianglePart::kCorner0};
  double least = std::numeric_limits<double>::infinity();
  const auto offer = [&](const Vector3d& point, TrianglePart part) {
    const double squared = (p - point).squaredNorm();
    if (squared < least) least = squared, best = {point, part};
  };
  // Corners first, so that an edge wins only where a point within it is nearer.
  for (int i = 0; i < 3; ++i) offer(corners[i], corner(i));
  for (int i = 0; i < 3; ++i) {
    const Vector3d along = corners[(i + 1) % 3] - corners[i];
    const double t = (p - corners[i]).dot(along), length = along.squaredNorm();
    if (t > 0.0 && t < length) offer(corners[i] + t / length * along, edge(i));
  }
  return best;
}

PseudoNormals::PseudoNormals(const std::vector<Eigen::Vector3f>& points,
                             const std::vector<Triangle>& triangles) {
  const std::vector<std::uint32_t> place = weld(points);
  corners_.assign(points.size(), Vector3d::Zero());
  for (const Triangle& t : triangles) {
    const Triangle& welded = welded_.emplace_back(Triangle{place[t[0]], place[t[1]], place[t[2]]});
    const std::array<Vector3d, 3> at = {points[t[0]].cast<double>(), points[t[1]].cast<double>(),
                                        points[t[2]].cast<double>()};
    const Vector3d& normal = faces_.emplace_back(unit_or_zero((at[1] - at[0]).cross(at[2] - at[0])));
    for (int i = 0; i < 3; ++i) {
      const Vector3d u = at[(i + 1) % 3] - at[i], v = at[(i + 2) % 3] - at[i];
      corners_[welded[i]] += std::atan2(u.cross(v).norm(), u.dot(v)) * normal;
      const auto [low, high] = std::minmax(welded[i], welded[(i + 1) % 3]);
      edges_.push_back({low, high, normal});
    }
  }
  // Sums run over the triangles in their order.
  std::ranges::stable_sort(edges_, {}, [](const Edge& e) { return std::pair(e.low, e.high); });
  std::size_t kept = 0;
  for (const Edge& each : edges_) {
    if (kept > 0 && edges_[kept - 1].low == each.low && edges_[kept - 1].high == each.high)
      edges_[kept - 1].normal += each.normal;
    else
      edges_[kept++] = each;
  }
  edges_.resize(kept);
  // A soup that is inside out as a whole is reversed.
  double volume = 0.0;
  Vector3d middle = Vector3d::Zero();
  for (const Eigen::Vector3f& point : points) middle += point.cast<double>() / double(points.size());
  for (const Triangle& t : triangles) {
    const auto at = [&](int i) { return Vector3d(points[t[i]].cast<double>() - middle); };
    volume += at(0).dot(at(1).cross(at(2)));
  }
  if (volume >= 0.0) return;
  for (std::vector<Vector3d>* normals : {&faces_, &corners_})
    for (Vector3d& normal : *normals) normal = -normal;
  for (Edge& each : edges_) each.normal = -each.normal;
}

Vector3d PseudoNormals::of(std::uint32_t triangle, TrianglePart part) const {
  if (part == TrianglePart::kFace) return faces_[triangle];
  const Triangle& t = welded_[triangle];
  if (part >= TrianglePart::kCorner0)
    return corners_[t[static_cast<std::size_t>(part) - static_cast<std::size_t>(TrianglePart::kCorner0)]];
  const std::size_t i = static_cast<std::size_t>(part) - static_cast<std::size_t>(TrianglePart::kEdge0);
  const auto [low, high] = std::minmax(t[i], t[(i + 1) % 3]);
  return std::ranges::lower_bound(edges_, std::pair(low, high), {},
                                  [](const Edge& e) { return std::pair(e.low, e.high); })
      ->normal;
}

LevelSet pseudo_normal_voxelizer(const VoxelizationInput& input) {
  check_voxelization_fits(input.mesh, input.voxel_size, input.exterior_band, input.interior_band);
  const Stage stage(input.context, "voxelization");
  initialize_openvdb();
  std::vector<Triangle> triangles = triangulated(input.mesh);
  // Triangles without area have no normal, and their edges belong to their neighbours, too.
  std::erase_if(triangles, [&](const Triangle& t) {
    const auto at = [&](int i) { return Vector3d(input.mesh.points[t[i]].cast<double>()); };
    return !((at(1) - at(0)).cross(at(2) - at(0)).squaredNorm() > 0.0);
  });
  if (triangles.empty()) throw Error("No polygon has an area: there is nothing to take a normal from.");
  const TriangleTree tree(input.mesh.points, triangles, 1.0 / input.voxel_size);
  const PseudoNormals normals(input.mesh.points, triangles);
  const Machinery machinery{tree, normals, input.exterior_band, input.interior_band, input.voxel_size};

  const auto outside = static_cast<float>(input.exterior_band * input.voxel_size),
             inside = static_cast<float>(-input.interior_band * input.voxel_size);
  const openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(outside);
  const std::vector<BlockOrigin> blocks =
      blocks_near(tree, std::max(input.exterior_band, input.interior_band));
  std::vector<std::unique_ptr<Leaf>> leaves(blocks.size());
  parallel_blocks(blocks.size(), input.context,
                  [&](std::size_t i) { leaves[i] = machinery.leaf(blocks[i]); });
  for (std::unique_ptr<Leaf>& leaf : leaves)
    if (leaf) grid->tree().addLeaf(leaf.release());
  machinery.sign_tiles(grid->tree(), outside, inside);

  grid->setTransform(transform_at(input.mesh.origin, input.voxel_size));
  grid->setName("sdf");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return make_level_set(grid);
}

}  // namespace hermesh
