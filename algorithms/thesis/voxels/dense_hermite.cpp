#include "algorithms/thesis/voxels/dense_hermite.h"

#include <atomic>
#include <mutex>
#include <type_traits>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/hermite/normal_codes.h"
#include "algorithms/hermite/sign_tree.h"
#include "algorithms/thesis/voxels/dense_tree.h"
#include "algorithms/thesis/voxels/voxels.h"

namespace hermesh {
namespace {

template <class Voxel>
using TreeOf = typename DenseGrid<Voxel>::TreeType;
template <class Voxel>
using LeafOf = typename TreeOf<Voxel>::LeafNodeType;

/// Returns the replacement of a lost crossing: the middle of the edge is off by half a voxel at most.
template <NormalCode Code, class Crossing>
Crossing substitute(int axis, bool inside) {
  EdgeCrossing crossing{0.5f, {}};
  crossing.normal[axis] = inside ? 1.0f : -1.0f;
  if constexpr (std::is_same_v<Crossing, PackedCrossing>)
    return pack<Code>(crossing);
  else
    return crossing;
}

/// Calls f(code) as with_normal_code() does, but with a fixed code where it does not matter: then the
/// compiler makes one copy of f instead of five.
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
  // All voxels begin outside, inactive and without crossings; the first crossing activates a voxel.
  auto leaf = std::make_unique<LeafOf<Voxel>>(sign_tree::coord(signs.lower), uniform_voxel<Voxel>(false));
  Voxel* const voxels = leaf->buffer().data();
  for_each_bit(signs.inside, [&](int sample) { voxels[sample].set_inside(true); });
  for_each_crossing(hermite, i, [&](int axis, int sample, const Crossing& crossing) {
    store_crossing<Code>(voxels[sample], axis, crossing);
    leaf->setValueOn(static_cast<openvdb::Index>(sample));
  });
  return leaf.release();
}

template <class Voxel, class Crossing>
DenseHermite<Voxel> dense_of(const SparseHermite<Crossing>& hermite, NormalCodeId code, RunContext& context) {
  register_dense_grids();
  // Codes are read or made only if one side has them and the other does not.
  constexpr bool kRecodes = std::is_same_v<Voxel, FixedVoxel> != std::is_same_v<Crossing, PackedCrossing>;
  auto tree = with_code_if<kRecodes>(code, [&](auto chosen) {
    return sign_tree::make_tree<TreeOf<Voxel>>(
        hermite, {uniform_voxel<Voxel>(false), uniform_voxel<Voxel>(true)}, context,
        [&](std::size_t i) { return make_leaf<Voxel, decltype(chosen)>(hermite, i); });
  });
  auto grid = DenseGrid<Voxel>::create(tree);
  grid->setTransform(transform_of(hermite.placement));
  // The layout of the thesis has its own normals.
  if (std::is_same_v<Voxel, ThesisVoxel>) code = NormalCodeId::thesis;
  return {hermite.placement, code, grid};
}

template <class Crossing, class Voxel>
SparseHermite<Crossing> sparse_of(const DenseHermite<Voxel>& dense, RunContext& context, std::size_t* lost) {
  SparseHermite<Crossing> hermite;
  hermite.placement = dense.placement;
  if (std::is_same_v<Voxel, FixedVoxel>) hermite.normal_code = dense.normal_code;
  // Signs first: they determine which edges have a crossing and where its record goes.
  const auto sources = sign_tree::read_signs(dense.grid->tree(), hermite, context,
                                             [](const Voxel& voxel) { return voxel.inside(); });
  std::atomic<std::size_t> missing = 0;
  with_code_if<std::is_same_v<Voxel, FixedVoxel>>(dense.normal_code, [&](auto chosen) {
    using Code = decltype(chosen);
    parallel_blocks(sources.size(), context, [&](std::size_t i) {
      const Voxel* const voxels = sources[i]->buffer().data();
      std::size_t next = hermite.leaves[i].first, absent = 0;
      const std::array<BlockMask, 3> edges = crossing_edges(hermite.leaves[i]);
      for (int axis = 0; axis < 3; ++axis)
        for_each_bit(edges[axis], [&](int sample) {
          const Voxel& voxel = voxels[sample];
          Crossing& crossing = hermite.crossings[next++];
          // Every crossing edge gets a record, or the ranks of all that follow would be wrong.
          if (voxel.crosses(axis))
            crossing = load_crossing<Code, Crossing>(voxel, axis);
          else
            crossing = substitute<Code, Crossing>(axis, voxel.inside()), ++absent;
        });
      missing += absent;
    });
  });
  if (lost) *lost = missing;
  return hermite;
}

/// Makes a voxel again from the values that it reports. The copy differs if a bit is set that never should
/// be: a distance that neither set() nor clear() writes, a normal without an offset, bit 30. Of ThesisVoxel
/// all bits are valid.
template <class Voxel>
Voxel remade(const Voxel& voxel) {
  if constexpr (std::is_same_v<Voxel, ThesisVoxel>) return voxel;
  using Stored = std::conditional_t<std::is_same_v<Voxel, FixedVoxel>, PackedCrossing, EdgeCrossing>;
  Voxel result = uniform_voxel<Voxel>(voxel.inside());
  for (int axis = 0; axis < 3; ++axis)
    if (voxel.crosses(axis))
      store_crossing<OctahedralNormalCode>(result, axis,
                                           load_crossing<OctahedralNormalCode, Stored>(voxel, axis));
  return result;
}

template <class Voxel>
std::size_t crossings_of(const Voxel& voxel) {
  return std::size_t{voxel.crosses(0)} + voxel.crosses(1) + voxel.crosses(2);
}

/// @throws Error for a voxel that its type never writes, and for tiles with crossings.
template <class Voxel>
void check_voxels(const DenseHermite<Voxel>& dense) {
  for (auto it = dense.grid->tree().cbeginValueAll(); it; ++it) {
    // Inactive voxels, too: their signs count, and their crossings would be read.
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
  const Eigen::Vector3d translation = placement.offset + placement.origin - placement.linear * base;
  openvdb::Mat4R matrix = openvdb::Mat4R::identity();  // OpenVDB multiplies rows from the left
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) matrix(column, row) = placement.linear(row, column);
  matrix.setTranslation(openvdb::Vec3R(translation.x(), translation.y(), translation.z()));
  return openvdb::math::Transform::createLinearTransform(matrix);
}

template <DenseVoxel Voxel>
std::size_t DenseHermite<Voxel>::leaves() const {
  return grid->tree().leafCount();
}

template <DenseVoxel Voxel>
std::size_t DenseHermite<Voxel>::crossings() const {
  // Tiles have none; check_voxels() ensures that in data from outside.
  std::size_t sum = 0;
  for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf)
    for (auto voxel = leaf->cbeginValueAll(); voxel; ++voxel) sum += crossings_of(*voxel);
  return sum;
}

