// Estimates of the memory of a voxelization before anything is allocated, so that a much too small voxel size
// is refused with a message.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// Estimated size of a narrow band, within a factor of two for surfaces that are smooth at the scale of a
/// voxel. Small scattered pieces are overestimated up to eight times, since a piece that straddles blocks
/// counts as several; a surface that is rough below a voxel, too. Never more than the filled bounding box.
struct BandEstimate {
  double active_voxels = 0.0;
  double leaves = 0.0;      ///< 8³ blocks
  double grid_bytes = 0.0;  ///< size of the finished float grid
  double peak_bytes = 0.0;  ///< memory in use at most while the grid is made
};

/// Estimates the narrow band around a mesh; voxel size in world units, bands in voxels. Uses the surface's
/// area, the number of 8³ blocks with a corner of a polygon (for scattered small pieces), and the bounding
/// box (as the upper limit).
BandEstimate estimate_band(const PolygonMesh& mesh, double voxel_size, double exterior_band,
                           double interior_band);

/// Returns the bytes that this process can still allocate: the minimum of the machine's available memory and
/// the amounts left under its control group's limit and its own limits (ulimit -v, -d). Nothing if the system
/// does not report them.
std::optional<std::uint64_t> available_memory();

/// @throws Error "WHAT would need about …" for more bytes than available_memory(); `what` begins the message.
void check_fits_memory(double bytes, const std::string& what);

/// Checks that a mesh can be voxelized.
/// @throws Error for a voxel size that is not finite, not positive or below the minimum of OpenVDB's
/// transforms; a band that is not finite or below one voxel; a mesh without polygons or with a coordinate
/// that is not finite; voxel coordinates beyond 30 bits; or an estimate above the available memory.
void check_voxelization_fits(const PolygonMesh& mesh, double voxel_size, double exterior_band,
                             double interior_band);

}  // namespace hermesh
