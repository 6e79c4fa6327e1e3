// What the vector code for one leaf's crossings reads: samples and signs of the leaf and its neighbours.
// Heavy (OpenVDB): include it from .cpp files.
#pragma once

#include <algorithm>
#include <array>
#include <limits>

#include "algorithms/hermite/edge_kernels/edge_kernels.h"
#include "algorithms/hermite/incomplete_stencil.h"

namespace hermesh {

namespace detail {
constexpr std::array<float, 512> make_no_data() {
  std::array<float, 512> values{};
  for (float& value : values) value = std::numeric_limits<float>::infinity();
  return values;
}
inline constexpr std::array<float, 512> kNoData = make_no_data();
}  // namespace detail

/// One leaf's. It must outlive the input that it fills.
class LeafStencils final : public edge_kernels::PlainCrossing {
 public:
  LeafStencils(const SampledVolume& volume, std::size_t leaf)
      : volume_(volume), leaf_(leaf), around_(volume.table.surroundings(leaf)) {}

  /// Leaf numbers, as LeafTable::surroundings().
  const std::array<std::int32_t, 27>& around() const { return around_; }

  /// All but the signs.
  void fill(edge_kernels::LeafInput& input) {
    const LeafTable& table = volume_.table;
    for (int slot = 0; slot < 27; ++slot) {
      const std::int32_t there = around_[slot];
      input.values[slot] = there >= 0 ? table.values(static_cast<std::size_t>(there)) : detail::kNoData.data();
    }
    if (volume_.masked) {
      for (int slot = 0; slot < 27; ++slot) {
        active_[slot] = around_[slot] >= 0 ? table.active(static_cast<std::size_t>(around_[slot])) : BlockMask{};
        input.active[slot] = active_[slot].data();
      }
    } else {
      input.active[13] = nullptr;
    }
    constexpr float kSquarable = 1e18f;  // twice it, squared and three times, is a number
    input.data_below = std::min(volume_.data_below, kSquarable);
    input.isovalue = table.rule().isovalue;
    input.scale = table.rule().scale;
    input.incomplete = this;
  }

  /// Asks for the samples that the leaf's stencils read: they lie where no machine can guess, and waiting for them costs
  /// more than the arithmetic. The leaf below along z is taken for read, since it comes before this one. (Inlined always:
  /// g++ takes a function that does nothing else for one without an effect, and drops the calls.)
  [[gnu::always_inline]] void prefetch() const {
    constexpr int kLine = 16;  // samples
    prefetch(0, 0, 0, 0, kLine, 32);
    prefetch(0, 0, 1, 0, kLine, 32);
    prefetch(1, 0, 0, 0, kLine, 8);         // layers 0 and 1
    prefetch(-1, 0, 0, 7 * 64, kLine, 4);   // layer 7
    prefetch(0, 1, 0, 0, 64, 8);            // rows 0 and 1 of each layer
    prefetch(0, -1, 0, 7 * 8, 64, 8);       // row 7
  }

  void crossing(int x, int y, int z, int axis, float* record) const override {
    const EdgeCrossing crossing = IncompleteStencil(volume_, leaf_).sample(x, y, z, axis);
    record[0] = crossing.offset;
    for (int k = 0; k < 3; ++k) record[1 + k] = crossing.normal[(axis + k) % 3];
  }

 private:
  [[gnu::always_inline]] void prefetch(int dx, int dy, int dz, int first, int stride, int count) const {
    const std::int32_t there = around_[neighbour_slot(dx, dy, dz)];
    if (there < 0) return;
    const float* values = volume_.table.values(static_cast<std::size_t>(there)) + first;
    for (int i = 0; i < count; ++i) __builtin_prefetch(values + stride * i);
  }

  const SampledVolume& volume_;
  std::size_t leaf_;
  std::array<std::int32_t, 27> around_;
  std::array<BlockMask, 27> active_;
};

}  // namespace hermesh
