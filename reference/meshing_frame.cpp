#include "reference/meshing_frame.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <cmath>

#include "algorithms/core/error.h"

namespace hermesh {
namespace {

void check_finite(const openvdb::FloatGrid& grid, double isovalue) {
  if (!std::isfinite(isovalue)) throw Error("The isovalue must be a finite number.");
  std::vector<const openvdb::FloatTree::LeafNodeType*> leaves;
  grid.tree().getNodes(leaves);
  std::atomic<bool> finite = std::isfinite(grid.background());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 64), [&](const auto& range) {
    bool all = true;
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const float* values = leaves[i]->buffer().data();
      for (openvdb::Index j = 0; j < openvdb::FloatTree::LeafNodeType::SIZE; ++j)
        all &= std::isfinite(values[j]);
    }
    if (!all) finite = false;
  });
  if (!finite) throw Error("The volume holds a value that is not finite: replace it before the extraction.");
}

}  // namespace

MeshingFrame meshing_frame(const openvdb::FloatGrid& grid, double isovalue) {
  check_finite(grid, isovalue);
  MeshingFrame frame;
  frame.transform = grid.transform().copy();
  frame.inside_is_above =
      grid.getGridClass() != openvdb::GRID_LEVEL_SET && double(grid.background()) < isovalue;
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
