#include "algorithms/hermite/dense/dense_hermite.h"

#include <atomic>
#include <type_traits>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/hermite/dense/dense_tree.h"
#include "algorithms/hermite/dense/thesis_voxel.h"
#include "algorithms/hermite/sign_tree.h"
#include "algorithms/hermite/with_normal_code.h"

namespace hermesh {
namespace {

template <class Voxel>
using TreeOf = typename DenseGrid<Voxel>::TreeType;
template <class Voxel>
using LeafOf = typename TreeOf<Voxel>::LeafNodeType;

// Four ways of one crossing into a voxel and out of it, by what is stored on either side. `Code` is the code
// of FixedVoxel's normals, or of the packed crossing; codes that both sides have are passed on without
// decoding.

template <NormalCode Code, class Voxel>
void store(Voxel& voxel, int axis, const EdgeCrossing& crossing) {
  if constexpr (std::is_same_v<Voxel, FixedVoxel>)
    voxel.template set<Code>(axis, crossing);
  else
    voxel.set(axis, crossing);
}
template <NormalCode Code, class Voxel>
void store(Voxel& voxel, int axis, PackedCrossing crossing) {
  if constexpr (std::is_same_v<Voxel, FixedVoxel>)
    voxel.set_packed(axis, crossing);
  else
    voxel.set(axis, unpack<Code>(crossing));
}

template <NormalCode Code, class Voxel>
void load(const Voxel& voxel, int axis, EdgeCrossing& crossing) {
  if constexpr (std::is_same_v<Voxel, FixedVoxel>)
    crossing = voxel.template get<Code>(axis);
  else
    crossing = voxel.get(axis);
}
template <NormalCode Code>
void load(const FixedVoxel& voxel, int axis, PackedCrossing& crossing) {
  crossing = voxel.get_packed(axis);
}

template <NormalCode Code, class Crossing>
Crossing substitute(int axis, bool inside) {
  // What to_sparse() puts in place of a lost crossing: the middle of the edge is off by half a voxel at most.
  EdgeCrossing crossing{0.5f, {}};
  crossing.normal[axis] = inside ? 1.0f : -1.0f;
  if constexpr (std::is_same_v<Crossing, PackedCrossing>)
    return pack<Code>(crossing);
  else
    return crossing;
}

/// Calls f(code) as with_normal_code() does, but with any code where it does not matter: then the compiler
/// makes one copy of f and not five.
template <bool kMatters, class F>
auto with_code_if(NormalCodeId code, F&& f) {
  if constexpr (kMatters)
    return with_normal_code(code, f);
  else
    return f(OctahedralNormalCode{});
}

template <class Voxel, NormalCode Code, class Crossing>
LeafOf<Voxel>* make_leaf(const SparseHermite<Crossing>& hermite, std::size_t i) {
  const SignLeaf& signs = hermite.leaves[i];
  // All voxels begin outside and without crossings. A voxel becomes active with its first crossing, and only
  // then.
  auto leaf = std::make_unique<LeafOf<Voxel>>(sign_tree::coord(signs.lower), uniform_voxel<Voxel>(false));
  Voxel* const voxels = leaf->buffer().data();
  // Voxels are outside until told otherwise, so only set bits are visited.
  for_each_bit(signs.inside, [&](int sample) { voxels[sample].set_inside(true); });
  for_each_crossing(hermite, i, [&](int axis, int sample, const Crossing& crossing) {
    store<Code>(voxels[sample], axis, crossing);
    leaf->setValueOn(static_cast<openvdb::Index>(sample));
  });
  return leaf.release();
}

template <class Voxel, class Crossing>
DenseHermite<Voxel> dense_of(const SparseHermite<Crossing>& hermite, NormalCodeId code, RunContext& context) {
  initialize_openvdb();
  // Only where one side has codes and the other has not, codes must be read or made.
  constexpr bool kRecodes = std::is_same_v<Voxel, FixedVoxel> != std::is_same_v<Crossing, PackedCrossing>;
  auto tree = with_code_if<kRecodes>(code, [&](auto chosen) {
    return sign_tree::make_tree<TreeOf<Voxel>>(
        hermite, {uniform_voxel<Voxel>(false), uniform_voxel<Voxel>(true)}, context,
        [&](std::size_t i) { return make_leaf<Voxel, decltype(chosen)>(hermite, i); });
  });
  auto grid = DenseGrid<Voxel>::create(tree);
  grid->setTransform(transform_of(hermite.placement));
  // The layout of the thesis has its own normals, whatever was asked for.
  if (std::is_same_v<Voxel, ThesisVoxel>) code = NormalCodeId::thesis;
  return {hermite.placement, code, std::make_shared<const DenseTree<Voxel>>(DenseTree<Voxel>{grid})};
}

template <class Crossing, class Voxel>
SparseHermite<Crossing> sparse_of(const DenseHermite<Voxel>& dense, RunContext& context, std::size_t* lost) {
  SparseHermite<Crossing> hermite;
  hermite.placement = dense.placement;
  if (std::is_same_v<Voxel, FixedVoxel>) hermite.normal_code = dense.normal_code;
  // Signs first: they alone say which edges have a crossing and where its record goes. What voxels claim of
  // their edges is asked only there.
  const auto sources = sign_tree::read_signs(dense.tree->grid->tree(), hermite, context,
                                             [](const Voxel& voxel) { return voxel.inside(); });
  std::atomic<std::size_t> missing = 0;
  with_code_if<std::is_same_v<Voxel, FixedVoxel>>(dense.normal_code, [&](auto chosen) {
    using Code = decltype(chosen);
    parallel_blocks(sources.size(), context, [&](std::size_t i) {
      const Voxel* const voxels = sources[i]->buffer().data();
      // Leaves write to ranges of their own, so that the order of threads does not matter; the one shared
      // number is a sum.
      std::size_t next = hermite.leaves[i].first, absent = 0;
      const std::array<BlockMask, 3> edges = crossing_edges(hermite.leaves[i]);
      for (int axis = 0; axis < 3; ++axis)
        for_each_bit(edges[axis], [&](int sample) {
          const Voxel& voxel = voxels[sample];
          Crossing& crossing = hermite.crossings[next++];
          if (voxel.crosses(axis))
            load<Code>(voxel, axis, crossing);
          else
            // Every crossing edge gets a record, or the ranks of all behind it would be off.
            crossing = substitute<Code, Crossing>(axis, voxel.inside()), ++absent;
        });
      missing += absent;
    });
  });
  if (lost) *lost = missing;
  return hermite;
}

/// A voxel made anew from what it says of itself. The copy differs if a bit is set that never should be.
FloatVoxel remade(const FloatVoxel& voxel) {
  FloatVoxel result = uniform_voxel<FloatVoxel>(voxel.inside());
  for (int axis = 0; axis < 3; ++axis)
    if (voxel.crosses(axis)) result.set(axis, voxel.get(axis));
  return result;
}
/// A voxel made anew, as above; distances that are not those of set() or clear() do not come back.
DirectedVoxel remade(const DirectedVoxel& voxel) {
  DirectedVoxel result = uniform_voxel<DirectedVoxel>(voxel.inside());
  for (int axis = 0; axis < 3; ++axis)
    if (voxel.crosses(axis)) result.set(axis, voxel.get(axis));
  return result;
}
/// A voxel made anew, as above; a normal without an offset, or bit 30, does not come back.
FixedVoxel remade(const FixedVoxel& voxel) {
  FixedVoxel result = uniform_voxel<FixedVoxel>(voxel.inside());
  for (int axis = 0; axis < 3; ++axis)
    if (voxel.crosses(axis)) result.set_packed(axis, voxel.get_packed(axis));
  return result;
}
/// The voxel itself: all bits have a meaning, though not on every edge, and nothing is out of range.
ThesisVoxel remade(const ThesisVoxel& voxel) { return voxel; }

template <class Voxel>
std::size_t crossings_of(const Voxel& voxel) {
  return std::size_t{voxel.crosses(0)} + voxel.crosses(1) + voxel.crosses(2);
}

/// @throws Error for a voxel that its type never writes, and for tiles with crossings.
template <class Voxel>
void check_voxels(const DenseHermite<Voxel>& dense) {
  for (auto it = dense.tree->grid->tree().cbeginValueAll(); it; ++it) {
    // Also in inactive voxels: their signs count, and their crossings would be read.
    if (!(remade(*it) == *it))
      throw Error("the Hermite data hold a voxel that is none of theirs at " +
                  std::to_string(it.getCoord().x()) + ", " + std::to_string(it.getCoord().y()) + ", " +
                  std::to_string(it.getCoord().z()));
    if (!it.isVoxelValue() && crossings_of(*it) > 0)
      throw Error("the Hermite data have crossings in a region without surface");
  }
}

}  // namespace

openvdb::math::Transform::Ptr transform_of(const IndexToWorld& placement) {
  const Eigen::Vector3d base(placement.base[0], placement.base[1], placement.base[2]);
  // The parts of a placement keep small numbers apart from large ones; a transform has one translation, in
  // double precision.
  const Eigen::Vector3d translation = placement.offset + placement.origin - placement.linear * base;
  openvdb::Mat4R matrix = openvdb::Mat4R::identity();  // OpenVDB multiplies rows from the left
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) matrix(column, row) = placement.linear(row, column);
  matrix.setTranslation(openvdb::Vec3R(translation.x(), translation.y(), translation.z()));
  return openvdb::math::Transform::createLinearTransform(matrix);
}