template <DenseVoxel Voxel>
std::size_t DenseHermite<Voxel>::memory_bytes() const {
  return grid->tree().memUsage();
}

template <DenseVoxel Voxel>
std::size_t DenseHermite<Voxel>::bytes_per_leaf() {
  // OpenVDB adds masks, origin and alignment to the voxels.
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
  check_voxels(dense);
  std::size_t lost = 0;
  const FloatHermite hermite = to_sparse(dense, context, &lost);
  check_consistent(hermite);
  sign_tree::check_columns(hermite);
  sign_tree::check_tiles(dense.grid->tree(), hermite, [](const Voxel& voxel) { return voxel.inside(); });
  // Each crossing edge has one crossing or lacks it; any more belong to no crossing edge.
  if (lost > 0 && !std::is_same_v<Voxel, ThesisVoxel>)
    throw Error("the Hermite data lack " + std::to_string(lost) + " crossings where their signs change");
  if (dense.crossings() + lost != hermite.crossings.size())
    throw Error("the Hermite data have crossings where their signs do not change");
}

// OpenVDB trees take seconds to compile, so the four are instantiated here.
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

void register_dense_grids() {
  static std::once_flag once;
  std::call_once(once, [] {
    initialize_openvdb();  // clears the registry before it fills it
    DenseGrid<FloatVoxel>::registerGrid();
    DenseGrid<DirectedVoxel>::registerGrid();
    DenseGrid<ThesisVoxel>::registerGrid();
    DenseGrid<FixedVoxel>::registerGrid();
  });
}

}  // namespace hermesh
