// How our voxelizer tells inside from outside.
#pragma once

namespace hermesh {

/// How a voxel's side is found.
enum class SignRule {
  automatic,  ///< flood fill, without the cavities that closed shells facing inwards bound, and winding
              ///< numbers where the flood leaks in through a hole; a note reports that
  automatic_sheets,  ///< as automatic, but polygons whose caps would be more than 1.5 % of their area enclose
                     ///< no more than what the flood does not reach: they are open sheets
  flood_fill,  ///< inside is what cannot be reached from infinity: any orientation, cavities filled (Aldén
               ///< §5.3)
  winding_number,  ///< inside is where the generalised winding number is above ½: keeps cavities, closes
                   ///< holes
  none             ///< no sign: distance alone
};

}  // namespace hermesh
