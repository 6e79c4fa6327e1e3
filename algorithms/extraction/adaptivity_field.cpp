#include "algorithms/extraction/adaptivity_field.h"

#include <openvdb/tools/Interpolation.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "algorithms/core/error.h"
#include "algorithms/core/level_set_grid.h"

namespace hermesh {
namespace {

// An accessor that does not register with the tree, which would insert into a table shared by all threads for
// each block of cells. It must not outlive a change of the tree; these trees do not change.
using Accessor = openvdb::FloatGrid::ConstUnsafeAccessor;

openvdb::Vec3d index_of(const openvdb::FloatGrid& grid, const Eigen::Vector3d& world) {
  return grid.worldToIndex({world[0], world[1], world[2]});
}

float interpolated(const Accessor& accessor, const openvdb::Vec3d& index) {
  return openvdb::tools::BoxSampler::sample(accessor, index);
}

void check_linear(const openvdb::FloatGrid& grid, const char* what) {
  if (!grid.transform().isLinear()) throw Error(std::string(what) + " has a transform with perspective");
}

void check_scale(const openvdb::FloatGrid& grid) {
  // An imported volume with the least value 0 has the next smaller normal number as background.
  const auto good = [](float value) {
    return std::isfinite(value) && value >= -std::numeric_limits<float>::min();
  };
  // Inactive values count, too, because interpolation reads all samples.
  if (!good(grid.background()))
    throw Error(
        "the scale of the tolerance has a background that is negative or not finite; give it one of 0 or "
        "more");
  for (auto it = grid.cbeginValueAll(); it; ++it) {
    if (good(*it)) continue;
    std::ostringstream place;
    place << it.getCoord();
    throw Error("the scale of the tolerance is negative or not finite at index " + place.str() +
                "; give it values of 0 or more");
  }
}

/// Returns the centre of a cell of a block, relative to the block's first sample.
Eigen::Vector3d centre(int cell) { return {(cell >> 6) + 0.5, ((cell >> 3) & 7) + 0.5, (cell & 7) + 0.5}; }

}  // namespace

FieldEvaluator::FieldEvaluator(const AdaptivityField* field, const IndexToWorld& placement)
    : placement_(placement) {
  if (!field) return;
  if (field->scale) {
    check_linear(*field->scale.grid().grid, "the scale of the tolerance");
    check_scale(*field->scale.grid().grid);
    scale_ = field->scale;
  }
  // If the bound holds everywhere, the mask stays empty, and inside() returns all cells.
  if (!field->mask || field->outside == AdaptivityField::Outside::everywhere) return;
  mask_ = field->mask;
  outside_ = field->outside;
  const openvdb::FloatGrid& grid = *mask_.grid().grid;
  check_linear(grid, "the mask");
  is_level_set_ = grid.getGridClass() == openvdb::GRID_LEVEL_SET;
  for (int corner = 0; corner < 8; ++corner) {
    // The map may shear: the longest of the diagonals of a block bounds all.
    const Eigen::Vector3d half(corner & 1 ? 4 : -4, corner & 2 ? 4 : -4, corner & 4 ? 4 : -4);
    block_radius_ = std::max(block_radius_, (placement.linear * half).norm());
  }
  // Largest error of interpolated distances.
  block_radius_ += grid.voxelSize().length();
}

Eigen::Vector3d FieldEvaluator::world(const std::array<std::int32_t, 3>& lower,
                                      const Eigen::Vector3d& local) const {
  // The base is subtracted in integers, which is exact.
  const Eigen::Vector3d index(lower[0] - placement_.base[0], lower[1] - placement_.base[1],
                              lower[2] - placement_.base[2]);
  return placement_.origin + placement_.local(index + local);
}

BlockMask FieldEvaluator::inside(const std::array<std::int32_t, 3>& lower, const BlockMask& cells) const {
  if (!mask_) return cells;
  const openvdb::FloatGrid& grid = *mask_.grid().grid;
  const Accessor accessor = grid.getConstUnsafeAccessor();
  const auto at = [&](const Eigen::Vector3d& local) { return index_of(grid, world(lower, local)); };
  BlockMask result{};
  // Distances are 1-Lipschitz, so the middle may decide for the whole block. The background of a band
  // narrower than the block's radius never exceeds that, and every cell is tested.
  if (is_level_set_) {
    const float middle = interpolated(accessor, at(Eigen::Vector3d::Constant(4.0)));
    if (std::fabs(middle) > block_radius_) return middle < 0.0f ? cells : result;
  }
  for_each_bit(cells, [&](int cell) {
    const openvdb::Vec3d index = at(centre(cell));
    // Masks of other classes may contain labels, which cannot be interpolated.
    const bool in = is_level_set_
                        ? interpolated(accessor, index) < 0.0f
                        : openvdb::tools::PointSampler::sample(accessor, index) != grid.background();
    if (in) result[cell >> 6] |= std::uint64_t{1} << (cell & 63);
  });
  return result;
}

void FieldEvaluator::scales(const std::array<std::int32_t, 3>& lower, const BlockMask& cells,
                            std::array<float, 512>& out) const {
  const openvdb::FloatGrid& grid = *scale_.grid().grid;
  const Accessor accessor = grid.getConstUnsafeAccessor();
  for_each_bit(cells, [&](int cell) {
    const float scale = interpolated(accessor, index_of(grid, world(lower, centre(cell))));
    // A background just below 0, which check_scale() tolerates, counts as 0.
    out[static_cast<std::size_t>(cell)] = std::max(scale, 0.0f);
  });
}

void drop_unused_points(PolygonMesh& mesh) {
  constexpr std::uint32_t kUnused = 0xffffffffu;
  std::vector<std::uint32_t> number(mesh.points.size(), kUnused);
  const auto for_each_corner = [&](auto&& f) {
    for (Triangle& triangle : mesh.triangles)
      for (std::uint32_t& point : triangle) f(point);
    for (Quad& quad : mesh.quads)
      for (std::uint32_t& point : quad) f(point);
  };
  for_each_corner([&](std::uint32_t point) { number[point] = 0; });
  // In place, because the new index of a vertex never exceeds the old one.
  std::uint32_t next = 0;
  for (std::size_t i = 0; i < number.size(); ++i) {
    if (number[i] == kUnused) continue;
    mesh.points[next] = mesh.points[i];
    number[i] = next++;
  }
  if (next == mesh.points.size()) return;
  mesh.points.resize(next);
  for_each_corner([&](std::uint32_t& point) { point = number[point]; });
}

}  // namespace hermesh
