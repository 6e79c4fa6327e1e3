// Label maps: samples of a lattice with an integer label each, such as the segmentation of a scan.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "algorithms/core/level_set.h"
#include "algorithms/core/run_context.h"
#include "algorithms/fracture/labelled_solid.h"
#include "algorithms/lattice/placement.h"

namespace hermesh {

/// The greatest label, since files store labels as 32-bit integers with a sign.
inline constexpr std::uint32_t kGreatestLabel = 0x7fffffff;

/// A label map in blocks of 8³ samples. A label is a positive integer; 0 is the background, to which all
/// samples without a block belong.
struct LabelMap {
  IndexToWorld placement;
  std::vector<std::array<std::int32_t, 3>> lowers;  ///< index coordinates of each block's first sample;
                                                    ///< multiples of 8, ascending, each once
  LabelField values;                                ///< labels by block of `lowers`

  /// Returns the numbers of samples of all labels except 0.
  std::map<std::uint32_t, std::uint64_t> samples() const;
};

/// Returns a map of a box of samples, x fastest, whose first sample has index coordinates 0.
/// @throws Error if the number of values is not that of the samples, or for a label above kGreatestLabel
LabelMap label_map(std::span<const std::uint32_t> values, const std::array<int, 3>& dims,
                   const IndexToWorld& placement, RunContext& context);

/// Returns true if the grid is a label map, as `hermesh import --labels` writes it.
bool is_label_map(const LevelSet& volume);

/// Reads the labels of a grid of a .vdb file: of int32, int64, float, double or bool values that are whole
/// numbers from 0 to kGreatestLabel. Inactive voxels are background. An empty name means the grid `labels`,
/// or else the only grid of these types.
/// @throws Error like read_level_set(), for a value that is no label, and for a file without a label
LabelMap read_label_map(const std::filesystem::path& path, const std::string& grid_name, RunContext& context);

}  // namespace hermesh
