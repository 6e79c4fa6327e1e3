// .vdb files.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/level_set.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// Reads one scalar grid. An empty name takes the grid `sdf`, or the only scalar grid there is; half
/// precision, double, integer and bool grids are converted to float, and a mask is 1 where it is active and 0
/// elsewhere. The file's structure is checked before OpenVDB reads it (vdb_structure.h).
/// @throws Error for a file that is missing, truncated, damaged or no .vdb, for a grid that is not there (the
/// sentence lists those that are), not scalar or larger than memory, for a transform that cannot be inverted,
/// and for a value that is not finite.
LevelSet read_level_set(const std::filesystem::path& path, const std::string& grid_name, RunContext& context);

/// Writes the grid under the name `sdf`, aside and then renamed. @throws Error if the path cannot be written.
void write_level_set(const std::filesystem::path& path, const LevelSet& level_set, RunContext& context);

/// What a file says of one grid.
struct GridSummary {
  std::string name, value_type, grid_class;
  bool is_read =
      true;  ///< false: of a type that is stepped over (points), so that nothing is known of its voxels
  std::uint64_t active_voxels = 0, memory_bytes = 0;
  std::array<int, 3> lower{}, upper{};  ///< active box, index space, inclusive
  std::array<double, 3> voxel_size{};   ///< along each index axis, world units
  std::optional<double> background;     ///< only for grids of numbers
};

/// Summaries of all grids of a .vdb file, by name. @throws Error as read_level_set() does, and for a file
/// with a grid of an unknown type, which OpenVDB cannot step over.
std::vector<GridSummary> describe_vdb(const std::filesystem::path& path);

}  // namespace hermesh
