#include "validation/free_cells.h"

#include <algorithm>
#include <cmath>

namespace hermesh::validation {
namespace {

constexpr int kCells = 128;

}  // namespace

FreeCells::FreeCells(const TriangleTree& tree) {
  const Box& box = tree.bounds();
  const Eigen::Vector3d size = box.upper - box.lower;
  cell_ = size.maxCoeff() / kCells;
  // Two layers of cells about the box: triangles in its sides block the first, and in the second the flood
  // begins.
  lower_ = box.lower - Eigen::Vector3d::Constant(2.0 * cell_);
  for (int axis = 0; axis < 3; ++axis) size_[axis] = 5 + int(size[axis] / cell_);
  state_.assign(std::size_t(size_.x()) * std::size_t(size_.y()) * std::size_t(size_.z()), kUnseen);
  for (std::size_t slot = 0; slot < tree.size(); ++slot) block(tree.corners(slot));
  flood();
}

Eigen::Vector3i FreeCells::cell_of(const Eigen::Vector3d& point) const {
  Eigen::Vector3i at;
  for (int axis = 0; axis < 3; ++axis)
    at[axis] = std::clamp(int(std::floor((point[axis] - lower_[axis]) / cell_)), 0, size_[axis] - 1);
  return at;
}

void FreeCells::block(const Corners& t) {
  const Box box = box_of(t);
  // Rounding must not push a part of the triangle out of the cells that its box names.
  const Eigen::Vector3d slack = Eigen::Vector3d::Constant(1e-6 * cell_);
  const Eigen::Vector3i first = cell_of(box.lower - slack), last = cell_of(box.upper + slack);
  if ((last - first).maxCoeff() <= 1) {
    for (int x = first.x(); x <= last.x(); ++x)
      for (int y = first.y(); y <= last.y(); ++y)
        for (int z = first.z(); z <= last.z(); ++z) state_[index({x, y, z})] = kBlocked;
    return;
  }
  int longest = 0;
  for (int k = 1; k < 3; ++k)
    if ((t[(k + 1) % 3] - t[k]).squaredNorm() > (t[(longest + 1) % 3] - t[longest]).squaredNorm())
      longest = k;
  const Eigen::Vector3d &a = t[longest], &b = t[(longest + 1) % 3], &c = t[(longest + 2) % 3];
  const Eigen::Vector3d middle = 0.5 * (a + b);
  block({a, middle, c});
  block({middle, b, c});
}

void FreeCells::flood() {
  std::vector<Eigen::Vector3i> stack{Eigen::Vector3i::Zero()};
  state_[0] = kFree;
  while (!stack.empty()) {
    const Eigen::Vector3i at = stack.back();
    stack.pop_back();
    for (int axis = 0; axis < 3; ++axis)
      for (int step : {-1, 1}) {
        Eigen::Vector3i next = at;
        next[axis] += step;
        if (next[axis] < 0 || next[axis] >= size_[axis] || state_[index(next)] != kUnseen) continue;
        state_[index(next)] = kFree;
        stack.push_back(next);
      }
  }
}

}  // namespace hermesh::validation
