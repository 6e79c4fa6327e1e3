#include <Eigen/Geometry>

#include "algorithms/voxelization/distance/kernels/kernels.h"

namespace hermesh::kernels {
namespace {

void put(Batch& batch, int row, int lane, const Eigen::Vector3d& v) {
  for (int axis = 0; axis < 3; ++axis) batch.f[row + axis][lane] = float(v[axis]);
}

}  // namespace

void set_up_segment(const Corners& corners, int triangle, Batch& batch) {
  Eigen::Vector3d corner[3];
  for (int i = 0; i < 3; ++i)
    for (int axis = 0; axis < 3; ++axis) corner[i][axis] = corners.corner[3 * i + axis][triangle];
  int longest = 0;
  const auto side = [&](int i) -> Eigen::Vector3d { return corner[(i + 1) % 3] - corner[i]; };
  for (int i = 1; i < 3; ++i)
    if (side(i).squaredNorm() > side(longest).squaredNorm()) longest = i;
  const Eigen::Vector3d& start = corner[longest];
  const double length = side(longest).norm();
  const Eigen::Vector3d along =
      length > 0 ? Eigen::Vector3d(side(longest) / length) : Eigen::Vector3d(Eigen::Vector3d::UnitX());
  const Eigen::Vector3d normal = along.unitOrthogonal(), across = along.cross(normal);
  put(batch, Batch::kHeight, triangle, normal);
  batch.f[Batch::kHeight + 3][triangle] = float(-normal.dot(start));
  for (int i = 0; i < 3; ++i) {
    const int edge = Batch::kEdge + Batch::kPerEdge * i;
    const double turn = i == 2 ? -1.0 : 1.0;
    put(batch, edge, triangle, turn * across);
    batch.f[edge + 3][triangle] = float(-turn * across.dot(start));
    put(batch, edge + Batch::kAlong, triangle, along);
    batch.f[edge + Batch::kLow][triangle] = float(along.dot(start));
    batch.f[edge + Batch::kHigh][triangle] = float(along.dot(start) + length);
  }
}

}  // namespace hermesh::kernels
