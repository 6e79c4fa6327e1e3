#include "algorithms/thesis/thesis_voxelizer.h"

#include <openvdb/tools/SignedFloodFill.h>

#include <cmath>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <utility>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/option_table.h"
#include "algorithms/core/parallel.h"
#include "algorithms/lattice/grid_placement.h"
#include "algorithms/lattice/memory_estimate.h"
#include "algorithms/thesis/thesis_band.h"
#include "algorithms/thesis/thesis_volumes.h"

namespace hermesh {
namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;
using IdLeaf = openvdb::Int32Tree::LeafNodeType;

/// Maps the numbers of triangles in the local copy to those in the mesh.
struct Numbers {
  std::vector<std::uint32_t> shuffled;  ///< empty if both are the same
  std::int32_t operator()(std::uint32_t id) const {
    return std::int32_t(shuffled.empty() ? id : shuffled[id]);
  }
};

/// Returns numbers from 0 on, shuffled by Fisher & Yates; std::shuffle gives another order on another
/// standard library.
std::vector<std::uint32_t> shuffled(std::size_t count, std::uint64_t seed, const RunContext& context) {
  std::vector<std::uint32_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0u);
  std::mt19937_64 random(seed);
  for (std::size_t i = count; i > 1; --i) {
    if (i % 65536 == 0) context.check();
    std::swap(numbers[i - 1], numbers[random() % i]);
  }
  return numbers;
}

/// Stage 1 of §5.1: triangles in the grid's local space, whose unit is a voxel and whose origin the mesh's.
/// `numbers` are those of the mesh in the order of the triangles, empty for the mesh's own order.
thesis::Triangles local_copy(const VoxelizationInput& input, std::uint64_t shuffle_seed,
                             std::vector<std::uint32_t>& numbers) {
  const Stage stage(input.context, "local copy");
  thesis::Triangles result;
  result.points.reserve(input.mesh.points.size());
  for (const Eigen::Vector3f& point : input.mesh.points)
    result.points.push_back(point.cast<double>() / input.voxel_size);
  result.corners = triangulated(input.mesh);
  if (shuffle_seed == 0) return result;
  numbers = shuffled(result.corners.size(), shuffle_seed, input.context);
  std::vector<Triangle> corners;
  corners.reserve(numbers.size());
  for (const std::uint32_t number : numbers) corners.push_back(result.corners[number]);
  result.corners = std::move(corners);
  return result;
}

/// Widths of the band on either side, in voxels.
struct ThesisWidths {
  double exterior, interior;
};

/// The leaves of one block, both null if no voxel is within its side's band.
struct Leaves {
  std::unique_ptr<Leaf> distance;
  std::unique_ptr<IdLeaf> nearest;
};

/// Makes leaves of the band's distances with their signs and, with `numbers`, of their triangles. Inactive
/// values are left to signedFloodFill.
Leaves make_leaves(const thesis::BandBlock& block, const ThesisWidths& widths, double voxel_size,
                   const Numbers* numbers) {
  const openvdb::Coord lower(block.lower[0], block.lower[1], block.lower[2]);
  Leaves leaves{std::make_unique<Leaf>(lower, float(widths.exterior * voxel_size)),
                numbers ? std::make_unique<IdLeaf>(lower, -1) : nullptr};
  for_each_bit(block.set, [&](int sample) {
    const bool outside = test(block.outside, sample);
    // Until here distances are squared, in voxels, and unsigned.
    const double distance = std::sqrt(double(block.squared_distance[sample]));
    if (!(distance < (outside ? widths.exterior : widths.interior))) return;
    leaves.distance->setValueOn(openvdb::Index(sample), float((outside ? distance : -distance) * voxel_size));
    if (numbers) leaves.nearest->setValueOn(openvdb::Index(sample), (*numbers)(block.triangle[sample]));
  });
  if (leaves.distance->isEmpty()) return {};
  return leaves;
}

/// Sets the grid's name and its transform, which maps voxel (0, 0, 0) to the mesh's origin, as in the local
/// copy of the points.
void place(openvdb::GridBase& grid, const char* name, const VoxelizationInput& input) {
  grid.setTransform(transform_at(input.mesh.origin, input.voxel_size));
  grid.setName(name);
}

