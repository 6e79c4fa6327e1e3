// Which triangles can be near which block of voxels. Small triangles are filed once each, under the block of
// their box's centre, in clusters of sixteen with a box of their own; large ones under every block that they
// come near.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/block_table.h"
#include "algorithms/core/run_context.h"
#include "algorithms/voxelization/index_soup.h"

namespace hermesh {

/// Box in voxels relative to the mesh's origin; never smaller than what it holds.
struct VoxelBox {
  std::array<double, 3> low, high;
};

inline constexpr std::size_t kClusterSize = 16;

class TriangleBins {
 public:
  /// `reach`: how far from a triangle, in voxels, its distance matters. @throws Cancelled.
  TriangleBins(const IndexSoup& soup, double reach, RunContext& context);

  /// Blocks with a voxel that may be nearer than the reach to a triangle; some have none.
  const BlockTable& blocks() const { return blocks_; }

  struct Cluster {
    std::span<const std::uint32_t> triangles;  ///< numbers, at most kClusterSize
    VoxelBox box;
  };
  /// Calls f(cluster) for the clusters of small triangles filed near enough to `block`, most of which are
  /// within reach.
  template <class F>
  void for_each_cluster(const BlockAt& block, F&& f) const;
  /// Large triangles within reach of block number `i`, in ascending order.
  std::span<const std::uint32_t> large(std::uint32_t i) const {
    return {large_.data() + first_large_[i], first_large_[i + 1] - first_large_[i]};
  }

 private:
  struct FloatBox {
    Eigen::Vector3f low, high;  ///< world units relative to the mesh's origin, exact
  };
  void file_small(RunContext& context);
  void make_clusters(RunContext& context);
  void choose_blocks(RunContext& context);
  static bool is_large(const VoxelBox& box);
  VoxelBox in_voxels(const FloatBox& box) const;
  FloatBox box_of(std::size_t triangle) const;

  const IndexSoup& soup_;
  double reach_;
  int rings_;  ///< how many blocks away a small triangle that matters can be filed
  BlockTable bins_;
  std::vector<std::uint32_t> first_, order_;  ///< bin b: order_[first_[b]] …
  std::vector<std::uint32_t> first_cluster_;
  std::vector<FloatBox> clusters_;
  BlockTable blocks_;
  std::vector<std::vector<std::uint32_t>> all_large_;  ///< large triangles, by piece of the work
  std::vector<std::uint64_t> first_large_;
  std::vector<std::uint32_t> large_;
};

template <class F>
void TriangleBins::for_each_cluster(const BlockAt& block, F&& f) const {
  BlockFinder finder(bins_);
  for (int x = -rings_; x <= rings_; ++x)
    for (int y = -rings_; y <= rings_; ++y)
      for (int z = -rings_; z <= rings_; ++z) {
        const std::uint32_t bin = finder.find({block[0] + x, block[1] + y, block[2] + z});
        if (bin == BlockTable::kNone) continue;
        std::uint32_t start = first_[bin];
        for (std::uint32_t c = first_cluster_[bin]; c < first_cluster_[bin + 1]; ++c) {
          const std::uint32_t end = std::min<std::uint32_t>(start + kClusterSize, first_[bin + 1]);
          f(Cluster{{order_.data() + start, end - start}, in_voxels(clusters_[c])});
          start = end;
        }
      }
}

}  // namespace hermesh
