#include "algorithms/hermite/leaf_stencils.h"

#include "algorithms/core/level_set_grid.h"

namespace hermesh {

std::optional<SampledVolume> sampled_volume(const LeafPlaces& leaves, const LevelSet& level_set) {
  const openvdb::FloatGrid& grid = *level_set.grid().grid;
  const float background = std::fabs(grid.background());
  const SampledVolume all{leaves, false, background}, active{leaves, true, std::numeric_limits<float>::max()};
  if (grid.getGridClass() != openvdb::GRID_LEVEL_SET || leaves.rule().isovalue != 0.0f || background == 0.0f)
    return active;
  const std::optional<float> nearest = leaves.nearest_tile_inside();
  if (!nearest) return std::nullopt;
  return *nearest > -background ? active : all;
}

SampledVolume sampled_volume(const LeafTable& table, const LevelSet& level_set) {
  if (const auto volume = sampled_volume(static_cast<const LeafPlaces&>(table), level_set)) return *volume;
  const float background = std::fabs(level_set.grid().grid->background());
  if (table.has_inactive_inside_nearer_than(background))
    return {table, true, std::numeric_limits<float>::max()};
  return {table, false, background};
}

}  // namespace hermesh
