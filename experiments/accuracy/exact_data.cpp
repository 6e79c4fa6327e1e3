#include "experiments/accuracy/exact_data.h"

#include <openvdb/tools/SignedFloodFill.h>

#include <array>
#include <cmath>
#include <vector>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/lattice/grid_placement.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using Leaf = openvdb::FloatTree::LeafNodeType;

/// Samples that hold the shape, with `margin` more on each side.
BoundsOf<std::int32_t> lattice_box(const PlacedShape& shape, double voxel_size, int margin) {
  const Bounds box = shape.bounds();
  BoundsOf<std::int32_t> result;
  for (int a = 0; a < 3; ++a) {
    result.lower[a] = std::int32_t(std::floor(box.lower[a] / voxel_size)) - margin;
    result.upper[a] = std::int32_t(std::ceil(box.upper[a] / voxel_size)) + margin;
  }
  return result;
}

}  // namespace

LevelSet exact_level_set(const PlacedShape& shape, double voxel_size, double half_width,
                         RunContext& context) {
  const double reach = half_width * voxel_size;
  if (reach > shape.shape().exact_within())
    throw Error(
        "the shape does not know distances as large as the band at this voxel size; use smaller voxels");
  const BoundsOf<std::int32_t> box = lattice_box(shape, voxel_size, int(std::ceil(half_width)) + 2);
  std::vector<openvdb::Coord> blocks;
  const auto first = [](std::int32_t index) { return index & ~7; };
  for (std::int32_t x = first(box.lower[0]); x <= box.upper[0]; x += 8)
    for (std::int32_t y = first(box.lower[1]); y <= box.upper[1]; y += 8)
      for (std::int32_t z = first(box.lower[2]); z <= box.upper[2]; z += 8) blocks.emplace_back(x, y, z);

  std::vector<Leaf*> leaves(blocks.size(), nullptr);
  parallel_blocks(blocks.size(), context, [&](std::size_t i) {
    const auto place = [&](const openvdb::Coord& at) -> Vector3d {
      return voxel_size * Vector3d(at.x(), at.y(), at.z());
    };
    // The farthest sample is 3.5 √3 voxels from the middle, and a distance changes by no more than the way.
    const Vector3d middle = place(blocks[i]) + Vector3d::Constant(3.5 * voxel_size);
    if (std::abs(shape.bounded_distance(middle)) > reach + 6.1 * voxel_size) return;
    Leaf* leaf = new Leaf(blocks[i], float(reach), false);
    for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
      const double distance = shape.distance(place(leaf->offsetToGlobalCoord(n)));
      if (std::abs(distance) < reach)
        leaf->setValueOn(n, float(distance));
      else
        leaf->setValueOff(n, float(std::copysign(reach, distance)));
    }
    leaves[i] = leaf;
  });
  auto grid = openvdb::FloatGrid::create(float(reach));
  grid->setTransform(transform_at(Vector3d::Zero(), voxel_size));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setName("sdf");
  for (Leaf* leaf : leaves) {
    if (!leaf) continue;
    if (leaf->isEmpty())
      delete leaf;  // of no active voxel
    else
      grid->tree().addLeaf(leaf);
  }
  openvdb::tools::signedFloodFill(grid->tree());
  return make_level_set(grid);
}

FloatHermite exact_hermite(const PlacedShape& shape, const LevelSet& level_set, RunContext& context) {
  const BoundsOf<std::int32_t> box = lattice_box(shape, level_set.voxel_size(), 4);
  const AnalyticSurface surface = {
      .value = [&](const Vector3d& p) { return shape.bounded_distance(p); },
      .gradient = [&](const Vector3d& p) -> Vector3d { return shape.nearest(p).normal; }};
  const auto sample = [](const Eigen::Vector3i& at) { return std::array{at[0], at[1], at[2]}; };
  return sample_function(surface, placement_of(*level_set.grid().grid), sample(box.lower), sample(box.upper),
                         1e-9, context);
}

BandErrors band_errors(const PlacedShape& shape, const LevelSet& level_set, double near,
                       const RunContext& context) {
  const openvdb::FloatGrid& grid = *level_set.grid().grid;
  std::vector<const Leaf*> leaves;
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) leaves.push_back(&*leaf);
  std::vector<BandErrors> parts(leaves.size());
  parallel_blocks(leaves.size(), context, [&](std::size_t i) {
    BandErrors& part = parts[i];
    for (auto value = leaves[i]->cbeginValueOn(); value; ++value) {
      const openvdb::Vec3d world = grid.indexToWorld(value.getCoord());
      const Vector3d p(world.x(), world.y(), world.z());
      const double truth = shape.distance(p), off = std::abs(double(*value) - truth);
      if (std::abs(truth) > shape.shape().exact_within() || !shape.describes(p)) continue;
      ++part.voxels;
      part.rms += off * off;
      part.max = std::max(part.max, off);
      part.wrong_signs += std::abs(truth) > near && (*value < 0) != (truth < 0);
    }
  });
  BandErrors all;
  for (const BandErrors& part : parts) {
    all.voxels += part.voxels;
    all.rms += part.rms;
    all.max = std::max(all.max, part.max);
    all.wrong_signs += part.wrong_signs;
  }
  if (all.voxels > 0) all.rms = std::sqrt(all.rms / double(all.voxels));
  return all;
}

}  // namespace hermesh
