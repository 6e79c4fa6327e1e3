// Points on every component of an isosurface, for methods that have to be told where it is. Heavy (OpenVDB).
#pragma once

#include <openvdb/openvdb.h>

#include <vector>

namespace hermesh {

/// Points in voxel coordinates where a grid edge at an active voxel crosses the isovalue, by linear
/// interpolation. For each connected component of the isosurface (cells joined across faces that it crosses):
/// one point for each block of `spacing` voxels that the component meets, and no fewer than 12 where it has
/// as many. The same grid gives the same points in the same order.
std::vector<openvdb::Vec3d> isosurface_seeds(const openvdb::FloatGrid& grid, double isovalue, int spacing);

}  // namespace hermesh
