#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/core/parallel.h"
#include "algorithms/hermite/samplers.h"

namespace hermesh {
namespace {

/// The block's samples with one layer of its neighbours' around it; NaN where there is no active sample.
class Apron {
 public:
  Apron(const BlockGrid& grid, std::int32_t block) {
    for (int x = -1; x < 10; ++x)
      for (int y = -1; y < 10; ++y)
        for (int z = -1; z < 10; ++z) {
          const auto at = grid.locate(block, x, y, z);
          const bool there = at.block >= 0 && test(grid.blocks()[at.block].active, at.sample);
          values_[index(x, y, z)] = there ? grid.signed_value(grid.blocks()[at.block], at.sample)
                                          : std::numeric_limits<double>::quiet_NaN();
        }
  }

  /// Derivative along each axis at a sample of the block or one step beyond it; 0 along an axis without data.
  Eigen::Vector3d gradient(int x, int y, int z) const {
    constexpr int kStride[3] = {121, 11, 1};
    const int here = index(x, y, z);
    Eigen::Vector3d result;
    for (int axis = 0; axis < 3; ++axis) {
      const double below = values_[here - kStride[axis]], at = values_[here],
                   above = values_[here + kStride[axis]];
      const double central = 0.5 * (above - below), forward = above - at, backward = at - below;
      result[axis] = !std::isnan(central)    ? central
                     : !std::isnan(forward)  ? forward
                     : !std::isnan(backward) ? backward
                                             : 0.0;
    }
    return result;
  }

 private:
  static int index(int x, int y, int z) { return 121 * (x + 1) + 11 * (y + 1) + (z + 1); }
  std::array<double, 11 * 11 * 11> values_;
};

void sample_block(const BlockGrid& grid, std::int32_t source, const HermiteBlock& block) {
  if (!any(block.crossing[0]) && !any(block.crossing[1]) && !any(block.crossing[2])) return;
  const Apron apron(grid, source);
  for (int axis = 0; axis < 3; ++axis)
    for_each_bit(block.crossing[axis], [&](int sample) {
      const int x = sample >> 6, y = (sample >> 3) & 7, z = sample & 7;
      const int dx = axis == 0, dy = axis == 1, dz = axis == 2;
      const auto end = grid.locate(source, x + dx, y + dy, z + dz);
      const double from = grid.signed_value(grid.blocks()[source], sample);
      const double to = grid.signed_value(grid.blocks()[end.block], end.sample);
      const double offset = from / (from - to);

      Eigen::Vector3d normal =
          (1.0 - offset) * apron.gradient(x, y, z) + offset * apron.gradient(x + dx, y + dy, z + dz);
      // Where two sheets are close the gradient may vanish or point back inside; the edge itself is then the
      // best guess.
      const double rise = to > from ? 1.0 : -1.0;
      if (!(normal[axis] * rise > 0)) normal[axis] = std::abs(to - from) * rise;
      normal.normalize();
      HermiteVoxel& voxel = block.voxels[sample];
      voxel.offset[axis] = static_cast<float>(offset);
      for (int a = 0; a < 3; ++a) voxel.normal[axis][a] = static_cast<float>(normal[a]);
    });
}

}  // namespace

HermiteGrid sample_level_set(const BlockGrid& grid, RunContext& context) {
  Stage stage(context, "Hermite data from the level set");
  std::vector<std::int32_t> source;
  HermiteGrid result(grid, source, context);
  const std::vector<HermiteBlock>& blocks = result.blocks();
  parallel_blocks(blocks.size(), context, [&](std::size_t i) { sample_block(grid, source[i], blocks[i]); });
  return result;
}

}  // namespace hermesh
