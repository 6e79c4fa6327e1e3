#include "algorithms/extraction/embedded_mesh/tetrahedron_corners.h"

#include <algorithm>
#include <cmath>

namespace hermesh {

void TetrahedronCorners::move(const std::vector<std::vector<PointTarget>>& targets) {
  targets_ = &targets;
  for (std::size_t b = 0; b < targets.size(); ++b) {
    const auto block = static_cast<std::int32_t>(b);
    for (const PointTarget& target : targets[b]) {
      const Eigen::Vector3d from_plane = target.place - target.place.array().round().matrix();
      if (from_plane.cwiseAbs().minCoeff() > cells_.margin()) continue;
      has_moved_[b] = 1;
      for (const std::int32_t there : cells_.source(block).neighbours)
        if (there >= 0) has_moved_[there] = 1;
      for (int i = 0; i < 8; ++i) {
        const std::array<int, 3> step = corner_offset(i);
        const CellBlocks::Cell sample =
            cells_.locate(block, (target.cell >> 6) + step[0], ((target.cell >> 3) & 7) + step[1],
                          (target.cell & 7) + step[2]);
        if (sample.block >= 0) set_bit(near_face_.at(sample.block), sample.cell);
      }
    }
  }
}

Eigen::Vector3d TetrahedronCorners::at(std::int32_t block, int x, int y, int z) const {
  const Eigen::Vector3d corner = cells_.corner(block, 0) + Eigen::Vector3d(x, y, z);
  if (!has_moved(block)) return corner;
  // Samples outside of all blocks are not marked: nothing about them is known.
  const CellBlocks::Cell sample = cells_.locate(block, x, y, z);
  if (sample.block >= 0 && !test(near_face_[sample.block], sample.cell)) return corner;
  std::array<CellBlocks::Cell, 8> around;
  Eigen::Vector3i away = Eigen::Vector3i::Zero();
  for (int i = 0; i < 8; ++i) {
    const std::array<int, 3> step = corner_offset(i);
    CellBlocks::Cell& cell = around[i];
    cell = cells_.locate(block, x - step[0], y - step[1], z - step[2]);
    if (cell.block < 0) continue;
    const std::vector<PointTarget>& list = (*targets_)[cell.block];
    const auto target = std::ranges::lower_bound(list, cell.cell, {}, &PointTarget::cell);
    if (target == list.end() || target->cell != cell.cell) continue;
    for (int a = 0; a < 3; ++a)
      if (std::abs(target->place[a] - corner[a]) <= cells_.margin()) away[a] += step[a] ? 1 : -1;
  }
  if (away.isZero()) return corner;
  for (const CellBlocks::Cell& cell : around)
    if (cell.block >= 0 && test(cells_[cell.block].active, cell.cell) &&
        cells_.has_explicit_face(cell.block, cell.cell))
      return corner;
  return corner + cells_.margin() / 8.0 * away.cwiseSign().cast<double>();
}

TetrahedronCorners::Ends TetrahedronCorners::ends(const CellBlocks::Edge& edge) const {
  if (!has_moved(edge.block))
    return {cells_.corner(edge.block, edge.sample), Eigen::Vector3d::Unit(edge.axis)};
  int at[3] = {edge.sample >> 6, (edge.sample >> 3) & 7, edge.sample & 7};
  const Eigen::Vector3d start = this->at(edge.block, at[0], at[1], at[2]);
  ++at[edge.axis];
  return {start, this->at(edge.block, at[0], at[1], at[2]) - start};
}

}  // namespace hermesh
