#include "algorithms/hermite/solids.h"

#include <openvdb/tools/Composite.h>

#include <algorithm>
#include <bit>
#include <limits>

#include "algorithms/core/error.h"
#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/number_text.h"
#include "algorithms/hermite/combine.h"
#include "algorithms/io/grid_frame.h"
#include "algorithms/lattice/grid_placement.h"

namespace hermesh {
namespace {

/// Returns a copy of the grid in which zeros are replaced by the least positive number. A sample at 0 is
/// outside, so it has to be inside of the complement, and mere negation would leave it outside.
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

constexpr double kSliverRounding = 1e-3;  // voxels

/// A part of an edge that the combination loses; none if the length is negative.
struct Sliver {
  double length, middle;  ///< along the edge
};

/// Returns the part between the crossings of an edge whose first sample is in one operand and not in the
/// other: [offset of the one that ends, offset of the one that begins] is inside neither, and the reverse
/// both.
Sliver between(bool unites, double ends, double begins) {
  return {unites ? begins - ends : ends - begins, 0.5 * (ends + begins)};
}

class SliverCounter {
 public:
  SliverCounter(Boolean boolean, const FloatHermite& a, const FloatHermite& b)
      : unites_(boolean == Boolean::unite), turns_b_(boolean == Boolean::subtract), a_(a), b_(b) {}

  LostSlivers run() {
    // Only an edge that both operands cross can lose a part; both sequences of leaves ascend.
    std::size_t j = 0;
    for (std::size_t i = 0; i < a_.leaves.size(); ++i) {
      while (j < b_.leaves.size() && b_.leaves[j].lower < a_.leaves[i].lower) ++j;
      if (j == b_.leaves.size()) break;
      if (b_.leaves[j].lower == a_.leaves[i].lower) add(i, j);
    }
    // Each lattice line represents a square of one voxel, so lengths along an axis add up to a volume. A
    // sliver is measured best along its thin direction, the axis with the largest sum.
    result_.volume = *std::ranges::max_element(along_axis_);
    return result_;
  }

 private:
  void add(std::size_t i, std::size_t j) {
    const SignLeaf &leaf_a = a_.leaves[i], &leaf_b = b_.leaves[j];
    const std::array<BlockMask, 3> edges_a = crossing_edges(leaf_a), edges_b = crossing_edges(leaf_b);
    const EdgeCrossing *of_a = a_.crossings_of(i).data(), *of_b = b_.crossings_of(j).data();
    for (int axis = 0; axis < 3; ++axis) {
      for (int x = 0; x < 8; ++x) {
        // Edges that both cross with different signs at the first sample. For a difference the second one is
        // complemented.
        const std::uint64_t turned = turns_b_ ? ~std::uint64_t{0} : 0;
        std::uint64_t both =
            edges_a[axis][x] & edges_b[axis][x] & (leaf_a.inside[x] ^ leaf_b.inside[x] ^ turned);
        for (; both != 0; both &= both - 1) {
          const int sample = 64 * x + std::countr_zero(both);
          const double at_a = of_a[rank_in(edges_a[axis], sample)].offset;
          const double at_b = of_b[rank_in(edges_b[axis], sample)].offset;
          const Sliver sliver =
              test(leaf_a.inside, sample) ? between(unites_, at_a, at_b) : between(unites_, at_b, at_a);
          if (sliver.length > kSliverRounding) add(leaf_a, axis, sample, sliver);
        }
      }
      of_a += count(edges_a[axis]);
      of_b += count(edges_b[axis]);
    }
  }

  void add(const SignLeaf& leaf, int axis, int sample, const Sliver& sliver) {
    ++result_.edges;
    along_axis_[static_cast<std::size_t>(axis)] += sliver.length;
    if (sliver.length <= result_.longest) return;
    result_.longest = sliver.length;
    Eigen::Vector3d index(sample >> 6, (sample >> 3) & 7, sample & 7);
    index[axis] += sliver.middle;
    for (int i = 0; i < 3; ++i) index[i] += leaf.lower[i] - a_.placement.base[i];
    result_.place = a_.placement.origin + a_.placement.local(index);
  }

  const bool unites_, turns_b_;
  const FloatHermite &a_, &b_;
  LostSlivers result_;
  std::array<double, 3> along_axis_{};
};

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
  both.add(bounds(b));
  return {voxel_size, choose_origin(both)};
}

SampledSolid sample_solid(const PolygonMesh& mesh, const SharedLattice& lattice, const SampleMesh& sample) {
  // The frame is a lattice without rotation; the mesh is voxelized near its zero, and the result moved back
  // by whole blocks.
  const GridFrame frame{lattice.voxel_size, Eigen::Matrix3d::Identity(), lattice.origin};
  FramedMesh framed = into_frame(mesh, frame);
  // The lattice is unchanged, and messages name positions in the world.
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
  // Crossings are relative to their leaves, and `first` is a multiple of 8.
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
  // Values and Hermite data follow the same rule of signs, so that both have the same crossing edges.
  result.hermite = combine(boolean, a.hermite, b.hermite, context);
  result.hermite.placement = placement_of(*result.level_set.grid().grid);
  return result;
}

LostSlivers lost_slivers(Boolean boolean, const FloatHermite& a, const FloatHermite& b) {
  return SliverCounter(boolean, a, b).run();
}

std::string lost_slivers_note(const LostSlivers& lost, Boolean boolean, double voxel_size) {
  const double volume = lost.volume * voxel_size * voxel_size * voxel_size;
  return std::to_string(lost.edges) + " lattice edges pass through " +
         (boolean == Boolean::unite ? "gaps that hold no sample: they were closed"
                                    : "parts that hold no sample: they were lost") +
         ", a volume of about " + text(volume) + ", the thickest of them " + text(lost.longest * voxel_size) +
         " at " + text(lost.place) + "; smaller voxels keep more";
}

}  // namespace hermesh
