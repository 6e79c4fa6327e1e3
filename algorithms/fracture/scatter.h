// Places inside a solid, at random: where cells have their seeds and cutters are put (Aldén 2011, §7.1:
// "completely automated by scattering a set of points within the original object").
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
  /// The relative density of places, from 0 to 1, at a world position. If there is none, places are equally
  /// dense everywhere.
  std::function<double(const Eigen::Vector3d&)> density;
};

/// Scatters `count` places (world units) in a solid as blue noise: of several candidates each time the one
/// farthest from all places so far is taken, distances being scaled by the cube root of the density there
/// (Mitchell, *Spectrally Optimal Sampling for Distribution Ray Tracing*, 1991). Candidates are inside
/// samples, each moved within its voxel. No two places are equal. They are found one after the other, from
/// `seed` alone, so they are the same at any thread count.
/// @throws Error if the solid has no sample, or the density leaves no room for so many places; Cancelled.
std::vector<Eigen::Vector3d> scatter(const LabelledSolid& solid, std::size_t count,
                                     const ScatterOptions& options, RunContext& context);

/// A density about an impact: 1 there, and falling with the distance d as 1 / (1 + (d / radius)³), so that
/// the places per spherical shell fall off beyond the radius. Both arguments are in world units.
std::function<double(const Eigen::Vector3d&)> density_about(const Eigen::Vector3d& impact, double radius);

}  // namespace hermesh
