#include <algorithm>

#include "algorithms/core/parallel.h"
#include "algorithms/thesis/thesis_band.h"

namespace hermesh::thesis {
namespace {

/// Squared width of the band on either side, in voxels².
struct Limits {
  double exterior, interior;
};

/// Returns true if a voxel of the mask, on the block's side towards slot, has a neighbour in that slot's
/// block.
bool reaches(const BlockMask& mask, int slot) {
  constexpr std::uint64_t kAll = ~std::uint64_t(0);
  // Rows are y, columns z, in a word of one x: first, all, or last.
  constexpr std::uint64_t kRows[3] = {kFirstY, kAll, kLastY};
  constexpr std::uint64_t kColumns[3] = {kFirstZ, kAll, kLastZ};
  const std::uint64_t bits = kRows[slot / 3 % 3] & kColumns[slot % 3];
  std::uint64_t found = 0;
  for (int x = 0; x < 8; ++x)
    if (slot / 9 == 1 || x == (slot / 9 == 0 ? 0 : 7)) found |= mask[x] & bits;
  return found != 0;
}

/// Makes the blocks that the neighbours of the last layer lie in. Sequential, so that numbers are the same on
/// every run.
void add_blocks(Band& band, const RunContext& context) {
  const std::int32_t before = band.size();
  for (std::int32_t number = 0; number < before; ++number) {
    if (number % 1024 == 0) context.check();
    const BandBlock& block = band.block(number);
    if (!any(block.layer)) continue;
    for (int slot = 0; slot < 27; ++slot) {
      // Neighbours share a face or an edge, not a corner.
      const bool corner = slot / 9 != 1 && slot / 3 % 3 != 1 && slot % 3 != 1;
      if (slot == 13 || corner || block.neighbours[slot] != kNoBlock || !reaches(block.layer, slot)) continue;
      const Voxel& lower = block.lower;
      band.find_or_add(
          {lower[0] + 8 * (slot / 9 - 1), lower[1] + 8 * (slot / 3 % 3 - 1), lower[2] + 8 * (slot % 3 - 1)});
    }
  }
  band.link(before, context);
}

/// One layer of §5.5.
struct Expansion {
  Band& band;
  const Triangles& triangles;
  Limits limits;

  /// Adds a voxel as algorithm 5 does: by the triangle of the neighbour that is nearest to the surface, even
  /// if that triangle is not the nearest to the voxel. Threads write distances only where none is set, which
  /// are not read.
  void add_voxel(BandBlock& block, int sample) const {
    Place closest{nullptr, 0};
    for (const std::array<int, 3>& step : kNeighbours) {
      const Place there = neighbour(band, block, sample, step);
      if (there.in(&BandBlock::set) &&
          (!closest.block || there.squared_distance() < closest.squared_distance()))
        closest = there;
    }
    const bool outside = closest.in(&BandBlock::outside);
    const std::uint32_t triangle = closest.block->triangle[closest.sample];
    const Eigen::Vector3d p = centre(block.voxel(sample));
    const double squared = (closest_point(triangles[triangle], p) - p).squaredNorm();
    if (!(squared < (outside ? limits.exterior : limits.interior))) return;
    block.squared_distance[sample] = float(squared);
    block.triangle[sample] = triangle;
    add(block.found, sample);
    if (outside) add(block.found_outside, sample);
  }

  /// Tests the voxels around the last layer. The results are stored until all blocks are done, so that a
  /// layer depends only on the layers before it.
  void find_voxels(BandBlock& block) const {
    block.found = block.found_outside = {};
    const BlockMask near = PaddedMask(band, block, &BandBlock::layer).face_and_edge_neighbours();
    for_each_bit(without(near, block.set), [&](int sample) { add_voxel(block, sample); });
  }
};

/// Makes the results the last layer.
void take_layer(BandBlock& block) {
  block.layer = block.found;
  block.set = either(block.set, block.found);
  block.outside = either(block.outside, block.found_outside);
}

}  // namespace

void expand(Band& band, const Triangles& triangles, double exterior, double interior, RunContext& context) {
  const Stage stage(context, "expansion");
  const auto for_each_block = [&](auto&& f) {
    parallel_blocks(std::size_t(band.size()), context,
                    [&](std::size_t i) { f(band.block(std::int32_t(i))); });
  };
  const Expansion expansion{band, triangles, {exterior * exterior, interior * interior}};
  // "In the initial step all non-boundary voxels are visited."
  for_each_block([](BandBlock& block) { block.layer = without(block.set, block.boundary); });
  const double layers = std::max(exterior, interior);
  bool more = true;
  for (double layer = 1.0; more; ++layer) {
    context.progress("expansion", std::min(1.0, layer / (layers + 1.0)));
    add_blocks(band, context);
    for_each_block([&](BandBlock& block) { expansion.find_voxels(block); });
    for_each_block(take_layer);
    more = false;
    for (std::int32_t number = 0; number < band.size(); ++number) more |= any(band.block(number).layer);
  }
}

}  // namespace hermesh::thesis
