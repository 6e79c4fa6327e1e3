// Hermite data in OpenVDB trees of voxels (Aldén 2011, §4.2, §7.1 and figure 4.3): the thesis's layout, and
// the baseline of the memory that SparseHermite saves.
//
// Light: the trees themselves are in dense_tree.h.
#pragma once

#include <cstddef>
#include <memory>

#include "algorithms/core/openvdb_forward.h"
#include "algorithms/core/run_context.h"
#include "algorithms/hermite/boolean_rule.h"
#include "algorithms/hermite/sparse_hermite.h"
#include "algorithms/lattice/placement.h"
#include "algorithms/thesis/voxels/voxels.h"

namespace hermesh {

template <class Voxel>
using DenseGrid = openvdb::Grid<openvdb::tree::Tree<openvdb::tree::RootNode<
    openvdb::tree::InternalNode<openvdb::tree::InternalNode<openvdb::tree::LeafNode<Voxel, 3>, 4>, 5>>>>;

/// Hermite data as a tree of voxels, with a leaf for each block that owns a crossing edge. A voxel is active
/// if it owns one, and every voxel of a leaf has its sign. Tiles and the background have no crossings, are
/// inactive, and have the sign of their samples. So no leaf is uniform, and OpenVDB's pruning removes none.
template <DenseVoxel Voxel>
struct DenseHermite {
  using VoxelType = Voxel;
  IndexToWorld placement;
  NormalCodeId normal_code =
      NormalCodeId::octahedral;  ///< code of the normals of FixedVoxel and ThesisVoxel; otherwise unused
  /// Shared by copies of a DenseHermite, and constant once it is made.
  std::shared_ptr<const DenseGrid<Voxel>> grid;

  std::size_t leaves() const;
  std::size_t crossings() const;     ///< number of edges that their voxels record as crossed
  std::size_t memory_bytes() const;  ///< bytes that the tree has allocated
  static std::size_t bytes_per_leaf();
};

using FloatDense = DenseHermite<FloatVoxel>;
using DirectedDense = DenseHermite<DirectedVoxel>;
using ThesisDense = DenseHermite<ThesisVoxel>;
using FixedDense = DenseHermite<FixedVoxel>;

/// Converts to dense voxels. FloatVoxel loses nothing. FixedVoxel rounds, with normals in `code`;
/// DirectedVoxel keeps offsets only; ThesisVoxel loses precision, and some crossings
/// (ThesisVoxel::crosses()).
template <DenseVoxel Voxel>
DenseHermite<Voxel> to_dense(const FloatHermite& hermite, RunContext& context,
                             NormalCodeId code = NormalCodeId::octahedral);

/// Converts packed data to dense voxels. FixedVoxel takes the codes unchanged, without tags; the others get
/// the decoded values. @throws Cancelled.
template <DenseVoxel Voxel>
DenseHermite<Voxel> to_dense(const PackedHermite& hermite, RunContext& context);

/// Converts to sparse data. An edge whose ends differ in sign, but whose voxel does not record a crossing,
/// gets a crossing at its midpoint with the edge's direction as normal, towards the outside; `lost` is set to
/// the number of these.
/// @throws Error if signs change between two tiles, which only data of other programs can contain.
template <DenseVoxel Voxel>
FloatHermite to_sparse(const DenseHermite<Voxel>& dense, RunContext& context, std::size_t* lost = nullptr);

/// Converts to packed data: the same codes, with tags of 0. `lost` as in to_sparse().
PackedHermite to_packed(const FixedDense& dense, RunContext& context, std::size_t* lost = nullptr);

/// Checks data of unknown origin. @throws Error if an edge is crossed without a change of sign, if a crossing
/// is missing (except those that ThesisVoxel loses), if a voxel holds a value that its type never writes, or
/// as check_consistent() does for the same data as SparseHermite.
template <DenseVoxel Voxel>
void check_consistent(const DenseHermite<Voxel>& dense, RunContext& context);

/// Computes the union, the intersection or the difference `a` \ `b`.
///
/// FloatVoxel, FixedVoxel and DirectedVoxel follow the rule of boolean_rule.h: except for tags, the result is
/// that of the same data as SparseHermite, by values and by topology, and the same laws hold.
///
/// ThesisVoxel follows equation 7.1 as printed. A component is the distance along one edge with the sign of
/// the voxel, and infinite where there are no data; a union takes the smaller of two components with its
/// data, an intersection the greater, and of equal ones that of `a`. The difference is the intersection with
/// the complement. Therefore
///   - where the operands cross an edge in opposite directions, the edge is crossed in the result between two
///     samples of one sign (trap T11);
///   - a crossing that appears to be missing, because its normal has the code 0, loses against any other in a
///     union outside and wins inside, so it is missing from the result or replaced by a wrong one (trap T2);
///   - the complement maps the normal 0xE000 along x or y, one near -z with the signs of the negative octant,
///     to code 0: the crossing is lost, complementing again does not restore it, and De Morgan's laws do not
///     hold. Its result does not pass check_consistent().
///
/// An operand that is moved in and not shared gives up its nodes: branches that only one operand has are
/// moved or dropped as a whole. A shared operand is copied as far as it is needed (`a` as a whole).
/// @throws Error if the operands are on different lattices or have normals in different codes; Cancelled.
template <DenseVoxel Voxel>
DenseHermite<Voxel> combine(Boolean boolean, DenseHermite<Voxel> a, DenseHermite<Voxel> b,
                            RunContext& context);

/// Computes the complement: the outside becomes inside, also at infinity, and normals are reversed. Works in
/// place if its argument is moved into it and not shared. An involution, except for ThesisVoxel (see
/// combine()). @throws Cancelled.
template <DenseVoxel Voxel>
DenseHermite<Voxel> complement(DenseHermite<Voxel> hermite, RunContext& context);

/// Registers the four grid types with OpenVDB, once, after initialize_openvdb(). OpenVDB opens a file with
/// such a grid only if its type is registered, so a program must call this before it reads volumes; the
/// functions above and hermite_file.h call it themselves.
void register_dense_grids();

}  // namespace hermesh
