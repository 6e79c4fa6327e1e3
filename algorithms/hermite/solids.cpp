#include "algorithms/hermite/solids.h"

#include <openvdb/tools/Composite.h>

#include <limits>

#include "algorithms/core/error.h"
#include "algorithms/core/level_set_grid.h"
#include "algorithms/hermite/combine.h"
#include "algorithms/io/grid_frame.h"
#include "algorithms/lattice/grid_placement.h"

namespace hermesh {
namespace {

/// A copy of a grid with the least positive number in place of zeros. A sample at 0 is outside, and so has to
/// be in the inside of the complement, which negation alone would deny it.
openvdb::FloatGrid::Ptr without_zeros(const openvdb::FloatGrid& grid) {
  const openvdb::FloatGrid::Ptr result = grid.deepCopy();
  for (auto value = result->beginValueAll(); value; ++value)
    if (*value == 0.0f) value.setValue(std::numeric_limits<float>::min());
  return result;
}

openvdb::FloatGrid::Ptr combined_values(Boolean boolean, const openvdb::FloatGrid& a,
                                        const openvdb::FloatGrid& b) {
  switch (boolean) {
    case Boolean::unite:
      return openvdb::tools::csgUnionCopy(a, b);
    case Boolean::intersect:
      return openvdb::tools::csgIntersectionCopy(a, b);
    case Boolean::subtract:
      break;
  }
  return openvdb::tools::csgDifferenceCopy(a, *without_zeros(b));
}

}  // namespace

std::string missed_edges_note(const PolygonSampling& sampling) {
  const std::size_t missed = sampling.nearest + sampling.fallback;
  if (missed == 0) return {};
  return std::to_string(missed) + " of " + std::to_string(sampling.exact + missed) +
         " crossing edges hit no polygon: " + std::to_string(sampling.nearest) +
         " took the nearest one's plane, the others the level set's gradient";
}

SharedLattice shared_lattice(const PolygonMesh& a, const PolygonMesh& b, double voxel_size) {
  Bounds both = bounds(a);
  const Bounds other = bounds(b);
  // Minimum and maximum do not ask which mesh comes first.
  both.lower = both.lower.cwiseMin(other.lower);
  both.upper = both.upper.cwiseMax(other.upper);
  return {voxel_size, choose_origin(both)};
}

SampledSolid sample_solid(const PolygonMesh& mesh, const SharedLattice& lattice, const SampleMesh& sample) {
  // The frame is a lattice without rotation; the mesh is voxelized near its zero, and what comes of it is
  // moved back by whole blocks.
  const GridFrame frame{lattice.voxel_size, Eigen::Matrix3d::Identity(), lattice.origin};
  FramedMesh framed = into_frame(mesh, frame);
  // The lattice stays where it is, and what is said of places is said of the world's.
  framed.mesh.origin = lattice.origin + lattice.voxel_size * Eigen::Vector3d(framed.first[0], framed.first[1],
                                                                             framed.first[2]);
  SampledSolid solid = sample(framed.mesh);
  if (solid.hermite.leaves.empty())
    throw Error(
        "it has no inside at this size of voxel: its polygons enclose nothing, or only what is thinner than "
        "a "
        "voxel, so that it cannot be combined");
  const openvdb::FloatGrid::Ptr grid = solid.level_set.grid().grid->deepCopy();
  out_of_frame({grid}, frame, framed.first);
  solid.level_set = make_level_set(grid);
  // Crossings are relative to their leaves. Blocks lie at multiples of 8, and `first` is a multiple of more.
  for (SignLeaf& leaf : solid.hermite.leaves)
    for (std::size_t axis = 0; axis < 3; ++axis) leaf.lower[axis] += framed.first[axis];
  solid.hermite.placement = placement_of(*grid);
  return solid;
}

CombinedSolid combine(Boolean boolean, const SampledSolid& a, const SampledSolid& b, RunContext& context) {
  CombinedSolid result;
  {
    const Stage stage(context, "combine level sets");
    const openvdb::FloatGrid::Ptr grid =
        combined_values(boolean, *a.level_set.grid().grid, *b.level_set.grid().grid);
    grid->setName("sdf");
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    result.level_set = make_level_set(grid);
  }
  // Signs of values and of Hermite data follow the same rule, sample by sample, so that both have the same
  // crossing edges.
  result.hermite = combine(boolean, a.hermite, b.hermite, context);
  result.hermite.placement = placement_of(*result.level_set.grid().grid);
  return result;
}

}  // namespace hermesh
