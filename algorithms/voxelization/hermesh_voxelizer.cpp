#include "algorithms/voxelization/hermesh_voxelizer.h"

#include <openvdb/tools/SignedFloodFill.h>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/memory_estimate.h"
#include "algorithms/core/parallel.h"
#include "algorithms/voxelization/band.h"
#include "algorithms/voxelization/regions.h"

namespace hermesh {
namespace {

/// Widths of the band in world units.
struct Widths {
  float exterior, interior;
};

/// Bits of the voxels of block `i` that are not connected to infinity.
VoxelBits enclosed(const Regions& regions, std::size_t i) {
  VoxelBits bits{};
  for (std::uint32_t c = regions.first[i]; c < regions.first[i + 1]; ++c)
    if (regions.components[c].region != Regions::kOutside)
      for (std::size_t x = 0; x < 8; ++x) bits[x] |= regions.components[c].voxels[x];
  return bits;
}

void sign_leaf(FloatLeaf& leaf, const VoxelBits& inside, const Widths& widths, const kernels::Kernels& kernels) {
  FloatLeaf::NodeMaskType mask = leaf.getValueMask();
  kernels.apply_signs(inside.data(), widths.exterior, widths.interior, leaf.buffer().data(),
                      &mask.getWord<openvdb::Index64>(0));
  leaf.setValueMask(mask);
}

openvdb::FloatGrid::Ptr assemble(Band& band, const VoxelizationInput& input, const Widths& widths) {
  const auto grid = openvdb::FloatGrid::create(widths.exterior);
  for (std::unique_ptr<FloatLeaf>& leaf : band.leaves)
    if (leaf && !leaf->isEmpty()) grid->tree().addLeaf(leaf.release());
  // Leaves are signed already; what is left are the tiles.
  openvdb::tools::signedFloodFillWithValues(grid->tree(), widths.exterior, -widths.interior, true, 1, 1);
  const auto transform = openvdb::math::Transform::createLinearTransform(input.voxel_size);
  const Eigen::Vector3d& origin = input.mesh.origin;
  transform->postTranslate(openvdb::Vec3d(origin.x(), origin.y(), origin.z()));
  grid->setTransform(transform);
  grid->setName("sdf");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return grid;
}

}  // namespace

std::vector<OptionSpec> hermesh_voxelizer_options() {
  return {{.name = "signs",
           .fallback = "auto",
           .help = "inside is what infinity cannot reach, or what the polygons wind around; auto floods, and winds "
                   "where the flood leaks in",
           .choices = {"auto", "flood-fill", "winding-number", "unsigned"}}};
}

LevelSet hermesh_voxelizer(const VoxelizationInput& input) {
  check_voxelization_fits(input.mesh, input.voxel_size, input.exterior_band, input.interior_band);
  initialize_openvdb();
  RunContext& context = input.context;
  const Widths widths{float(input.exterior_band * input.voxel_size), float(input.interior_band * input.voxel_size)};
  const double reach = std::max(input.exterior_band, input.interior_band);
  const IndexSoup soup(input.mesh, input.voxel_size);
  const kernels::Kernels& kernels = kernels::chosen();

  std::optional<TriangleBins> bins;
  {
    const Stage stage(context, "triangles to blocks");
    bins.emplace(soup, reach, context);
  }
  Band band;
  {
    const Stage stage(context, "distances");
    band = compute_band(soup, *bins, reach, input.voxel_size, false, context);
  }
  {
    const Stage stage(context, "signs");
    const Regions regions = find_regions(bins->blocks(), band.crossed, context);
    parallel_blocks(band.leaves.size(), context, [&](std::size_t i) {
      if (band.leaves[i]) sign_leaf(*band.leaves[i], enclosed(regions, i), widths, kernels);
    });
  }
  const Stage stage(context, "tree");
  return make_level_set(assemble(band, input, widths));
}

}  // namespace hermesh
