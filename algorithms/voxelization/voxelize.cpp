#include "algorithms/voxelization/voxelize.h"

#include <openvdb/tools/SignedFloodFill.h>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/memory_estimate.h"
#include "algorithms/core/parallel.h"
#include "algorithms/voxelization/band.h"
#include "algorithms/voxelization/inner_sheets.h"
#include "algorithms/voxelization/signs.h"

namespace hermesh {
namespace {

/// Widths of the band in world units.
struct Widths {
  float exterior, interior;
};

void sign_leaf(FloatLeaf& leaf, const VoxelBits& inside, const Widths& widths,
               const kernels::Kernels& kernels) {
  FloatLeaf::NodeMaskType mask = leaf.getValueMask();
  kernels.apply_signs(inside.data(), widths.exterior, widths.interior, leaf.buffer().data(),
                      &mask.getWord<openvdb::Index64>(0));
  leaf.setValueMask(mask);
}

PolygonMesh to_mesh(const std::vector<TriangleCorners>& triangles, double voxel_size) {
  PolygonMesh mesh;
  for (const TriangleCorners& t : triangles) {
    const std::uint32_t n = std::uint32_t(mesh.points.size());
    for (std::size_t i = 0; i < 3; ++i)
      mesh.points.push_back(Eigen::Map<const Eigen::Vector3d>(t.data() + 3 * i).cast<float>() *
                            float(voxel_size));
    mesh.triangles.push_back({n, n + 1, n + 2});
  }
  return mesh;
}

/// Takes the smaller distance of each voxel.
void lower(FloatLeaf& leaf, const FloatLeaf& other) {
  float* values = leaf.buffer().data();
  for (unsigned i = 0; i < 512; ++i) values[i] = std::min(values[i], other.buffer().data()[i]);
  FloatLeaf::NodeMaskType mask = leaf.getValueMask();
  mask |= other.getValueMask();
  leaf.setValueMask(mask);
}

/// Adds the distances to the caps of the holes, and the blocks that only a cap is near.
void add_caps(Signs& signs, double voxel_size, double reach, const BlockTable& table, Band& band,
              RunContext& context) {
  const PolygonMesh caps = to_mesh(signs.caps, voxel_size);
  const IndexSoup soup(caps, voxel_size);
  const TriangleBins bins(soup, reach, context);
  Band near_caps = compute_band(soup, bins, reach, voxel_size, false, context);
  for (std::size_t i = 0; i < near_caps.blocks.size(); ++i) {
    if (!near_caps.leaves[i]) continue;
    const std::uint32_t known = table.find(near_caps.blocks[i]);
    if (known != BlockTable::kNone && band.leaves[known]) {
      lower(*band.leaves[known], *near_caps.leaves[i]);
      continue;
    }
    band.leaves.push_back(std::move(near_caps.leaves[i]));
    band.blocks.push_back(near_caps.blocks[i]);
    signs.inside.push_back(known != BlockTable::kNone ? VoxelBits(signs.inside[known])
                                                      : signs.beyond.at(near_caps.blocks[i]));
    if (!band.nearest.empty()) {
      band.nearest.push_back(std::make_unique<LeafTriangles>());
      band.nearest.back()->fill(-1);
    }
  }
}

/// Gives the voxels inside the values of `other`, which may be null where nothing is near.
void replace_inside(FloatLeaf& leaf, const FloatLeaf* other, const VoxelBits& inside, float reach) {
  FloatLeaf::NodeMaskType mask = leaf.getValueMask();
  for (unsigned i = 0; i < 512; ++i) {
    if (!(inside[i >> 6] >> (i & 63) & 1)) continue;
    leaf.buffer().data()[i] = other ? other->buffer().data()[i] : reach;
    mask.set(i, other && other->isValueOn(i));
  }
  leaf.setValueMask(mask);
}

/// Distances of the voxels inside, once more without what does not bound the solid.
void leave_out_inner_sheets(const IndexSoup& soup, const TriangleBins& bins, const Signs& signs,
                            double voxel_size, double reach, Band& band, RunContext& context) {
  const InnerSheets sheets = find_inner_sheets(soup, bins, band, signs.inside, reach, voxel_size, context);
  if (sheets.triangles.empty()) return;
  std::vector<std::unique_ptr<LeafTriangles>> nearest;
  const bool ids = !band.nearest.empty();
  const auto leaves = recompute_leaves(soup, bins, band, sheets.blocks, sheets.triangles, reach, voxel_size,
                                       ids ? &nearest : nullptr, context);
  for (std::uint32_t i = 0; i < sheets.blocks.size(); ++i) {
    const std::uint32_t block = sheets.blocks[i];
    if (!band.leaves[block]) continue;
    replace_inside(*band.leaves[block], leaves[i].get(), signs.inside[block], float(reach * voxel_size));
    if (ids && nearest[i])
      for (unsigned v = 0; v < 512; ++v)
        if (signs.inside[block][v >> 6] >> (v & 63) & 1) (*band.nearest[block])[v] = (*nearest[i])[v];
  }
  if (sheets.pieces.triangles.empty()) return;
  const IndexSoup pieces(sheets.pieces, voxel_size);
  const TriangleBins piece_bins(pieces, reach, context);
  const Band near_pieces = compute_band(pieces, piece_bins, reach, voxel_size, ids, context);
  for (std::size_t i = 0; i < near_pieces.blocks.size(); ++i) {
    const std::uint32_t block = bins.blocks().find(near_pieces.blocks[i]);
    if (!near_pieces.leaves[i] || block == BlockTable::kNone || !band.leaves[block]) continue;
    if (ids)
      for (unsigned v = 0; v < 512; ++v)
        if (near_pieces.leaves[i]->buffer().data()[v] < band.leaves[block]->buffer().data()[v])
          (*band.nearest[block])[v] = std::int32_t(sheets.parents[std::size_t((*near_pieces.nearest[i])[v])]);
    lower(*band.leaves[block], *near_pieces.leaves[i]);
  }
}

openvdb::math::Transform::Ptr placement(const PolygonMesh& mesh, double voxel_size) {
  const auto transform = openvdb::math::Transform::createLinearTransform(voxel_size);
  transform->postTranslate(openvdb::Vec3d(mesh.origin.x(), mesh.origin.y(), mesh.origin.z()));
  return transform;
}

openvdb::Int32Grid::Ptr assemble_nearest(const Band& band) {
  using IntLeaf = openvdb::Int32Tree::LeafNodeType;
  const auto grid = openvdb::Int32Grid::create(-1);
  for (std::size_t i = 0; i < band.leaves.size(); ++i) {
    if (!band.leaves[i] || band.leaves[i]->isEmpty()) continue;
    auto leaf = std::make_unique<IntLeaf>(band.leaves[i]->origin(), -1, false);
    leaf->setValueMask(band.leaves[i]->getValueMask());
    for (auto value = leaf->beginValueOn(); value; ++value) value.setValue((*band.nearest[i])[value.pos()]);
    grid->tree().addLeaf(leaf.release());
  }
  grid->setName("triangle-id");
  return grid;
}

openvdb::FloatGrid::Ptr assemble_distance(Band& band, const Widths& widths, bool is_signed) {
  const auto grid = openvdb::FloatGrid::create(widths.exterior);
  for (std::unique_ptr<FloatLeaf>& leaf : band.leaves)
    if (leaf && !leaf->isEmpty()) grid->tree().addLeaf(leaf.release());
  grid->setName(is_signed ? "sdf" : "udf");
  if (!is_signed) return grid;
  // Leaves are signed already; what is left are the tiles.
  openvdb::tools::signedFloodFillWithValues(grid->tree(), widths.exterior, -widths.interior, true, 1, 1);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return grid;
}

/// False when there is no inside.
bool sign(const IndexSoup& soup, const VoxelizeOptions& options, double reach, const TriangleBins& bins,
          const Widths& widths, Band& band, RunContext& context) {
  Signs signs = find_signs(soup, options.signs, bins, band, reach, context);
  if (!signs.usable) return false;
  leave_out_inner_sheets(soup, bins, signs, options.voxel_size, reach, band, context);
  if (!signs.caps.empty()) add_caps(signs, options.voxel_size, reach, bins.blocks(), band, context);
  const kernels::Kernels& kernels = kernels::chosen();
  parallel_blocks(band.leaves.size(), context, [&](std::size_t i) {
    if (band.leaves[i]) sign_leaf(*band.leaves[i], signs.inside[i], widths, kernels);
  });
  return true;
}

}  // namespace

Voxelization voxelize(const PolygonMesh& mesh, const VoxelizeOptions& options, RunContext& context) {
  check_voxelization_fits(mesh, options.voxel_size, options.exterior_band, options.interior_band);
  initialize_openvdb();
  const Widths widths{float(options.exterior_band * options.voxel_size),
                      float(options.interior_band * options.voxel_size)};
  const double reach = std::max(options.exterior_band, options.interior_band);
  const IndexSoup soup(mesh, options.voxel_size);
  bool is_signed = false;
  std::optional<TriangleBins> bins;
  {
    const Stage stage(context, "triangles to blocks");
    bins.emplace(soup, reach, context);
  }
  Band band;
  {
    const Stage stage(context, "distances");
    band = compute_band(soup, *bins, reach, options.voxel_size, options.nearest, context);
  }
  {
    const Stage stage(context, "signs");
    is_signed = options.signs != SignRule::none && sign(soup, options, reach, *bins, widths, band, context);
  }
  const Stage stage(context, "tree");
  Voxelization result;
  if (options.nearest) result.nearest = assemble_nearest(band);
  result.distance = assemble_distance(band, widths, is_signed);
  result.is_signed = is_signed;
  result.distance->setTransform(placement(mesh, options.voxel_size));
  if (result.nearest) result.nearest->setTransform(placement(mesh, options.voxel_size));
  return result;
}

}  // namespace hermesh