template <DenseVoxel Voxel>
std::size_t DenseHermite<Voxel>::leaves() const {
  return tree->grid->tree().leafCount();
}

template <DenseVoxel Voxel>
std::size_t DenseHermite<Voxel>::crossings() const {
  // Of leaves alone: tiles have none, which check_voxels() makes sure of in data from outside.
  std::size_t sum = 0;
  for (auto leaf = tree->grid->tree().cbeginLeaf(); leaf; ++leaf)
    for (auto voxel = leaf->cbeginValueAll(); voxel; ++voxel) sum += crossings_of(*voxel);
  return sum;
}

template <DenseVoxel Voxel>
std::size_t DenseHermite<Voxel>::memory_bytes() const {
  return tree->grid->tree().memUsage();
}

template <DenseVoxel Voxel>
std::size_t DenseHermite<Voxel>::bytes_per_leaf() {
  // Asked of a leaf, since OpenVDB adds masks, origin and alignment to the voxels.
  return LeafOf<Voxel>(openvdb::Coord(0), Voxel{}).memUsage();
}

template <DenseVoxel Voxel>
DenseHermite<Voxel> to_dense(const FloatHermite& hermite, RunContext& context, NormalCodeId code) {
  return dense_of<Voxel>(hermite, code, context);
}

template <DenseVoxel Voxel>
DenseHermite<Voxel> to_dense(const PackedHermite& hermite, RunContext& context) {
  return dense_of<Voxel>(hermite, hermite.normal_code, context);
}

