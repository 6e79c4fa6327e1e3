// Hermite data of a whole volume: all edge crossings with their normals. Light; the OpenVDB tree is in the
// .cpp.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "algorithms/core/blocks.h"
#include "algorithms/hermite/hermite_voxel.h"

namespace hermesh {

/// 8³ voxels of the grid's tree, with its neighbours looked up.
struct HermiteBlock {
  std::array<std::int32_t, 3> lower{};  ///< index coordinates of the first voxel
  HermiteVoxel* voxels = nullptr;       ///< 512, in the order of BlockMask
  std::array<BlockMask, 3> crossing{};  ///< by axis: voxels whose up-wind edge is crossed
  /// By neighbour_slot(); an index into HermiteGrid::blocks(), or −1 where no edge is crossed.
  std::array<std::int32_t, 27> neighbours{};
};

struct HermiteTree;  // owns the OpenVDB tree

/// An OpenVDB grid of HermiteVoxel. There is a block for every cell with a crossing edge and for every owner
/// of one.
class HermiteGrid {
 public:
  /// Allocates a block for each of `grid`'s that holds an active cell or a crossing edge and sets signs and
  /// crossing flags; offsets and normals are for a sampler to fill in. Blocks keep the order of `grid`;
  /// `source` says which of its blocks each was made from.
  HermiteGrid(const BlockGrid& grid, std::vector<std::int32_t>& source, RunContext& context);

  const std::vector<HermiteBlock>& blocks() const { return blocks_; }
  const IndexToWorld& placement() const { return placement_; }
  std::size_t crossing_edges() const;
  std::size_t memory_bytes() const;  ///< of the tree

  /// Writes the tree as the grid `hermite`. A file that holds it is refused by programs that do not know the
  /// type.
  void write(const std::filesystem::path& path, RunContext& context) const;

 private:
  std::shared_ptr<HermiteTree> tree_;
  std::vector<HermiteBlock> blocks_;
  IndexToWorld placement_;
};

/// Makes the grid type known to OpenVDB's input and output; initialize_openvdb() calls it.
void register_hermite_grid();

}  // namespace hermesh
