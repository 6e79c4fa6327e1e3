// Hermite data of any representation as extraction walks over it: blocks with their neighbours, and a crossing for
// each crossing edge.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/run_context.h"
#include "algorithms/hermite/sparse_hermite.h"

namespace hermesh {

/// There is a block for every cell with a crossing edge and for every owner of one. The view refers to the data that it
/// was made of, which must outlive it.
class HermiteView {
 public:
  struct Block {
    std::array<std::int32_t, 3> lower{};  ///< index coordinates of the first sample
    std::int32_t leaf = -1;               ///< number among the leaves that own crossings; −1 for none
    BlockMask inside{};
    std::array<BlockMask, 3> crossing{};  ///< by axis: samples whose up-wind edge is crossed
    /// By neighbour_slot(); a block's number, or −1 where there is none.
    std::array<std::int32_t, 27> neighbours{};
  };

  virtual ~HermiteView() = default;
  const std::vector<Block>& blocks() const { return blocks_; }
  const IndexToWorld& placement() const { return placement_; }

  /// Of an edge that is crossed.
  virtual EdgeCrossing crossing(std::int32_t block, int sample, int axis) const = 0;

 protected:
  /// `leaves` in ascending order; all of them own a crossing edge.
  HermiteView(std::span<const SignLeaf> leaves, const IndexToWorld& placement, RunContext& context);

 private:
  IndexToWorld placement_;
  std::vector<Block> blocks_;
};

/// `Read` turns a crossing of the data into an EdgeCrossing.
template <class Crossing, class Read>
class SparseView : public HermiteView {
 public:
  SparseView(const SparseHermite<Crossing>& hermite, Read read, RunContext& context)
      : HermiteView(hermite.leaves, hermite.placement, context), hermite_(hermite), read_(read) {}

  EdgeCrossing crossing(std::int32_t number, int sample, int axis) const override {
    const Block& block = blocks()[number];
    std::uint32_t rank = hermite_.leaves[block.leaf].first;
    for (int a = 0; a < axis; ++a) rank += static_cast<std::uint32_t>(count(block.crossing[a]));
    rank += rank_in(block.crossing[axis], sample);
    return read_(hermite_.crossings[rank]);
  }

 private:
  const SparseHermite<Crossing>& hermite_;
  const Read read_;
};

inline auto view_of(const FloatHermite& hermite, RunContext& context) {
  constexpr auto read = [](const EdgeCrossing& crossing) { return crossing; };
  return SparseView<EdgeCrossing, decltype(read)>(hermite, read, context);
}
template <NormalCode Code>
auto view_of(const PackedHermite& hermite, Code, RunContext& context) {
  constexpr auto read = [](PackedCrossing crossing) { return unpack<Code>(crossing); };
  return SparseView<PackedCrossing, decltype(read)>(hermite, read, context);
}

}  // namespace hermesh