/// Makes the grids in world units. Frees the band block by block, so that both never exist completely at the
/// same time.
Voxelization make_grids(thesis::Band& band, const ThesisWidths& widths, const VoxelizationInput& input,
                        bool is_signed, const Numbers* numbers) {
  const Stage stage(input.context, "level set");
  const auto outside = float(widths.exterior * input.voxel_size),
             inside = float(-widths.interior * input.voxel_size);
  Voxelization result{openvdb::FloatGrid::create(outside), is_signed,
                      numbers ? openvdb::Int32Grid::create(-1) : nullptr};
  std::vector<Leaves> leaves(band.size());
  parallel_blocks(leaves.size(), input.context, [&](std::size_t i) {
    leaves[i] = make_leaves(band.block(std::int32_t(i)), widths, input.voxel_size, numbers);
    band.release(std::int32_t(i));
  });
  for (Leaves& leaf : leaves) {
    if (leaf.distance) result.distance->tree().addLeaf(leaf.distance.release());
    if (leaf.nearest) result.nearest->tree().addLeaf(leaf.nearest.release());
  }
  input.context.check();
  // Without signs the background lies beyond the band on either side.
  if (is_signed) openvdb::tools::signedFloodFillWithValues(result.distance->tree(), outside, inside);
  place(*result.distance, is_signed ? "sdf" : "udf", input);
  // Programs expect a level set to have signs.
  result.distance->setGridClass(is_signed ? openvdb::GRID_LEVEL_SET : openvdb::GRID_UNKNOWN);
  if (result.nearest) place(*result.nearest, "triangle-id", input);
  return result;
}

/// Makes all distances those of the outside, as before there are signs.
void forget_signs(thesis::Band& band) {
  for (std::int32_t i = 0; i < band.size(); ++i) band.block(i).outside = band.block(i).set;
}

/// Returns true if more than a hundredth of the voxels is inside. A closed mesh has about as many inside as
/// outside; an open mesh a few.
bool has_inside(const thesis::Band& band) {
  std::size_t set = 0, outside = 0;
  for (std::int32_t i = 0; i < band.size(); ++i) {
    set += std::size_t(count(band.block(i).set));
    outside += std::size_t(count(band.block(i).outside));
  }
  return 100 * (set - outside) > set;
}

const OptionTable<ThesisVoxelizerOptions>& option_table() {
  using Options = ThesisVoxelizerOptions;
  static const auto table =
      OptionTable<Options>()
          .number("sign_angle", &Options::sign_angle, {.minimum = 1e-6, .maximum = 180.0},
                  "degrees: a boundary voxel is outside below this angle to an outside neighbour's vector; "
                  "larger makes "
                  "more outside",
                  {"signs=flood-fill"})
          // A seed is an integer of up to 1e15, which a double represents exactly.
          .number("shuffle_seed", &Options::shuffle_seed, {.maximum = 1e15},
                  "takes the triangles in a random order with this seed; 0 in that of the mesh")
          .choice("signs", &Options::signs, {{"flood-fill", true}, {"unsigned", false}},
                  "stage 3: flood-fill from outside and angles (§5.3), or unsigned distances")
          .choice("clean_up", &Options::clean_up, {{"true", true}, {"false", false}},
                  "stage 4: whether voxels that self-intersections left inside are removed (§5.4)",
                  {"signs=flood-fill"})
          .choice("expansion", &Options::expansion, {{"true", true}, {"false", false}},
                  "stage 5: whether the band is expanded to its widths (§5.5); else it is about a voxel wide "
                  "to either "
                  "side, or less where less is asked for");
  return table;
}

}  // namespace

std::vector<OptionSpec> thesis_voxelizer_options() { return option_table().specs(); }

ThesisVoxelizerOptions thesis_voxelizer_options(const Options& options) {
  return option_table().read(options);
}

Voxelization thesis_voxelization(const VoxelizationInput& input, const ThesisVoxelizerOptions& options,
                                 bool nearest) {
  check_voxelization_fits(input.mesh, input.voxel_size, input.exterior_band, input.interior_band);
  // A negation, so that NaN is also rejected.
  if (!(options.sign_angle > 0.0 && options.sign_angle <= 180.0))
    throw Error("The sign angle must be above 0 and at most 180 degrees, not " +
                std::to_string(options.sign_angle) + ".");
  initialize_openvdb();
  Numbers numbers;
  const thesis::Triangles triangles = local_copy(input, options.shuffle_seed, numbers.shuffled);
  // Stages 2 to 5 of §5.1; stage 6, fog, is made from the level set.
  thesis::Band band = thesis::rasterize(triangles, input.context);
  ThesisWidths widths{input.exterior_band, input.interior_band};
  if (options.signs) {
    thesis::determine_signs(band, triangles, options.sign_angle, input.context);
    if (options.clean_up) thesis::remove_unwanted_voxels(band, input.context);
  } else {
    forget_signs(band);
    widths.interior = widths.exterior;
  }
  if (options.expansion) thesis::expand(band, triangles, widths.exterior, widths.interior, input.context);
  if (options.signs && !has_inside(band))
    input.context.note(
        "The level set has next to no inside: the thesis's voxelizer needs a closed mesh, thicker than a "
        "voxel.");
  return make_grids(band, widths, input, options.signs, nearest ? &numbers : nullptr);
}

LevelSet thesis_voxelizer(const VoxelizationInput& input, const ThesisVoxelizerOptions& options) {
  return make_level_set(thesis_voxelization(input, options, false).distance);
}

}  // namespace hermesh
