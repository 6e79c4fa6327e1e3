// Preferred positions of vertices.
#pragma once

#include <Eigen/Core>

namespace hermesh {

/// The preferred position, outside the cell or nearer to its faces than CellBlocks::margin(), of the vertex
/// of a cell of one sheet or of a joint.
struct PointTarget {
  int cell;
  Eigen::Vector3d place;
  Eigen::Vector3d nearer;  ///< as near to the planes, but nearer to the vertex's position within the cell
};

}  // namespace hermesh
