// The checks and properties of a grid that the references require before they mesh it. Heavy (OpenVDB): for
// .cpp files.
#pragma once

#include "algorithms/core/openvdb_trees.h"
#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// A grid's placement in two parts, a translation and a transform, and which side of the isovalue is inside.
/// The transform maps voxel coordinates to world units relative to `origin`, so that points computed with it
/// keep single precision's full relative accuracy however far from zero the grid stands.
struct MeshingFrame {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< choose_origin() of the box of the active voxels
  openvdb::math::Transform::Ptr transform;
  /// True if samples above the isovalue are inside. As for our own extractors, inside is below the isovalue
  /// except in a volume that is not a level set and whose background is below the isovalue, such as fog.
  bool inside_is_above = false;
};

/// Returns the frame of a grid. @throws Error for an isovalue, a background or a value in a leaf that is not
/// finite
MeshingFrame meshing_frame(const openvdb::FloatGrid& grid, double isovalue);

}  // namespace hermesh
