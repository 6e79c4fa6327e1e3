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

/// Reads one scalar grid. An empty name means the grid `sdf`, or else the only scalar grid; half precision,
/// double, integer and bool grids are converted to float, and a mask is 1 in active voxels and 0 elsewhere.
/// The file's structure is checked before OpenVDB reads it (vdb_structure.h).
/// @throws Error for a file that is missing, truncated, damaged or no .vdb, for a grid that is missing (the
/// message lists the others), not scalar or larger than memory, for a transform that cannot be inverted, and
/// for a value that is not finite.
LevelSet read_level_set(const std::filesystem::path& path, const std::string& grid_name, RunContext& context);

/// Writes the grid atomically under the name `sdf`. @throws Error if the path cannot be written.
void write_level_set(const std::filesystem::path& path, const LevelSet& level_set, RunContext& context);

/// Description of a grid in a file.
struct GridSummary {
  std::string name, value_type, grid_class;
  bool is_read = true;  ///< false for types whose trees are skipped (points), so voxels are unknown
  std::uint64_t active_voxels = 0, memory_bytes = 0;
  std::array<int, 3> lower{}, upper{};  ///< active box, index space, inclusive
  std::array<double, 3> voxel_size{};   ///< along each index axis, world units
  std::optional<double> background;     ///< only for grids of numbers
};

/// Returns summaries of all grids of a .vdb file, by name. @throws Error like read_level_set(), and for a
/// file with a grid of an unknown type, which OpenVDB cannot skip.
std::vector<GridSummary> describe_vdb(const std::filesystem::path& path);

}  // namespace hermesh
