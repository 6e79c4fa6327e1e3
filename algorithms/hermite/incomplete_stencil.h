// Crossings of edges whose stencils reach beyond the data or single precision, one at a time: what vector
// code leaves over.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "algorithms/hermite/crossing.h"
#include "algorithms/lattice/leaf_table.h"

namespace hermesh {

/// A volume's samples, and which of them are data.
struct SampledVolume {
  const LeafPlaces& leaves;
  bool masked;       ///< samples that are not active are no data
  float data_below;  ///< samples of no less than this magnitude are no data
};

/// Which samples are data. Near the surface at 0 of a level set all that is no data has the background's
/// magnitude, and nothing else is asked. Where the band is narrower inside it has less there; at other
/// isovalues the band may be wider on that side than the background tells, and a background of 0 tells
/// nothing. There, and in any other volume, the active samples are data. Nothing is returned if tiles do not
/// tell and the samples must be looked at.
std::optional<SampledVolume> sampled_volume(const LeafPlaces& leaves, const LevelSet& level_set);
/// Which samples are data; where tiles do not tell, the samples of the leaves are looked at.
SampledVolume sampled_volume(const LeafTable& table, const LevelSet& level_set);

/// The crossing of one edge: where a sample is no data, differences are taken to one side, or none.
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

  /// Gradient of the signed value, which points outwards; 0 along an axis without data.
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

}  // namespace hermesh
