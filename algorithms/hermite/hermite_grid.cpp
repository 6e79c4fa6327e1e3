#include "algorithms/hermite/hermite_grid.h"

#include <openvdb/openvdb.h>

#include <unordered_map>

#include "algorithms/core/atomic_file.h"
#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"

// What OpenVDB needs to know of a value type.
namespace openvdb {
namespace OPENVDB_VERSION_NAME {
template <>
inline const char* typeNameAsString<hermesh::HermiteVoxel>() {
  return "hermite_float";
}
template <>
inline hermesh::HermiteVoxel zeroVal<hermesh::HermiteVoxel>() {
  return {};
}
namespace math {
inline hermesh::HermiteVoxel Abs(const hermesh::HermiteVoxel& voxel) { return voxel; }
template <>
inline bool isApproxEqual(const hermesh::HermiteVoxel& a, const hermesh::HermiteVoxel& b) {
  return a == b;
}
template <>
inline bool isApproxEqual(const hermesh::HermiteVoxel& a, const hermesh::HermiteVoxel& b,
                          const hermesh::HermiteVoxel&) {
  return a == b;
}
}  // namespace math
}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb

namespace hermesh {

using HermiteTreeType = openvdb::tree::Tree4<HermiteVoxel, 5, 4, 3>::Type;
using HermiteVdbGrid = openvdb::Grid<HermiteTreeType>;

struct HermiteTree {
  HermiteVdbGrid::Ptr grid;
};

namespace {

/// Cells of a block with a crossing edge, from the inside bits of their eight corners.
bool has_active_cell(const BlockGrid& grid, std::int32_t block) {
  BlockMask some{}, every{};
  every.fill(~0ull);
  for (int corner = 0; corner < 8; ++corner) {
    const BlockMask mask = grid.shifted_inside(block, corner & 1, (corner >> 1) & 1, corner >> 2);
    for (int word = 0; word < 8; ++word) some[word] |= mask[word], every[word] &= mask[word];
  }
  for (int word = 0; word < 8; ++word) some[word] &= ~every[word];
  return any(some);
}

HermiteVdbGrid::Ptr make_grid(const IndexToWorld& placement) {
  auto grid = HermiteVdbGrid::create(HermiteVoxel{});
  const Eigen::Vector3d base(placement.base[0], placement.base[1], placement.base[2]);
  const Eigen::Vector3d translation = placement.offset + placement.origin - placement.linear * base;
  openvdb::Mat4R matrix = openvdb::Mat4R::identity();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) matrix(column, row) = placement.linear(row, column);
  matrix.setTranslation(openvdb::Vec3R(translation.x(), translation.y(), translation.z()));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  grid->setName("hermite");
  return grid;
}

}  // namespace

HermiteGrid::HermiteGrid(const BlockGrid& grid, std::vector<std::int32_t>& source, RunContext& context)
    : tree_(std::make_shared<HermiteTree>()), placement_(grid.placement()) {
  initialize_openvdb();
  const std::size_t all = grid.blocks().size();
  std::vector<std::uint8_t> live(all);
  parallel_blocks(all, context,
                  [&](std::size_t i) { live[i] = has_active_cell(grid, static_cast<std::int32_t>(i)); });
  source.clear();
  std::vector<std::int32_t> renumbered(all, -1);
  for (std::size_t i = 0; i < all; ++i)
    if (live[i]) {
      renumbered[i] = static_cast<std::int32_t>(source.size());
      source.push_back(static_cast<std::int32_t>(i));
    }

  std::vector<HermiteTreeType::LeafNodeType*> leaves(source.size());
  blocks_.resize(source.size());
  parallel_blocks(source.size(), context, [&](std::size_t i) {
    const Block& from = grid.blocks()[source[i]];
    HermiteBlock& block = blocks_[i];
    leaves[i] =
        new HermiteTreeType::LeafNodeType(openvdb::Coord(from.lower[0], from.lower[1], from.lower[2]));
    block.lower = from.lower;
    block.voxels = leaves[i]->buffer().data();
    block.crossing = grid.crossing_edges(source[i]);
    for (int slot = 0; slot < 27; ++slot) {
      const std::int32_t there = from.neighbours[slot];
      block.neighbours[slot] = there >= 0 ? renumbered[there] : -1;
    }
    for (int sample = 0; sample < 512; ++sample) {
      HermiteVoxel& voxel = block.voxels[sample];
      voxel.inside = test(from.inside, sample);
      for (int axis = 0; axis < 3; ++axis)
        voxel.crossing =
            static_cast<std::uint8_t>(voxel.crossing | (test(block.crossing[axis], sample) << axis));
      if (voxel.crossing) leaves[i]->setValueOn(sample);
    }
  });
  tree_->grid = make_grid(placement_);
  for (auto* leaf : leaves) tree_->grid->tree().addLeaf(leaf);
}

std::size_t HermiteGrid::crossing_edges() const {
  std::size_t edges = 0;
  for (const HermiteBlock& block : blocks_)
    for (const BlockMask& axis : block.crossing) edges += static_cast<std::size_t>(count(axis));
  return edges;
}

std::size_t HermiteGrid::memory_bytes() const { return tree_->grid->memUsage(); }

void HermiteGrid::write(const std::filesystem::path& path, RunContext& context) const {
  Stage stage(context, "write Hermite data");
  AtomicFile file(path);
  try {
    openvdb::io::File out(file.path().string());
    out.write(openvdb::GridCPtrVec{tree_->grid});
    out.close();
  } catch (const openvdb::Exception& e) {
    throw Error(path.string() + " cannot be written (" + e.what() + ")");
  }
  file.commit();
}

void register_hermite_grid() {
  if (!HermiteVdbGrid::isRegistered()) HermiteVdbGrid::registerGrid();
}

}  // namespace hermesh
