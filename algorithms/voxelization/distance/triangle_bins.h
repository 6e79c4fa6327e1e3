// The triangles that can be near each block of voxels. Small triangles are filed once each, under the block
// of their box's centre, in clusters of sixteen with a box of their own; large ones under every block that
// they come near. The clusters exist for a slab of space at a time, for all of them together can take more
// memory than the volume; of the rest only the packed numbers of the triangles are stored.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "algorithms/core/bounds.h"
#include "algorithms/core/run_context.h"
#include "algorithms/lattice/block_table.h"
#include "algorithms/voxelization/distance/index_soup.h"

namespace hermesh {

/// Returns the box from a block's first voxel to its last and `margin` voxels more on every side; in voxels
/// relative to the mesh's origin, as all boxes here unless stated otherwise.
inline Bounds around(const BlockAt& block, double margin) {
  Bounds box;
  for (int a = 0; a < 3; ++a) {
    box.lower[a] = block[std::size_t(a)] * 8.0 - margin;
    box.upper[a] = block[std::size_t(a)] * 8.0 + 7.0 + margin;
  }
  return box;
}

/// Returns the box from a block's first voxel to the next block's, which has the block's cells, and `margin`
/// voxels more on every side.
inline Bounds cells_around(const BlockAt& block, double margin) {
  Bounds box = around(block, margin);
  box.upper.array() += 1.0;
  return box;
}

/// The most triangles of a cluster: the lanes of a kernel's batch.
inline constexpr std::size_t kClusterSize = 16;

/// The box of the small triangles of a bin, in sixteenths of a voxel from three voxels before the bin's
/// first, rounded outwards. A small triangle reaches at most two voxels beyond its bin, so eight bits are
/// enough.
using BinBounds = BoundsOf<std::uint8_t>;

/// The triangles of a soup by the blocks of voxels that they can be near.
class TriangleBins {
 public:
  /// Sorts the triangles. `reach` is how far from a triangle, in voxels, its distance matters. The soup and
  /// the context must outlive the bins.
  /// @throws Cancelled.
  TriangleBins(const IndexSoup& soup, double reach, RunContext& context);
  /// @param within blocks() contains only the blocks of this box, whose faces belong to it
  TriangleBins(const IndexSoup& soup, double reach, RunContext& context,
               const BoundsOf<std::int32_t>& within);

  /// Returns the blocks that may have a voxel within reach of a triangle.
  const BlockTable& blocks() const { return blocks_; }

  /// Up to sixteen small triangles that are close together.
  struct Cluster {
    std::span<const std::uint32_t> triangles;  ///< numbers, at most kClusterSize
    Bounds box;
  };
  /// Calls f(cluster) for the clusters of small triangles filed near enough to `block`, most of which are
  /// within reach, in an order that depends only on the mesh. Any thread may call it, but not f itself: if
  /// the slabs around the block are not in memory, the clusters are made for this thread and its next calls.
  template <class F>
  void for_each_cluster(const BlockAt& block, F&& f) const {
    for_each_cluster(block, around(block, reach_), f);
  }
  /// Calls f(cluster) for the clusters that may overlap the box `near`, which is within reach of the block's
  /// voxels. A smaller box needs fewer clusters.
  template <class F>
  void for_each_cluster(const BlockAt& block, const Bounds& near, F&& f) const;
  /// Returns the large triangles within reach of block number `i`, in ascending order.
  std::span<const std::uint32_t> large(std::uint32_t i) const {
    return {large_.data() + first_large_[i], first_large_[i + 1] - first_large_[i]};
  }

  /// Returns the number of slabs that space is cut into across one axis; the triangles that matter to a block
  /// are in its own slab and the two next to it.
  std::size_t slab_count() const { return slabs_.size(); }
  /// Returns the number of the slab that contains a block.
  std::size_t slab_of(const BlockAt& block) const;
  /// Makes the clusters of a slab and its neighbours, and frees those of the others. For work slab by slab;
  /// not while another thread queries clusters. @throws Cancelled.
  void go_to_slab(std::size_t slab);
  /// Frees all clusters, unless there is only one slab.
  void forget_slabs();
  /// Returns the current size of the small triangles in bytes.
  std::size_t bytes_in_memory() const;

 private:
  /// Triangles of some bins, and their clusters, which do not reach across bins.
  struct Files {
    std::vector<std::uint32_t> first, order;  ///< bin b: order[first[b]] …
    std::vector<std::uint32_t> first_cluster;
    std::vector<BoundsOf<float>> clusters;  ///< world units relative to the mesh's origin, exact
  };
  struct Slab {
    std::int32_t end = 0;             ///< first layer of blocks beyond it
    std::vector<std::uint32_t> bins;  ///< numbers, ascending
    std::unique_ptr<Files> files;     ///< may be absent
  };
  struct Survey;

