// What a voxelization would cost, found before anything is allocated, so that a voxel size with a few zeros
// too many is refused with a sentence instead of ending in the machine's out-of-memory killer.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// Estimated size of a narrow band. Right within a factor of two for surfaces that are smooth at the scale of
/// a voxel. Small scattered pieces are overestimated up to eight times, since a piece that straddles blocks
/// counts as several; a surface that is rough below a voxel is overestimated, too. Never more than the filled
/// bounding box.
struct BandEstimate {
  double active_voxels = 0.0;
  double leaves = 0.0;      ///< 8³ blocks
  double grid_bytes = 0.0;  ///< size of the finished float grid
  double peak_bytes = 0.0;  ///< memory in use at most while the grid is made
};

/// Estimates the narrow band around a mesh; voxel size in world units, bands in voxels. The estimate rests on
/// the surface's area, on the number of 8³ blocks that hold a corner of a polygon (for scattered small
/// pieces), and on the bounding box (as the upper limit).
BandEstimate estimate_band(const PolygonMesh& mesh, double voxel_size, double exterior_band,
                           double interior_band);

/// Bytes that this process could still take: the machine's available memory, what its control group has left,
/// or what its own limits (ulimit -v, -d) leave, whichever is less. Nothing when the system does not say.
std::optional<std::uint64_t> available_memory();

/// Refuses what would take more memory than available_memory(); `what` begins the sentence.
/// @throws Error "WHAT would need about …" for more bytes than are available.
void check_fits_memory(double bytes, const std::string& what);

/// Refuses what cannot be voxelized.
/// @throws Error for a voxel size that is not finite, not positive or below what OpenVDB's transforms take; a
/// band that is not finite or below one voxel; a mesh without polygons or with a coordinate that is not
/// finite; voxel coordinates beyond 30 bits; or an estimate above the available memory.
void check_voxelization_fits(const PolygonMesh& mesh, double voxel_size, double exterior_band,
                             double interior_band);

}  // namespace hermesh
