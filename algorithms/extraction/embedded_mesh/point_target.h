// Preferred positions of vertices.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace hermesh {

/// The preferred position, outside the cell or nearer to its faces than CellBlocks::margin(), of the vertex
/// of a cell of one sheet or of a joint.
struct PointTarget {
  int cell;
  Eigen::Vector3d place;
  Eigen::Vector3d nearer;  ///< as near to the planes, but nearer to the vertex's position within the cell
};

/// A vertex of a finished mesh just before its target, which lies on a polygon of its own: where all corners
/// of a quad are on one crease, no position on that leaves it an area.
struct MissedTarget {
  std::uint32_t point;
  Eigen::Vector3d place;
};

}  // namespace hermesh