template <DenseVoxel Voxel>
FloatHermite to_sparse(const DenseHermite<Voxel>& dense, RunContext& context, std::size_t* lost) {
  return sparse_of<EdgeCrossing>(dense, context, lost);
}

PackedHermite to_packed(const FixedDense& dense, RunContext& context, std::size_t* lost) {
  return sparse_of<PackedCrossing>(dense, context, lost);
}

template <DenseVoxel Voxel>
void check_consistent(const DenseHermite<Voxel>& dense, RunContext& context) {
  // From the small to the large: single voxels, then signs and crossings of leaves, then what lies between
  // leaves.
  check_voxels(dense);
  std::size_t lost = 0;
  const FloatHermite hermite = to_sparse(dense, context, &lost);
  check_consistent(hermite);
  sign_tree::check_columns(hermite);
  sign_tree::check_tiles(dense.tree->grid->tree(), hermite,
                         [](const Voxel& voxel) { return voxel.inside(); });
  // Each crossing edge has one crossing or lacks it; any more belong to no crossing edge.
  if (lost > 0 && !std::is_same_v<Voxel, ThesisVoxel>)
    throw Error("the Hermite data lack " + std::to_string(lost) + " crossings where their signs change");
  if (dense.crossings() + lost != hermite.crossings.size())
    throw Error("the Hermite data have crossings where their signs do not change");
}

// OpenVDB trees take seconds to compile, so the four are made here and nowhere else.
#define HERMESH_INSTANTIATE_DENSE(Voxel)                                                        \
  template struct DenseHermite<Voxel>;                                                          \
  template DenseHermite<Voxel> to_dense<Voxel>(const FloatHermite&, RunContext&, NormalCodeId); \
  template DenseHermite<Voxel> to_dense<Voxel>(const PackedHermite&, RunContext&);              \
  template FloatHermite to_sparse(const DenseHermite<Voxel>&, RunContext&, std::size_t*);       \
  template void check_consistent(const DenseHermite<Voxel>&, RunContext&);
HERMESH_INSTANTIATE_DENSE(FloatVoxel)
HERMESH_INSTANTIATE_DENSE(DirectedVoxel)
HERMESH_INSTANTIATE_DENSE(ThesisVoxel)
HERMESH_INSTANTIATE_DENSE(FixedVoxel)

void register_hermite_grids() {
  // Registering a type a second time is an error in OpenVDB.
  const auto once = []<class Grid>(Grid*) {
    if (!Grid::isRegistered()) Grid::registerGrid();
  };
  once(static_cast<DenseGrid<FloatVoxel>*>(nullptr));
  once(static_cast<DenseGrid<DirectedVoxel>*>(nullptr));
  once(static_cast<DenseGrid<ThesisVoxel>*>(nullptr));
  once(static_cast<DenseGrid<FixedVoxel>*>(nullptr));
}

}  // namespace hermesh
