// The lattice of an existing volume, so that other volumes can share it. Heavy (OpenVDB): include it from
// .cpp files.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include "algorithms/core/openvdb_trees.h"
#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// Placement of a lattice. World position of sample (i, j, k): offset + voxel_size · rotation · (i, j, k).
struct GridFrame {
  double voxel_size = 1.0;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
};

/// Returns the frame of a transform. @throws Error if distances depend on the direction (different scales
/// along the axes, shear, perspective), or if it mirrors.
GridFrame grid_frame(const openvdb::math::Transform& transform);

/// Returns the frame of the first float grid in the file. @throws Error like grid_frame(), and if the file
/// cannot be read or has no float grid.
GridFrame read_grid_frame(const std::filesystem::path& path);

/// A mesh in the coordinates of a frame, near zero.
struct FramedMesh {
  PolygonMesh mesh;          ///< sample (i, j, k) lies at voxel_size · ((i, j, k) − first)
  std::array<int, 3> first;  ///< multiples of 4096, which keep the coordinates small
};

/// Returns the mesh rotated and moved into the frame, with unchanged attributes.
FramedMesh into_frame(const PolygonMesh& mesh, const GridFrame& frame);

/// Moves grids of a framed mesh to the frame's index coordinates and transform, and closest points to the
/// world.
void out_of_frame(const std::vector<openvdb::GridBase::Ptr>& grids, const GridFrame& frame,
                  const std::array<int, 3>& first);

}  // namespace hermesh
