// Ray marching of fog, a volume of densities, with parallel rays, absorption and light from one side.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "algorithms/core/level_set.h"
#include "algorithms/core/run_context.h"
#include "experiments/pictures/ray_scene.h"

namespace hermesh {

struct FogLook {
  /// In fog of density 1 the share exp(−extinction · length) of light passes; per world unit.
  double extinction = 1.0;
  Eigen::Vector3d towards_light{0.4, 0.8, 0.45};  ///< any length
  double ambient = 0.35;                          ///< brightness of fog that no direct light reaches, 0 to 1
};

/// A dense copy of a fog volume's active box; densities are interpolated trilinearly and are 0 beyond the
/// box.
class FogScene {
 public:
  /// @param fog densities of 0 and more, uniform voxels. @throws Error for a grid without active samples.
  FogScene(const LevelSet& fog, const RunContext& context);

  /// Returns the share of light that passes along the line through `point` in a direction of any length, by
  /// steps of half a voxel and the midpoint rule; 1 without fog. World units.
  double transmittance(const Eigen::Vector3d& point, const Eigen::Vector3d& direction,
                       double extinction) const;

  /// Renders the light that each sample of a ray scatters towards the viewer (shadows are marched once, for
  /// every second voxel), on a sky. Deterministic at any number of threads. @throws Cancelled.
  Image render(const Camera& camera, const View& view, const FogLook& look, RunContext& context) const;

 private:
  /// At index coordinates relative to the box's first sample.
  double density(const Eigen::Vector3d& index) const;
  Eigen::Vector3d to_index(const Eigen::Vector3d& world) const { return (world - lower_) / voxel_; }
  /// Returns the range of t in index units in which index + t · direction is in the box; empty if first >
  /// second.
  std::pair<double, double> stretch(const Eigen::Vector3d& index, const Eigen::Vector3d& direction) const;
  std::vector<float> shadows(const FogLook& look, RunContext& context) const;

  Eigen::Vector3d lower_ = Eigen::Vector3d::Zero();  ///< world position of the box's first sample
  double voxel_ = 1.0;
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();  ///< samples along each axis
  std::vector<float> values_;                       ///< x slowest, z fastest
};

}  // namespace hermesh
