// hermesh remesh within a bound of the distance: the options --error and --triangles.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "algorithms/remesh/bounded_remesh.h"
#include "experiments/cli/conversions.h"

namespace hermesh::cli {

struct BoundArguments {
  std::string error;                      ///< a number, with % or a unit behind it; empty: not given
  std::optional<std::int64_t> triangles;  ///< budget
  bool over_holes = false, except_thin = false;
  std::optional<double> most_points;
  bool through_volume = false;
  double smallest_voxel = 0.0;  ///< world units; 0: not given
  std::string certificate;      ///< file; empty: none
};

/// Adds the options to the command. @param size the group of those that determine the size
void add_bound_options(CLI::App& command, CLI::App& size, BoundArguments& bound);

/// Checks what can be checked before the input is read. @throws UsageError
void check_bound_usage(const BoundArguments& bound, const VoxelizeArguments& voxelizing, const Paths& paths);

/// Remeshes polygons, reports the result, and writes the certificate if one is requested.
/// @param mesh the polygons of paths.in
/// @throws Error if the bound is not reached, with the places and remedies; UsageError
BoundedMesh remesh_within_bound(const BoundArguments& bound, const VoxelizeArguments& voxelizing,
                                const Paths& paths, const PolygonMesh& mesh, Session& session);

}  // namespace hermesh::cli
