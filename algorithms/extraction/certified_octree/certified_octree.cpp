#include "algorithms/extraction/certified_octree/certified_octree.h"

#include "algorithms/core/option_table.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/certified_mesh.h"
#include "algorithms/extraction/certified_octree/region_mesh.h"

namespace hermesh {
namespace {

CellTolerances cell_tolerances(const CellBlocks& cells, const FieldAtPoints& field, double tolerance,
                               const RunContext& context) {
  if (field.is_constant()) return CellTolerances(static_cast<float>(tolerance));
  std::vector<float> result(cells.cell_count());
  parallel_blocks(cells.size(), context, [&](std::size_t b) {
    const auto block = static_cast<std::int32_t>(b);
    for_each_bit(cells[block].active, [&](int cell) {
      result[cells.cell_number(block, cell)] =
          field.tolerance(cells.corner(block, cell) + Eigen::Vector3d::Constant(0.5), tolerance);
    });
  });
  return CellTolerances(std::move(result));
}

CertifiedPolygons by_regions(const HermiteView& grid, const CertifiedOctreeOptions& options,
                             const FieldAtPoints& field, const FilePoints& file, RunContext& context) {
  UniformCells uniform(grid, options.uniform, file, context);
  const RegionOptions asked{cell_tolerances(uniform.cells(), field, options.tolerance, context),
                            options.flatness, options.largest_cube};
  // Caps may keep a mean outside of the hull of crossings whose samples were mirrored and rounded
  // (volume_ends.h).
  const Bounds& caps = options.uniform.caps;
  const bool has_caps = caps.lower.array().isFinite().any() || caps.upper.array().isFinite().any();
  const bool in_hulls = options.uniform.placement == DualContouringOptions::Placement::average && !has_caps;
  RegionMesh merged = merge_regions(uniform, in_hulls, asked, file, context);
  report(uniform.counts(), context);
  CertifiedPolygons result{
      std::move(merged.points), std::move(merged.triangles), std::move(merged.quads), {}};
  if (field.leaves_out_outside())
    // All cells of a cube have a tolerance, and so are in the mask.
    show(result, [&](std::size_t, int, std::uint32_t point) { return merged.of_cube[point] != 0; });
  return result;
}

}  // namespace

PolygonMesh certified_octree(const HermiteView& grid, const CertifiedOctreeOptions& given,
                             const AdaptivityField* field, RunContext& context) {
  CertifiedOctreeOptions options = given;
  options.uniform.reach = 0;
  const FilePoints file(grid.placement(), options.uniform.caps);
  const FieldAtPoints at_points(field, grid.placement());
  if (options.tolerance > 0 || at_points.simplifies())
    return finished(by_regions(grid, options, at_points, file, context), at_points, file, context);
  UniformMesh uniform = uniform_mesh(grid, options.uniform, file, context);
  report(uniform.counts, context);
  return finished(as_they_are(std::move(uniform)), at_points, file, context);
}

namespace {

/// The options of the octree in addition to those of all certified extractors.
const OptionTable<CertifiedOctreeOptions>& octree_option_table() {
  using Options = CertifiedOctreeOptions;
  static const auto table =
      OptionTable<Options>()
          .number("flatness", &Options::flatness, {.maximum = 1e6},
                  "how far a cube's point may be from the planes of its crossings, in voxels, root mean "
                  "square, if "
                  "tolerance allows more; 0 for what tolerance allows")
          .choice(
              "largest_cube", &Options::largest_cube, {{"8", 8}, {"4", 4}, {"2", 2}},
              "cells a side of the largest cubes; where flatness is below 0.2 or so, 4 is as fast as 8, and "
              "nearer");
  return table;
}

}  // namespace

PolygonMesh certified_octree(const ExtractionInput& input) {
  CertifiedOctreeOptions options = octree_option_table().read(input.options);
  options.uniform = read_placement_options(input);
  return contour_certified(input, "certified-octree", options.uniform.needs_normals(),
                           [&](const HermiteView& grid, double tolerance) {
                             options.tolerance = tolerance;
                             return certified_octree(grid, options, input.field, input.context);
                           });
}

std::vector<OptionSpec> certified_octree_options() {
  std::vector<OptionSpec> options = tolerance_options();
  for (OptionSpec& option : octree_option_table().specs()) options.push_back(std::move(option));
  for (OptionSpec& option : dual_contouring_options())
    if (option.name != "reach") options.push_back(std::move(option));
  return options;
}

}  // namespace hermesh
