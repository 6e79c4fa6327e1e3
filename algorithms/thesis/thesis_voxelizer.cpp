#include "algorithms/thesis/thesis_voxelizer.h"

#include <openvdb/tools/SignedFloodFill.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <utility>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/lattice/memory_estimate.h"
#include "algorithms/core/parallel.h"
#include "algorithms/thesis/thesis_stages.h"

namespace hermesh {
namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;

/// Shuffles by Fisher & Yates, spelled out because std::shuffle gives another order on another standard library.
void shuffle(std::vector<Triangle>& triangles, std::uint64_t seed, const RunContext& context) {
  std::mt19937_64 random(seed);
  for (std::size_t i = triangles.size(); i > 1; --i) {
    if (i % 65536 == 0) context.check();
    std::swap(triangles[i - 1], triangles[random() % i]);
  }
}

/// Stage 1 of §5.1: triangles in the grid's local space, whose unit is a voxel and whose origin the mesh's.
thesis::Triangles local_copy(const VoxelizationInput& input, std::uint64_t shuffle_seed) {
  const Stage stage(input.context, "local copy");
  thesis::Triangles result;
  result.points.reserve(input.mesh.points.size());
  for (const Eigen::Vector3f& point : input.mesh.points)
    result.points.push_back(point.cast<double>() / input.voxel_size);
  result.corners = triangulated(input.mesh);
  if (shuffle_seed != 0) shuffle(result.corners, shuffle_seed, input.context);
  return result;
}

/// Widths of the band on either side, in voxels.
struct Widths {
  double exterior, interior;
};

/// A leaf of the band's distances with their signs, or null when no voxel is within its side's band. Inactive values
/// are for signedFloodFill to set.
std::unique_ptr<Leaf> make_leaf(const thesis::BandBlock& block, const Widths& widths, double voxel_size) {
  auto leaf = std::make_unique<Leaf>(openvdb::Coord(block.lower[0], block.lower[1], block.lower[2]),
                                     float(widths.exterior * voxel_size));
  for_each_bit(block.set, [&](int sample) {
    const bool outside = test(block.outside, sample);
    // Until here distances are squared, in voxels, and have no sign; the thesis stores negative ones.
    const double distance = std::sqrt(double(block.squared_distance[sample]));
    if (!(distance < (outside ? widths.exterior : widths.interior))) return;
    leaf->setValueOn(openvdb::Index(sample), float((outside ? distance : -distance) * voxel_size));
  });
  return leaf->isEmpty() ? nullptr : std::move(leaf);
}

/// The grid in world units. It frees the band block by block, so that the two are never whole at a time.
openvdb::FloatGrid::Ptr make_grid(thesis::Band& band, const Widths& widths, const VoxelizationInput& input) {
  const Stage stage(input.context, "level set");
  const auto outside = float(widths.exterior * input.voxel_size),
             inside = float(-widths.interior * input.voxel_size);
  const openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(outside);
  std::vector<std::unique_ptr<Leaf>> leaves(band.size());
  parallel_blocks(leaves.size(), input.context, [&](std::size_t i) {
    leaves[i] = make_leaf(band.block(std::int32_t(i)), widths, input.voxel_size);
    // Each block is one thread's; leaves are handed to the tree by one thread, in the order of the blocks.
    band.release(std::int32_t(i));
  });
  for (std::unique_ptr<Leaf>& leaf : leaves)
    if (leaf) grid->tree().addLeaf(leaf.release());
  input.context.check();
  openvdb::tools::signedFloodFillWithValues(grid->tree(), outside, inside);

  // Voxel (0, 0, 0) is at the mesh's origin, as in the local copy of the points.
  const auto transform = openvdb::math::Transform::createLinearTransform(input.voxel_size);
  const Eigen::Vector3d& origin = input.mesh.origin;
  transform->postTranslate(openvdb::Vec3d(origin.x(), origin.y(), origin.z()));
  grid->setTransform(transform);
  grid->setName("sdf");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return grid;
}

/// Whether more than a hundredth of the voxels is inside. A closed mesh has about as many inside as outside; of an
/// open mesh a few remain.
bool has_inside(const thesis::Band& band) {
  std::size_t set = 0, outside = 0;
  for (std::int32_t i = 0; i < band.size(); ++i) {
    set += std::size_t(count(band.block(i).set));
    outside += std::size_t(count(band.block(i).outside));
  }
  return 100 * (set - outside) > set;
}

}  // namespace

LevelSet thesis_voxelizer(const VoxelizationInput& input, const ThesisVoxelizerOptions& options) {
  check_voxelization_fits(input.mesh, input.voxel_size, input.exterior_band, input.interior_band);
  // A negation, so that an angle that is no number is refused, too.
  if (!(options.sign_angle > 0.0 && options.sign_angle <= 180.0))
    throw Error("The sign angle must be above 0 and at most 180 degrees, not " +
                std::to_string(options.sign_angle) + ".");
  initialize_openvdb();
  const thesis::Triangles triangles = local_copy(input, options.shuffle_seed);
  // The stages 2 to 5 of §5.1 in their order; stage 6, fog, is for whoever has the level set.
  thesis::Band band = thesis::rasterize(triangles, input.context);
  thesis::determine_signs(band, triangles, options.sign_angle, input.context);
  thesis::remove_unwanted_voxels(band, input.context);
  thesis::expand(band, triangles, input.exterior_band, input.interior_band, input.context);
  if (!has_inside(band))
    input.context.note(
        "The level set has next to no inside: the thesis's voxelizer needs a closed mesh, thicker than a "
        "voxel.");
  return make_level_set(make_grid(band, {input.exterior_band, input.interior_band}, input));
}

}  // namespace hermesh
