#include "algorithms/voxelization/inside/boundary_distances.h"

#include <algorithm>

namespace hermesh {

void lower_distances(FloatLeaf& leaf, const float* values, const std::uint64_t* active) {
  float* own = leaf.buffer().data();
  for (unsigned i = 0; i < 512; ++i) own[i] = std::min(own[i], values[i]);
  FloatLeaf::NodeMaskType mask = leaf.getValueMask();
  for (openvdb::Index x = 0; x < 8; ++x) mask.getWord<openvdb::Index64>(x) |= active[x];
  leaf.setValueMask(mask);
}

namespace {

/// Replaces the distances of the leaf's voxels inside by those of `other`. Voxels outside keep theirs: every
/// path from outside to an interior face crosses the solid's boundary first, so the face is never the
/// nearest.
void replace_inside(FloatLeaf& leaf, const FoundLeaf& other, const BlockMask& inside, float reach) {
  FloatLeaf::NodeMaskType mask = leaf.getValueMask();
  for_each_bit(inside, [&](int i) {
    leaf.buffer().data()[i] = other.any ? other.values[i] : reach;
    mask.set(openvdb::Index32(i), other.any && test(other.active, i));
  });
  leaf.setValueMask(mask);
}

}  // namespace

InteriorFaces leave_out_interior_faces(const IndexSoup& soup, TriangleBins& bins, const Signs& signs,
                                       BandWork work, Band& band, RunContext& context,
                                       const WindingNumber* winding) {
  InteriorFaces sheets =
      find_interior_faces(soup, bins, band, signs, work.reach, work.voxel_size, context, winding);
  if (sheets.triangles.empty()) return sheets;
  // First without all triangles that are inner, even if only in part. Each callback writes to its own block's
  // leaf, so that threads need no lock.
  work.blocks = &sheets.blocks;
  work.without = &sheets.triangles;
  find_leaves(soup, bins, work, context, [&](const FoundLeaf& found) {
    if (!band.leaves[found.block]) return;
    const BlockMask& inside = signs.inside[found.block];
    replace_inside(*band.leaves[found.block], found, inside, float(work.reach * work.voxel_size));
    if (!work.nearest || !found.any) return;
    for_each_bit(inside, [&](int v) { (*band.nearest[found.block])[v] = found.nearest[v]; });
  });
  if (sheets.pieces.triangles.empty()) return sheets;
  // Then the outer pieces of the cut triangles are added again. They lie within their triangles, so all
  // blocks within their reach are in `bins`.
  const IndexSoup pieces(sheets.pieces, work.voxel_size);
  TriangleBins piece_bins(pieces, work.reach, context);
  work.blocks = work.without = nullptr;
  const std::vector<BlockAt> at = piece_bins.blocks().blocks();
  find_leaves(pieces, piece_bins, work, context, [&](const FoundLeaf& found) {
    const std::uint32_t block = found.any ? bins.blocks().find(at[found.block]) : BlockTable::kNone;
    if (block == BlockTable::kNone || !band.leaves[block]) return;
    if (work.nearest)
      for (unsigned v = 0; v < 512; ++v)
        if (found.values[v] < band.leaves[block]->buffer().data()[v])
          (*band.nearest[block])[v] = std::int32_t(sheets.parents[std::size_t(found.nearest[v])]);
    lower_distances(*band.leaves[block], found.values, found.active);
  });
  return sheets;
}

}  // namespace hermesh
