// Points on every component of an isosurface, for methods that require initial points. Heavy (OpenVDB).
#pragma once

#include <vector>

#include "algorithms/core/openvdb_trees.h"

namespace hermesh {

/// Returns points of the isosurface, in voxel coordinates: points at which a grid edge at an active voxel
/// crosses the isovalue, by linear interpolation. Each connected component of the isosurface (cells joined
/// across faces that it crosses) gets one point for each block of `spacing` voxels that it meets, and no
/// fewer than 12 if it has as many crossings. The same grid gives the same points in the same order.
std::vector<openvdb::Vec3d> isosurface_seeds(const openvdb::FloatGrid& grid, double isovalue, int spacing);

}  // namespace hermesh
