// What the vector code for one leaf's crossings reads: samples of the leaf and its neighbours.
#pragma once

#include <algorithm>
#include <array>

#include "algorithms/hermite/edge_kernels/edge_kernels.h"
#include "algorithms/hermite/incomplete_stencil.h"

namespace hermesh {

/// Stencils of one leaf's edges. They must outlive the input that they fill.
class LeafStencils final : public edge_kernels::PlainCrossing {
 public:
  LeafStencils(const SampledVolume& volume, std::size_t leaf)
      : volume_(volume), leaf_(leaf), around_(volume.leaves.surroundings(leaf)) {}

  void fill(edge_kernels::LeafInput& input) {
    const LeafPlaces& leaves = volume_.leaves;
    for (int slot = 0; slot < 27; ++slot) input.values[slot] = leaves.values(around_[slot]);
    if (volume_.masked) {
      for (int slot = 0; slot < 27; ++slot) {
        active_[slot] =
            around_[slot] >= 0 ? leaves.active(static_cast<std::size_t>(around_[slot])) : BlockMask{};
        input.active[slot] = active_[slot].data();
      }
    } else {
      input.active[13] = nullptr;
    }
    constexpr float kSquarable = 1e18f;  // twice it, squared and three times, is a number
    input.data_below = std::min(volume_.data_below, kSquarable);
    input.isovalue = leaves.rule().isovalue;
    input.scale = leaves.rule().scale;
    input.incomplete = this;
  }

  void crossing(int x, int y, int z, int axis, float* record) const override {
    const EdgeCrossing crossing = IncompleteStencil(volume_, leaf_).sample(x, y, z, axis);
    record[0] = crossing.offset;
    for (int k = 0; k < 3; ++k) record[1 + k] = crossing.normal[(axis + k) % 3];
  }

 private:
  const SampledVolume& volume_;
  std::size_t leaf_;
  std::array<std::int32_t, 27>
      around_;  ///< numbers of the leaves around, as LeafPlaces::surroundings() gives them
  std::array<BlockMask, 27> active_;
};

}  // namespace hermesh
