// Input of the vector code for one leaf's crossings, and the crossings that vector code leaves over, whose
// stencils reach beyond the data or the range of single precision.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "algorithms/hermite/edge_kernels/edge_kernels.h"
#include "algorithms/lattice/leaf_table.h"

namespace hermesh {

/// A volume's samples, and the criterion for data among them.
struct SampledVolume {
  const LeafPlaces& leaves;
  bool masked;       ///< inactive samples are no data
  float data_below;  ///< samples of at least this magnitude are no data
};

/// Determines which samples are data. Near the surface at 0 of a level set all others have the background's
/// magnitude, which is sufficient. If the band is narrower inside, they have less there; at other isovalues
/// the band may be wider on that side than the background, and a background of 0 is useless. Then, and in any
/// other volume, the active samples are data. Returns nothing if the tiles are not enough to decide this.
std::optional<SampledVolume> sampled_volume(const LeafPlaces& leaves, const LevelSet& level_set);
/// Determines which samples are data, if necessary by the samples of the leaves.
SampledVolume sampled_volume(const LeafTable& table, const LevelSet& level_set);

/// Computes the crossing of one edge by plain code; next to samples that are no data, differences are
/// one-sided or 0.
class IncompleteStencil {
 public:
  IncompleteStencil(const SampledVolume& volume, std::size_t leaf)
      : volume_(volume), leaves_(volume.leaves), leaf_(leaf) {}

  EdgeCrossing sample(int x, int y, int z, int axis) const {
    const std::array<int, 3> from{x, y, z};
    std::array<int, 3> to = from;
    ++to[axis];
    const InsideRule& rule = leaves_.rule();
    const double a = rule.signed_value(at(from).value), b = rule.signed_value(at(to).value);
    const double offset = a / (a - b);
    Eigen::Vector3d normal = (1.0 - offset) * gradient(from) + offset * gradient(to);
    const double rise = b - a;
    if (!(normal[axis] * rise > 0)) normal[axis] = rise;
    normal.normalize();
    return {static_cast<float>(offset),
            {static_cast<float>(normal[0]), static_cast<float>(normal[1]), static_cast<float>(normal[2])}};
  }

 private:
  struct Sample {
    float value;
    bool is_data;
  };
  Sample at(const std::array<int, 3>& p) const {
    const std::int32_t there = leaves_.neighbour(leaf_, p[0] >> 3, p[1] >> 3, p[2] >> 3);
    const int sample = sample_index(p[0] & 7, p[1] & 7, p[2] & 7);
    if (there < 0) {
      return {leaves_.value_at(leaf_, p[0], p[1], p[2]), leaves_.is_active_at(leaf_, p[0], p[1], p[2])};
    }
    const float value = leaves_.values(there)[sample];
    const bool active = !volume_.masked || test(leaves_.active(static_cast<std::size_t>(there)), sample);
    return {value, active && std::fabs(value) < volume_.data_below};
  }

  /// Returns the gradient of the signed value, which points outwards; 0 along an axis without data.
  Eigen::Vector3d gradient(const std::array<int, 3>& p) const {
    Eigen::Vector3d result = Eigen::Vector3d::Zero();
    const Sample here = at(p);
    for (int axis = 0; axis < 3; ++axis) {
      std::array<int, 3> low = p, high = p;
      --low[axis], ++high[axis];
      const Sample below = at(low), above = at(high);
      double difference = 0.0;
      if (below.is_data && above.is_data)
        difference = 0.5 * (double(above.value) - below.value);
      else if (above.is_data && here.is_data)
        difference = double(above.value) - here.value;
      else if (below.is_data && here.is_data)
        difference = double(here.value) - below.value;
      result[axis] = leaves_.rule().scale * difference;
    }
    return result;
  }

  const SampledVolume& volume_;
  const LeafPlaces& leaves_;
  const std::size_t leaf_;
};

/// Stencils of one leaf's edges, read from the samples of the leaf and its neighbours. They must outlive the
/// input that they fill.
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
  std::array<std::int32_t, 27> around_;  ///< numbers of the leaves around (LeafPlaces::surroundings())
  std::array<BlockMask, 27> active_;
};

}  // namespace hermesh
