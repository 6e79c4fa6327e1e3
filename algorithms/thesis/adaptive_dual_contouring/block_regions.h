// The regions of one block: which of its cells are merged, and where the points go (Aldén 2011, §6.4).
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/thesis/adaptive_dual_contouring/adaptive_dual_contouring.h"
#include "algorithms/thesis/adaptive_dual_contouring/edge_source.h"
#include "algorithms/thesis/adaptive_dual_contouring/qef_sum.h"
#include "algorithms/thesis/adaptive_dual_contouring/region_topology.h"

namespace hermesh {

/// Hermite data as blocks, with what decides about regions.
struct RegionInput {
  const EdgeSource& edges;
  const AdaptiveOptions& options;
  const FieldEvaluator& field;
};

/// Entry of the mask grid for a cell that gets no point although the surface passes through it.
inline constexpr std::uint16_t kNoPoint = 0xffff;
/// The parts of any other entry: the number of the cell's point within the block, and the level of its
/// region, 0 for a lone cell and 1 to 3 for regions of 2³, 4³ and 8³ cells.
constexpr std::uint32_t point_of(std::uint16_t entry) { return entry & 511u; }
constexpr int level_of(std::uint16_t entry) { return entry >> 9; }

/// What merging one block came to.
struct BlockResult {
  std::uint32_t points = 0;
  std::array<std::uint32_t, 3> regions{};  ///< of 2³, 4³, 8³ cells
  std::array<std::uint32_t, kEscapeRanges.size() + 1>
      escaped{};                        ///< by range; the last is beyond all of them
  float largest_escape = 0.0f;          ///< voxels
  float largest_plane_distance = 0.0f;  ///< voxels
};

/// Merges the cells of one block. Writes for each active one of the 512 cells its point and level to `mask`,
/// whose other entries stay as they are, and that many points, voxels from the block's first sample, to
/// `points`, which has room for 512. Cells are active that lie around a tagged edge, less those that the
/// field leaves out. Blocks do not depend on each other, so that any thread may merge any.
BlockResult merge_block(const RegionInput& input, std::int32_t block, std::uint16_t* mask,
                        Eigen::Vector3f* points);

}  // namespace hermesh
