// Our voxelizer as a variant: any polygon soup to a narrow band of exact distances. See voxelize.h.
#pragma once

#include "algorithms/core/variant.h"

namespace hermesh {

struct VoxelizeOptions;  // voxelize.h

/// The rule that decides which voxels are inside.
enum class SignRule {
  automatic,  ///< flood fill, without the cavities that closed shells facing inwards bound; winding numbers,
              ///< with a note, if the flood leaks in through a hole
  automatic_sheets,  ///< as automatic, but polygons whose caps would be more than 1.5 % of their area are
                     ///< open sheets, which enclose only regions that the flood does not reach
  flood_fill,  ///< inside is all that infinity cannot reach: any orientation, cavities filled (Aldén §5.3)
  winding_number,  ///< inside is where the generalised winding number is above ½: keeps cavities, closes
                   ///< holes
  none             ///< distances without sign
};

/// Returns the options that the variant declares: signs.
std::vector<OptionSpec> hermesh_voxelizer_options();

/// Returns the input's options in the form that voxelize() takes. An input without options has the defaults.
VoxelizeOptions voxelize_options(const VoxelizationInput& input);

/// Returns the level set that voxelize() makes of the mesh with the input's options; "udf", and not of class
/// level set, if there is no inside.
/// @throws Error as check_voxelization_fits(); Cancelled.
LevelSet hermesh_voxelizer(const VoxelizationInput& input);

}  // namespace hermesh
