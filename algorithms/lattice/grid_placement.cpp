#include "algorithms/lattice/grid_placement.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "algorithms/core/error.h"
#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/lattice/part_placement.h"

namespace hermesh {
namespace {

using openvdb::Coord;
using Tree = openvdb::FloatTree;
using Leaf = Tree::LeafNodeType;

/// Extends the box by the leaf's active voxels, as Leaf::evalActiveBoundingBox() does voxel by voxel. A word
/// of the mask is a layer along x, a byte of it a row along z.
void include_active(const Leaf& leaf, openvdb::CoordBBox& box) {
  Coord lowest(8), highest(-1);
  std::uint64_t any_x = 0;
  for (int x = 0; x < 8; ++x) {
    const std::uint64_t word = leaf.getValueMask().getWord<std::uint64_t>(static_cast<openvdb::Index>(x));
    if (word == 0) continue;
    lowest.x() = std::min(lowest.x(), x), highest.x() = x;
    any_x |= word;
  }
  if (any_x == 0) return;
  // The union of all layers gives the rows along y; the union of all rows, in the lowest byte, z.
  lowest.y() = std::countr_zero(any_x) / 8, highest.y() = 7 - std::countl_zero(any_x) / 8;
  for (const int half : {32, 16, 8}) any_x |= any_x >> half;
  const auto any_y = static_cast<std::uint8_t>(any_x);
  lowest.z() = std::countr_zero(any_y), highest.z() = 7 - std::countl_zero(any_y);
  box.expand(openvdb::CoordBBox(leaf.origin() + lowest, leaf.origin() + highest));
}

/// Names of the metadata with the corners of the extent of all parts of a lattice.
constexpr const char *kExtentLower = "hermesh_extent_lower", *kExtentUpper = "hermesh_extent_upper";

openvdb::FloatGrid::ConstPtr grid_with_extent(const openvdb::FloatGrid& grid, const SampleBox& extent) {
  openvdb::MetaMap map(grid);
  const auto corner = [](const Eigen::Vector3i& at) { return openvdb::Vec3i(at[0], at[1], at[2]); };
  map.insertMeta(kExtentLower, openvdb::Vec3IMetadata(corner(extent.lower)));
  map.insertMeta(kExtentUpper, openvdb::Vec3IMetadata(corner(extent.upper)));
  return grid.copyReplacingMetadata(map);
}

/// Returns the box that determines the placement: the extent if there is one, or the active voxels.
openvdb::CoordBBox placing_box(const openvdb::FloatGrid& grid) {
  const auto lower = grid.getMetadata<openvdb::Vec3IMetadata>(kExtentLower),
             upper = grid.getMetadata<openvdb::Vec3IMetadata>(kExtentUpper);
  if (!lower || !upper) return active_box(grid.tree());
  return {Coord(lower->value()), Coord(upper->value()).offsetBy(-1)};
}

}  // namespace

openvdb::CoordBBox active_box(const openvdb::FloatTree& tree) {
  using Upper = Tree::RootNodeType::ChildNodeType;
  using Lower = Upper::ChildNodeType;
  // From large to small: active large tiles often make the nodes and leaves within the box irrelevant.
  openvdb::CoordBBox box;
  for (auto tile = tree.root().cbeginValueOn(); tile; ++tile) box.expand(tile.getCoord(), Upper::DIM);
  for (auto upper = tree.root().cbeginChildOn(); upper; ++upper) {
    for (auto tile = upper->cbeginValueOn(); tile; ++tile) box.expand(tile.getCoord(), Lower::DIM);
    for (auto lower = upper->cbeginChildOn(); lower; ++lower) {
      if (box.isInside(lower->getNodeBoundingBox())) continue;
      for (auto tile = lower->cbeginValueOn(); tile; ++tile) box.expand(tile.getCoord(), Leaf::DIM);
      for (auto leaf = lower->cbeginChildOn(); leaf; ++leaf)
        if (!box.isInside(openvdb::CoordBBox::createCube(leaf.getCoord(), Leaf::DIM)))
          include_active(*leaf, box);
    }
  }
  return box;
}

IndexToWorld placement_of(const openvdb::FloatGrid& grid) {
  if (!grid.transform().isLinear())
    throw Error(
        "the volume has a perspective transform, which is not supported; resample it to a linear one");
  // OpenVDB multiplies rows by matrices (p M), Eigen matrices by columns, so the linear part is transposed.
  const openvdb::Mat4R matrix = grid.transform().baseMap()->getAffineMap()->getMat4();
  IndexToWorld result;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) result.linear(row, column) = matrix(column, row);
  const Eigen::Vector3d translation(matrix(3, 0), matrix(3, 1), matrix(3, 2));

