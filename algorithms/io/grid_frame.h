// The lattice of a volume that is there already, for another volume to share. Heavy (OpenVDB): include it
// from .cpp files.
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

/// The frame of a transform. @throws Error for one in which a distance would depend on its direction (scaled
/// differently along different axes, sheared, perspective), and for one that mirrors.
GridFrame grid_frame(const openvdb::math::Transform& transform);

/// The frame of the first float grid in the file. @throws Error as grid_frame(), and if the file cannot be
/// read or holds none.
GridFrame read_grid_frame(const std::filesystem::path& path);

/// A mesh in the coordinates of a frame, near their zero.
struct FramedMesh {
  PolygonMesh mesh;          ///< sample (i, j, k) lies at voxel_size · ((i, j, k) − first)
  std::array<int, 3> first;  ///< multiples of 4096, which keep the coordinates small
};

/// The mesh turned and moved into the frame, its attributes as they are.
FramedMesh into_frame(const PolygonMesh& mesh, const GridFrame& frame);

/// Gives grids that were made from a framed mesh the frame's index coordinates and transform, and closest
/// points their place in the world.
void out_of_frame(const std::vector<openvdb::GridBase::Ptr>& grids, const GridFrame& frame,
                  const std::array<int, 3>& first);

}  // namespace hermesh
