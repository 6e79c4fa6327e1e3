// Signs by the generalised winding number, which changes by a whole number at a triangle and smoothly
// elsewhere, so that most blocks of voxels need a single evaluation for each of their components.
#pragma once

#include "algorithms/voxelization/inside/signs.h"
#include "algorithms/voxelization/inside/winding_number.h"

namespace hermesh {

/// Signs of the band's voxels: inside is where `winding` is above ½. Where neighbouring components disagree
/// or the number is near ½, as it is around a hole, every voxel is asked; the surface of the value ½ across
/// the hole is followed through space without blocks and returned as the caps. `open` says whether the
/// surface may have holes at all; a closed one is not searched for their rims. `reach` is how far distances
/// matter, in voxels.
/// @throws Cancelled.
Signs winding_signs(const WindingNumber& winding, const BlockTable& table, const Band& band,
                    const Regions& regions, bool open, double reach, const RunContext& context);

}  // namespace hermesh
