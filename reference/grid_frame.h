// Where the points of a mesh made from a grid are centred. Heavy (OpenVDB): for .cpp files.
#pragma once

#include <openvdb/openvdb.h>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// A grid's placement cut in two: its transform maps voxel coordinates to world units relative to `origin`.
/// Points computed with it keep single precision's full relative accuracy however far from zero the grid
/// stands.
struct GridFrame {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  openvdb::math::Transform::Ptr transform;
};

/// Origin by choose_origin() of the box of the grid's active voxels.
GridFrame grid_frame(const openvdb::FloatGrid& grid);

}  // namespace hermesh