  Survey survey();
  void pack(Survey& survey);
  void choose_slabs();
  void choose_blocks(const Survey& survey, const BoundsOf<std::int32_t>& within);
  using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;  ///< a block and a large triangle
  Pairs file_large(const std::vector<std::uint32_t>& triangles, const BoundsOf<std::int32_t>& within,
                   BlockSet& blocks) const;
  enum class Purpose { all_blocks, few_questions };
  Files make_files(const std::vector<std::uint32_t>& bins, Purpose purpose) const;
  void unpack(std::uint32_t bin, std::uint32_t* to) const;
  struct Sorter;
  void sort(std::uint32_t bin, std::span<std::uint32_t> triangles, Sorter& sorter) const;
  void enclose(std::span<const std::uint32_t> triangles, BoundsOf<float>* clusters) const;
  const Files& own_files(std::uint32_t bin) const;
  template <class F>
  void for_each_in(const Files& files, std::uint32_t i, const Bounds& near, F&& f) const;
  Bounds bin_box(std::uint32_t bin) const;
  static bool is_large(const Bounds& box);
  Bounds in_voxels(const BoundsOf<float>& box) const;
  BoundsOf<float> box_of(std::size_t triangle) const;

  const IndexSoup& soup_;
  RunContext& context_;
  double reach_;
  int rings_;  ///< how many blocks away a small triangle that matters can be filed
  BlockTable bins_;
  std::vector<BlockAt> bin_at_;
  std::vector<BinBounds> box_of_bin_;
  /// Numbers of the triangles of each bin, ascending, as differences: seven bits per byte, the lowest first,
  /// the eighth bit set if more follow.
  std::vector<std::uint8_t> packed_;
  std::vector<std::uint64_t> first_byte_;
  std::vector<std::uint32_t> count_;
  std::size_t axis_ = 0;
  std::vector<Slab> slabs_;
  std::vector<std::uint32_t> place_;  ///< index of each bin among those of its slab
  BlockTable blocks_;
  std::vector<std::vector<std::uint32_t>> all_large_;  ///< large triangles, by piece of the work
  std::vector<std::uint64_t> first_large_;
  std::vector<std::uint32_t> large_;
  /// Files of single bins, by thread, for queries in any order.
  mutable tbb::enumerable_thread_specific<std::unordered_map<std::uint32_t, Files>> cache_;
};

template <class F>
void TriangleBins::for_each_in(const Files& files, std::uint32_t i, const Bounds& near, F&& f) const {
  std::uint32_t start = files.first[i];
  for (std::uint32_t c = files.first_cluster[i]; c < files.first_cluster[i + 1]; ++c) {
    const std::uint32_t end = std::min<std::uint32_t>(start + kClusterSize, files.first[i + 1]);
    const Bounds box = in_voxels(files.clusters[c]);
    if (box.overlaps(near)) f(Cluster{{files.order.data() + start, end - start}, box});
    start = end;
  }
}

template <class F>
void TriangleBins::for_each_cluster(const BlockAt& block, const Bounds& near, F&& f) const {
  BlockFinder finder(bins_);
  for (int x = -rings_; x <= rings_; ++x)
    for (int y = -rings_; y <= rings_; ++y)
      for (int z = -rings_; z <= rings_; ++z) {
        const BlockAt at{block[0] + x, block[1] + y, block[2] + z};
        const std::uint32_t bin = finder.find(at);
        if (bin == BlockTable::kNone || !bin_box(bin).overlaps(near)) continue;
        if (const Files* files = slabs_[slab_of(at)].files.get())
          for_each_in(*files, place_[bin], near, f);
        else
          for_each_in(own_files(bin), 0, near, f);
      }
}

inline Bounds TriangleBins::in_voxels(const BoundsOf<float>& box) const {
  Bounds result;
  for (int a = 0; a < 3; ++a) {
    result.lower[a] = double(box.lower[a]) * soup_.scale();
    result.upper[a] = double(box.upper[a]) * soup_.scale();
  }
  return result;
}

inline BoundsOf<float> TriangleBins::box_of(std::size_t triangle) const {
  const Triangle t = soup_.triangle(triangle);
  const Eigen::Vector3f &a = soup_.point(t[0]), &b = soup_.point(t[1]), &c = soup_.point(t[2]);
  return {a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)};
}

}  // namespace hermesh
