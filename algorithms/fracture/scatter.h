// Random positions inside a solid, for the seeds of cells and for cutters (Aldén 2011, §7.1: "completely
// automated by scattering a set of points within the original object").
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "algorithms/core/run_context.h"
#include "algorithms/fracture/labelled_solid.h"

namespace hermesh {

struct ScatterOptions {
  std::uint64_t seed = 0;
  /// The relative density of positions, from 0 to 1, at a world position. If it is empty, the density is
  /// uniform.
  std::function<double(const Eigen::Vector3d&)> density;
};

/// Scatters `count` positions (world units) in a solid as blue noise: of several candidates, each step takes
/// the one farthest from all positions so far, where distances are scaled by the cube root of the local
/// density (Mitchell, *Spectrally Optimal Sampling for Distribution Ray Tracing*, 1991). Candidates are
/// inside samples, each moved within its voxel. No two positions are equal. They are found one after another
/// and depend only on `seed`, so they are the same at any thread count.
/// @throws Error if the solid has no sample, or the density leaves no room for the requested number of
/// positions; Cancelled.
std::vector<Eigen::Vector3d> scatter(const LabelledSolid& solid, std::size_t count,
                                     const ScatterOptions& options, RunContext& context);

/// Returns a density about an impact: 1 there, and falling with the distance d as 1 / (1 + (d / radius)³), so
/// that the number of positions per spherical shell decreases beyond the radius. Both arguments are in world
/// units.
std::function<double(const Eigen::Vector3d&)> density_about(const Eigen::Vector3d& impact, double radius);

}  // namespace hermesh
