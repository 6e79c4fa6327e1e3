#include "reference/exact_voxelizer.h"

#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <bitset>
#include <cmath>
#include <functional>
#include <optional>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/lattice/grid_placement.h"
#include "algorithms/lattice/memory_estimate.h"
#include "reference/distance_oracle.h"
#include "reference/winding_oracle.h"

namespace hermesh {
namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;
using BlockOrigin = std::array<int, 3>;

struct Band {
  double exterior, interior;  // voxels
  double widest() const { return std::max(exterior, interior); }
};

/// Depth, in voxels, that a voxel inside gets if it lies on the surface, so that its value has a sign.
constexpr double kLeastDepth = 0x1p-24;
/// Longest and shortest edges, in voxels, of the pieces by which the solid's boundary is distinguished from
/// the sheets within it.
constexpr double kLargest = 0.7, kFinest = 0.02;

/// The surface that distances are measured to, and the function that decides which points are inside.
struct Solid {
  const DistanceOracle& boundary;
  std::function<bool(const Eigen::Vector3d&)> inside;
};

/// The leaf at `origin`; null if no voxel of it is in the band.
std::unique_ptr<Leaf> make_leaf(const Solid& solid, const BlockOrigin& origin, const Band& band,
                                double voxel_size) {
  // A leaf was chosen because its centre is within the band and half a diagonal; its voxels are half a
  // diagonal off.
  const double reach = band.widest() + 2.0 * 3.5 * std::sqrt(3.0) + 1.0;
  const std::array<double, kBlockVoxels> distance = block_distances(solid.boundary, origin, reach);
  if (*std::min_element(distance.begin(), distance.end()) >= band.widest()) return nullptr;

  const std::bitset<kBlockVoxels> negative = block_inside(origin, distance, solid.inside);
  auto leaf = std::make_unique<Leaf>(openvdb::Coord(origin[0], origin[1], origin[2]));
  for (openvdb::Index i = 0; i < kBlockVoxels; ++i) {
    const double limit = negative[i] ? band.interior : band.exterior;
    const double value = std::clamp(distance[i], negative[i] ? kLeastDepth : 0.0, limit) * voxel_size;
    leaf->setValueOnly(i, float(negative[i] ? -value : value));
    leaf->setActiveState(i, distance[i] < limit);
  }
  if (leaf->isEmpty()) return nullptr;
  return leaf;
}

/// Leaves are made in parallel, a batch at a time so that this thread can report, and inserted in their
/// order.
void fill(openvdb::FloatTree& grid, const Solid& solid, const std::vector<BlockOrigin>& origins,
          const Band& band, double voxel_size, const RunContext& context) {
  constexpr std::size_t kBatch = 512;
  for (std::size_t first = 0; first < origins.size(); first += kBatch) {
    context.progress("voxelization", double(first) / double(origins.size()));
    std::vector<std::unique_ptr<Leaf>> leaves(std::min(kBatch, origins.size() - first));
    tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t i) {
      context.check();
      leaves[i] = make_leaf(solid, origins[first + i], band, voxel_size);
    });
    for (std::unique_ptr<Leaf>& leaf : leaves)
      if (leaf) grid.addLeaf(leaf.release());
  }
}

/// The triangles in pieces of at most kLargest, so that nothing passes between the points that
/// solid_boundary() samples.
std::vector<Corners> in_pieces(const std::vector<Corners>& triangles) {
  std::vector<Corners> pieces, todo = triangles;
  while (!todo.empty()) {
    const Corners t = todo.back();
    todo.pop_back();
    std::size_t longest = 0;
    const auto length = [&](std::size_t i) { return (t[(i + 1) % 3] - t[i]).norm(); };
    for (std::size_t i = 1; i < 3; ++i)
      if (length(i) > length(longest)) longest = i;
    if (length(longest) <= kLargest) {
      pieces.push_back(t);
      continue;
    }
    const Eigen::Vector3d &a = t[longest], &b = t[(longest + 1) % 3], &c = t[(longest + 2) % 3],
                          middle = 0.5 * (a + b);
    todo.push_back({a, middle, c});
    todo.push_back({middle, b, c});
  }
  return pieces;
}

/// The part of the surface that bounds the solid. @throws Error if no part does.
std::vector<Corners> wound_boundary(const DistanceOracle& surface, const WindingOracle& winding,
                                    const RunContext& context) {
  std::vector<Corners> boundary =
      solid_boundary(DistanceOracle(in_pieces(surface.triangles())), winding, kFinest, context);
  if (boundary.empty()) throw Error("The polygons wind around nothing: there is no solid to voxelize.");
  return boundary;
}

}  // namespace

LevelSet exact_voxelizer(const VoxelizationInput& input) {
  check_voxelization_fits(input.mesh, input.voxel_size, input.exterior_band, input.interior_band);
  const Stage stage(input.context, "voxelization");
  initialize_openvdb();
  const DistanceOracle surface(triangles_in_voxels(input.mesh, input.voxel_size));
  std::optional<WindingOracle> winding;
  std::optional<DistanceOracle> wound;
  if (input.options.is("signs", "winding-number")) {
    winding.emplace(surface);
    wound.emplace(wound_boundary(surface, *winding, input.context));
  }
  const Solid solid{wound ? *wound : surface, [&](const Eigen::Vector3d& place) {
                      return winding ? winding->inside(place) : surface.parity(place).inside();
                    }};

  const Band band{input.exterior_band, input.interior_band};
  const auto outside = float(band.exterior * input.voxel_size),
             within = float(-band.interior * input.voxel_size);
  const openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(outside);
  fill(grid->tree(), solid, solid.boundary.blocks_within(band.widest(), input.context), band,
       input.voxel_size, input.context);
  // From level 1 on: the leaves know the signs of their inactive voxels already.
  openvdb::tools::signedFloodFillWithValues(grid->tree(), outside, within, true, 1, 1);

  grid->setTransform(transform_at(input.mesh.origin, input.voxel_size));
  grid->setName("sdf");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return make_level_set(grid);
}

}  // namespace hermesh
