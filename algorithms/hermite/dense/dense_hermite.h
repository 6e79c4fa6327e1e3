// Hermite data in OpenVDB trees of voxels (Aldén 2011, §4.2 and figure 4.3), for what works on whole voxels,
// for OpenVDB's own tools, and to compare with: what SparseHermite saves is measured against these.
//
// Light: the tree itself is in dense_tree.h.
#pragma once

#include <cstddef>
#include <memory>

#include "algorithms/core/run_context.h"
#include "algorithms/hermite/dense/voxels.h"
#include "algorithms/hermite/sparse_hermite.h"
#include "algorithms/lattice/placement.h"

namespace hermesh {

template <class Voxel>
struct DenseTree;  // dense_tree.h

/// Hermite data as a tree of voxels, with a leaf for each block that owns a crossing edge. A voxel is active
/// if it owns one, and every voxel of a leaf has its sign. Tiles and the background have no crossings, are
/// inactive, and have the sign of their samples. So no leaf is uniform, and OpenVDB's pruning removes none.
template <DenseVoxel Voxel>
struct DenseHermite {
  using VoxelType = Voxel;
  IndexToWorld placement;
  NormalCodeId normal_code =
      NormalCodeId::octahedral;  ///< code of FixedVoxel's and ThesisVoxel's normals; else without meaning
  /// Copies of a DenseHermite share it; nobody changes it once it is made.
  std::shared_ptr<const DenseTree<Voxel>> tree;

  std::size_t leaves() const;
  std::size_t crossings() const;     ///< number of edges whose voxel says that they have one
  std::size_t memory_bytes() const;  ///< bytes that the tree has allocated
  static std::size_t bytes_per_leaf();
};

using FloatDense = DenseHermite<FloatVoxel>;
using DirectedDense = DenseHermite<DirectedVoxel>;
using ThesisDense = DenseHermite<ThesisVoxel>;
using FixedDense = DenseHermite<FixedVoxel>;

/// The data as dense voxels. FloatVoxel loses nothing. FixedVoxel rounds, with normals in `code`;
/// DirectedVoxel keeps offsets; ThesisVoxel loses precision, and some crossings (ThesisVoxel::crosses()).
template <DenseVoxel Voxel>
DenseHermite<Voxel> to_dense(const FloatHermite& hermite, RunContext& context,
                             NormalCodeId code = NormalCodeId::octahedral);

/// The packed data as dense voxels. FixedVoxel takes the codes as they are, but has no room for tags; the
/// others get what the codes stand for. @throws Cancelled.
template <DenseVoxel Voxel>
DenseHermite<Voxel> to_dense(const PackedHermite& hermite, RunContext& context);

/// The data as sparse ones. An edge whose ends differ in sign, but whose voxel says that it has no crossing,
/// gets one in the middle with the edge's direction as normal, towards the outside; `lost` says how many
/// there were.
/// @throws Error if signs change between two tiles, which only foreign hands can bring about.
template <DenseVoxel Voxel>
FloatHermite to_sparse(const DenseHermite<Voxel>& dense, RunContext& context, std::size_t* lost = nullptr);

/// The data as packed ones: the codes as they are, with tags of 0. `lost` as in to_sparse().
PackedHermite to_packed(const FixedDense& dense, RunContext& context, std::size_t* lost = nullptr);

/// @throws Error that says what is wrong if a crossing belongs to no change of sign, if one is missing (but
/// for those that ThesisVoxel loses), if a voxel holds what its type never writes, or for what
/// check_consistent() finds in the same data as SparseHermite. For data from outside.
template <DenseVoxel Voxel>
void check_consistent(const DenseHermite<Voxel>& dense, RunContext& context);

/// Makes the four grid types known to OpenVDB's input and output; initialize_openvdb() calls it.
void register_hermite_grids();

}  // namespace hermesh
