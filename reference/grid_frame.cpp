#include "reference/grid_frame.h"

namespace hermesh {

GridFrame grid_frame(const openvdb::FloatGrid& grid) {
  GridFrame frame;
  frame.transform = grid.transform().copy();
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  if (box.empty()) return frame;
  const openvdb::BBoxd world = grid.transform().indexToWorld(box);
  Bounds bounds;
  bounds.add(Eigen::Vector3d(world.min().x(), world.min().y(), world.min().z()));
  bounds.add(Eigen::Vector3d(world.max().x(), world.max().y(), world.max().z()));
  frame.origin = choose_origin(bounds);
  frame.transform->postTranslate(-openvdb::Vec3d(frame.origin.x(), frame.origin.y(), frame.origin.z()));
  return frame;
}

}  // namespace hermesh
