#include "algorithms/voxelization/hermesh_voxelizer.h"

#include "algorithms/core/level_set_grid.h"
#include "algorithms/voxelization/voxelize.h"

namespace hermesh {
namespace {

// The caller has checked the value against the choices below, so what is none of these three is "auto". An
// input made without options, as tests make it, has declared none, and is "auto" too.
SignRule sign_rule(const Options& options) {
  if (options.is("signs", "flood-fill")) return SignRule::flood_fill;
  if (options.is("signs", "winding-number")) return SignRule::winding_number;
  if (options.is("signs", "unsigned")) return SignRule::none;
  if (options.is("signs", "auto-sheets")) return SignRule::automatic_sheets;
  return SignRule::automatic;
}

}  // namespace

// The first choice is the one that needs no knowledge of the mesh.
std::vector<OptionSpec> hermesh_voxelizer_options() {
  return {
      {.name = "signs",
       .fallback = "auto",
       .help =
           "inside is what infinity cannot reach, or what the polygons wind around; auto floods, and winds "
           "where the flood leaks in; auto-sheets does not wind where that would close large holes",
       .choices = {"auto", "auto-sheets", "flood-fill", "winding-number", "unsigned"}}};
}

VoxelizeOptions voxelize_options(const VoxelizationInput& input) {
  // `nearest` stays off: a LevelSet has no place for triangles. Who wants them calls voxelize() itself
  // (outputs/).
  return {.voxel_size = input.voxel_size,
          .exterior_band = input.exterior_band,
          .interior_band = input.interior_band,
          .signs = sign_rule(input.options)};
}

LevelSet hermesh_voxelizer(const VoxelizationInput& input) {
  // Without an inside the grid is "udf" and not of class level set; where signs were asked for, a note says
  // why.
  return make_level_set(voxelize(input.mesh, voxelize_options(input), input.context).distance);
}

}  // namespace hermesh
