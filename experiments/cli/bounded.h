// hermesh remesh --error and --triangles: a mesh within a stated distance of the polygons, or within a
// budget.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "experiments/cli/session.h"
#include "experiments/cli/voxelizing.h"

namespace hermesh::cli {

struct BoundArguments {
  std::string error;                      ///< as given: a number, with % or a unit behind it
  std::optional<std::int64_t> triangles;  ///< budget
  bool over_holes = false;
  std::optional<double> most_points;
  double smallest_voxel = 0.0;  ///< world units; 0: nobody said

  bool asked() const { return !error.empty() || triangles; }
};

/// Adds --error and --triangles to the group of sizes, and what goes with them to the command.
void add_bound_options(CLI::App& command, CLI::App& size, BoundArguments& arguments);
/// Refuses what a bound leaves without effect, and an error that cannot be read. `units` are those of the
/// file's numbers.
/// @throws UsageError
void check_bound_options(const CLI::App& command, const BoundArguments& arguments,
                         const VoxelizeArguments& voxelizing, const std::string& units);
/// Refuses the options that need a bound. @throws UsageError
void refuse_without_bound(const CLI::App& command);

/// The error in world units, which are metres where somebody said what the file's numbers are.
/// @param text a number, with % or a unit behind it
/// @param units of the file's numbers; empty: nobody said
/// @param diagonal of the polygons' box, world units
/// @throws UsageError
double error_in_world_units(const std::string& text, const std::string& units, double diagonal);

int run_bounded(const Paths& paths, const BoundArguments& arguments, const VoxelizeArguments& voxelizing,
                Session& session);

}  // namespace hermesh::cli
