// The side of the surface on which each voxel is, by flooding or by winding numbers.
#pragma once

#include <map>
#include <vector>

#include "algorithms/voxelization/distance/band.h"
#include "algorithms/voxelization/hermesh_voxelizer.h"
#include "algorithms/voxelization/inside/regions.h"

namespace hermesh {

class WindingNumber;

/// The sides of all voxels near the surface. A block is one of the bins' blocks().
struct Signs {
  /// Voxels inside, by number of the block.
  std::vector<BlockMask> inside;
  /// False if no rule finds an inside; `inside` is empty then.
  bool usable = true;
  /// The surface that closes the holes, if the signs are those of winding numbers: where the number is ½
  /// without a triangle, as triangles in voxels relative to the mesh's origin. Empty for a closed mesh.
  std::vector<TriangleCorners> caps;
  /// Voxels inside for the blocks near the caps that the table does not have.
  std::map<BlockAt, BlockMask> beyond;
};

/// Finds the side of every voxel of the band, which reaches `reach` voxels. A note reports that `rule` is
/// automatic and the flood leaked in, or that the polygons have no inside at all.
/// @throws Cancelled.
Signs find_signs(const IndexSoup& soup, SignRule rule, const TriangleBins& bins, const Band& band,
                 double reach, RunContext& context);

/// Finds the sides by the generalised winding number: inside is where `winding` is above ½. It changes by a
/// whole number at a triangle and smoothly elsewhere, so most blocks need a single evaluation for each of
/// their components. Where neighbouring components disagree or the number is near ½, as around a hole, every
/// voxel is evaluated; the surface of the value ½ across the hole is followed through space without blocks
/// and returned as the caps.
/// @param regions find_regions() of the table's blocks
/// @param open false if the surface is closed, so that no boundaries of holes are searched
/// @param reach how far distances matter, in voxels
/// @throws Cancelled.
Signs winding_signs(const WindingNumber& winding, const BlockTable& table, const Band& band,
                    const Regions& regions, bool open, double reach, const RunContext& context);

}  // namespace hermesh