  const openvdb::CoordBBox box = placing_box(grid);
  Bounds world;
  if (!box.empty()) {
    for (int axis = 0; axis < 3; ++axis) {
      // Far from index zero (four times the longest side of the data) the base moves along, so that index
      // coordinates relative to it are small and exact. It is a multiple of 8, so that blocks remain blocks.
      const double middle = 0.5 * (double(box.min()[axis]) + double(box.max()[axis]));
      const double reach = 4.0 * box.extents().asVec3d()[box.maxExtent()];
      result.base[axis] =
          std::abs(middle) > reach ? 8 * static_cast<std::int32_t>(std::floor(middle / 8)) : 0;
    }
    // An affine map takes the box to a parallelepiped, bounded by its eight corners.
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d index((corner & 1 ? box.max() : box.min()).x(),
                                  (corner & 2 ? box.max() : box.min()).y(),
                                  (corner & 4 ? box.max() : box.min()).z());
      world.add(result.linear * index + translation);
    }
    result.origin = choose_origin(world);
  }
  // Large numbers cancel once, in double precision, instead of at every sample.
  const Eigen::Vector3d base(result.base[0], result.base[1], result.base[2]);
  result.offset = result.linear * base + (translation - result.origin);
  return result;
}

IndexToWorld placement_of(const LevelSet& level_set) { return placement_of(*level_set.grid().grid); }

SampleBox extent_of(const PolygonMesh& mesh, double voxel_size) {
  SampleBox extent;
  const Bounds box = bounds(mesh);
  for (int a = 0; a < 3; ++a) {
    // Edges that are crossed near the polygons, and the cells at them, are within a block.
    extent.lower[a] = static_cast<std::int32_t>(std::floor((box.lower[a] - mesh.origin[a]) / voxel_size)) - 8;
    extent.upper[a] = static_cast<std::int32_t>(std::ceil((box.upper[a] - mesh.origin[a]) / voxel_size)) + 16;
    extent.lower[a] &= ~7, extent.upper[a] &= ~7;
  }
  return extent;
}

LevelSet with_extent(const LevelSet& level_set, const SampleBox& extent) {
  return make_level_set(grid_with_extent(*level_set.grid().grid, extent));
}

LevelSet outline_of(const Eigen::Vector3d& origin, double voxel_size, const SampleBox& extent) {
  const auto grid = openvdb::FloatGrid::create();
  grid->setTransform(transform_at(origin, voxel_size));
  for (const Eigen::Vector3i& at : {extent.lower, Eigen::Vector3i(extent.upper - Eigen::Vector3i::Ones())})
    grid->tree().setValueOn(Coord(at[0], at[1], at[2]));
  return with_extent(make_level_set(grid), extent);
}

std::shared_ptr<openvdb::math::Transform> transform_at(const Eigen::Vector3d& origin, double voxel_size) {
  const auto transform = openvdb::math::Transform::createLinearTransform(voxel_size);
  transform->postTranslate(openvdb::Vec3d(origin.x(), origin.y(), origin.z()));
  return transform;
}

}  // namespace hermesh
