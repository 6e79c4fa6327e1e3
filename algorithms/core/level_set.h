// The scalar volume between the stages. Light: level_set_grid.h has the OpenVDB grid.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <utility>

namespace hermesh {

struct LevelSetGrid;  // level_set_grid.h

/// A sparse scalar grid of floats with its placement. As a level set: signed distance in world units,
/// negative inside, exact within a narrow band and ±background beyond. Copies share the grid, which is
/// constant once it is made.
class LevelSet {
 public:
  LevelSet() = default;
  explicit LevelSet(std::shared_ptr<const LevelSetGrid> grid) : grid_(std::move(grid)) {}

  const LevelSetGrid& grid() const { return *grid_; }
  explicit operator bool() const { return grid_ != nullptr; }

  double voxel_size() const;  ///< world units, cube root of the voxel's volume
  double background() const;  ///< world units
  std::size_t active_voxels() const;
  std::size_t memory_bytes() const;       ///< bytes that the tree has allocated
  std::array<int, 3> dimensions() const;  ///< sides of the box of the active voxels, in voxels

 private:
  std::shared_ptr<const LevelSetGrid> grid_;
};

/// Returns the least and the greatest active value, tiles included; the background twice if the volume has no
/// active voxels.
std::pair<float, float> value_range(const LevelSet& volume);

}  // namespace hermesh
