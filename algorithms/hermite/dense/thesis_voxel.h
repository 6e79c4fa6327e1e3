// What of ThesisVoxel packs normals and unpacks them: apart, so that voxels.h needs no normal code.
#pragma once

#include "algorithms/hermite/dense/voxels.h"
#include "algorithms/hermite/normal_codes/thesis.h"

namespace hermesh {

inline void ThesisVoxel::set(int axis, const EdgeCrossing& crossing) {
  set_edge(axis, ThesisNormalCode::pack(crossing.normal), quantize(crossing.offset));
  if (axis == 2) set_word(word() | kBit30);
}

inline EdgeCrossing ThesisVoxel::get(int axis) const {
  return {reconstruct(offset(axis)), ThesisNormalCode::unpack(normal(axis))};
}

}  // namespace hermesh
