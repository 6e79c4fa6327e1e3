// What the references ask of a grid before they mesh it. Heavy (OpenVDB): for .cpp files.
#pragma once

#include <openvdb/openvdb.h>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// A grid's placement cut in two, and its inside. The transform maps voxel coordinates to world units
/// relative to `origin`, so that points computed with it keep single precision's full relative accuracy
/// however far from zero the grid stands.
struct MeshingFrame {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< choose_origin() of the box of the active voxels
  openvdb::math::Transform::Ptr transform;
  /// The same rule as for our own extractors: inside is below the isovalue, except in a volume that is no
  /// level set and whose background is below it, such as fog.
  bool inside_is_above = false;
};

/// @throws Error for an isovalue, a background or a value in a leaf that is not finite
MeshingFrame meshing_frame(const openvdb::FloatGrid& grid, double isovalue);

}  // namespace hermesh
