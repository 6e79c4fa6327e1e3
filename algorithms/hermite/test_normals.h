// For tests: the crossings of Hermite data as positions with normals.
#pragma once

#include <Eigen/Core>

#include "algorithms/hermite/sparse_hermite.h"

namespace hermesh {

/// Calls f(position, normal) for every crossing, in index space.
template <class F>
void for_each_normal(const FloatHermite& hermite, F&& f) {
  for (std::size_t leaf = 0; leaf < hermite.leaves.size(); ++leaf)
    for_each_crossing(hermite, leaf, [&](int axis, int sample, const EdgeCrossing& crossing) {
      const auto& lower = hermite.leaves[leaf].lower;
      Eigen::Vector3d place(lower[0] + (sample >> 6), lower[1] + ((sample >> 3) & 7),
                            lower[2] + (sample & 7));
      place[axis] += crossing.offset;
      f(place, Eigen::Vector3d(crossing.normal[0], crossing.normal[1], crossing.normal[2]));
    });
}

}  // namespace hermesh
