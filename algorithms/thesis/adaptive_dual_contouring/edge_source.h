// Hermite data as chapter 6 reads them: signs at samples, and edges that are "tagged with data".
//
// In FloatHermite the tagged edges are those whose ends differ in sign. In the thesis's 10 bytes
// (ThesisDense) they are given by their voxel, which §4.2 reads off the normal's code: it misses some whose
// ends differ in sign (trap T2), and after eq. 7.1 it has some whose ends do not (trap T11).
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/hermite/hermite_view.h"
#include "algorithms/thesis/adaptive_dual_contouring/region_topology.h"
#include "algorithms/thesis/voxels/dense_hermite.h"

namespace hermesh {

/// Blocks of 8³ samples with their signs and tagged edges, for any thread.
class EdgeSource {
 public:
  virtual ~EdgeSource() = default;
  EdgeSource(const EdgeSource&) = delete;
  EdgeSource& operator=(const EdgeSource&) = delete;

  /// Returns the blocks in ascending order with their neighbours: one for each cell around a tagged edge, and
  /// for its owner. All of a block is set; `crossing` are the tagged edges that it owns, and a block without
  /// a leaf owns none.
  virtual const HermiteView::Blocks& blocks() const = 0;
  /// Returns the signs of a block and of its upper neighbours, existing or not: parts 4x + 2y + z.
  virtual std::array<SignLattice::Part, 8> signs(std::int32_t block) const = 0;
  /// Writes the data of the block's edges along an axis that are in `wanted`, which must be tagged, in the
  /// order of their samples.
  virtual void read(std::int32_t block, int axis, const BlockMask& wanted, EdgeCrossing* out) const = 0;

 protected:
  EdgeSource() = default;
};

/// The edges of sparse data, which must outlive this object.
class SparseEdges : public EdgeSource {
 public:
  /// @throws Cancelled.
  SparseEdges(const FloatHermite& hermite, RunContext& context)
      : hermite_(hermite), view_(view_of(hermite, context)) {}

  const HermiteView::Blocks& blocks() const override { return view_.blocks(); }
  std::array<SignLattice::Part, 8> signs(std::int32_t block) const override;
  void read(std::int32_t block, int axis, const BlockMask& wanted, EdgeCrossing* out) const override;

 private:
  const FloatHermite& hermite_;
  const decltype(view_of(std::declval<const FloatHermite&>(), std::declval<RunContext&>())) view_;
};

/// The edges of the thesis's voxels, which are unpacked edge by edge when they are read.
class PackedEdges : public EdgeSource {
 public:
  /// @throws Cancelled.
  PackedEdges(ThesisDense hermite, RunContext& context);

  const HermiteView::Blocks& blocks() const override { return blocks_; }
  std::array<SignLattice::Part, 8> signs(std::int32_t block) const override;
  void read(std::int32_t block, int axis, const BlockMask& wanted, EdgeCrossing* out) const override;

  std::size_t tagged() const { return tagged_; }  ///< number of edges tagged with data
  /// Returns the number of edges whose ends differ in sign and that are not tagged: they get no polygon.
  std::size_t lost() const { return lost_; }
  /// Returns the number of edges that are tagged although their ends have one sign.
  std::size_t needless() const { return needless_; }

 private:
  bool sign_without_block(const std::array<std::int32_t, 3>& lower) const;
  void count_edges(RunContext& context);

  const ThesisDense hermite_;
  HermiteView::Blocks blocks_;
  std::vector<const ThesisVoxel*> voxels_;  ///< of each block; null where the tree has no leaf
  std::size_t tagged_ = 0, lost_ = 0, needless_ = 0;
};

}  // namespace hermesh
