#include "algorithms/extraction/certified_collapse/manifold_dual_contouring.h"

#include "algorithms/core/option_table.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/certified_collapse/certified_decimation.h"
#include "algorithms/extraction/certified_collapse/tile_mesh.h"
#include "algorithms/extraction/certified_mesh.h"
#include "algorithms/lattice/part_placement.h"

namespace hermesh {
namespace {

CertifiedPolygons by_collapses(UniformMesh uniform, const FieldAtPoints& field, double tolerance,
                               const Nearness& nearness, const FilePoints& file, RunContext& context) {
  const FineMesh fine(std::move(uniform.points),
                      all_triangles(std::move(uniform.triangles), std::exchange(uniform.quads, {})), context);
  std::vector<float> asked(fine.points().size());
  parallel_blocks(asked.size(), context,
                  [&](std::size_t i) { asked[i] = field.tolerance(fine.points()[i], tolerance); });
  CertifiedMesh coarse =
      decimate_certified(fine, asked, {}, file, context, nearness, {}, Bounds::unbounded(), uniform.missed);
  CertifiedPolygons result{std::move(coarse.points), std::move(coarse.triangles), {}, {}};
  if (field.leaves_out_outside())
    // Vertices that moved were merged; vertices in the mask have a tolerance.
    show(result, [&](std::size_t t, int corner, std::uint32_t point) {
      const std::uint32_t before = fine.triangles()[coarse.fine_triangle[t]][corner];
      return asked[before] > 0 && result.points[point] != fine.points()[before];
    });
  return result;
}

PolygonMesh by_tiles(const HermiteView& grid, const ManifoldDualContouringOptions& options,
                     const FilePoints& file, RunContext& context) {
  std::vector<VertexKey> keys;
  UniformMesh uniform = uniform_mesh(grid, options.uniform, file, context,
                                     {.side = options.tile, .whole = options.whole, .keys = &keys});
  report(uniform.counts, context);
  TilePatches patches(std::move(uniform), std::move(keys),
                      {.side = options.tile, .tolerance = options.tolerance, .nearness = options.nearness},
                      file, std::nullopt);
  std::vector<TileMesh> tiles;
  for (const TileAt& tile : patches.tiles()) tiles.push_back(patches.decimated(tile, context));
  return join_tiles(std::move(tiles), grid.placement().origin);
}

struct TileSide {
  int tile = 0;
};
const OptionTable<TileSide>& tile_option_table() {
  static const auto table = OptionTable<TileSide>().number(
      "tile", &TileSide::tile, {.maximum = 1 << 20},
      "side in voxels, a multiple of 8 from 16 on, of cubes that are decimated one by one, with the uniform "
      "mesh between them, so that remesh --tiles gives the same bytes; 0 for none");
  return table;
}

/// The options of the collapses in addition to those of all certified extractors.
const OptionTable<Nearness>& nearness_option_table() {
  static const auto table =
      OptionTable<Nearness>()
          .number(
              "moment", &Nearness::moment, {.maximum = 1e30},
              "greatest sum of squared distances to the planes of the triangles around, weighted by "
              "their areas, that the collapse of an edge may cost, in voxels^4: with a larger tolerance "
              "it gives triangles to where they lower the root mean square distance most; 0 for as few as "
              "the tolerance allows")
          .choice("relaxation", &Nearness::relaxation, {{"0", 0}, {"1", 1}, {"3", 3}, {"6", 6}},
                  "sweeps that move the points to where the root mean square distance to the uniform mesh is "
                  "least, as far as the tolerance and the freedom from self-intersection are proved; 3 get "
                  "most of it");
  return table;
}

}  // namespace

PolygonMesh manifold_dual_contouring(const HermiteView& grid, const ManifoldDualContouringOptions& options,
                                     const AdaptivityField* field, RunContext& context) {
  const FilePoints file(grid.placement(), options.uniform.caps);
  if (options.tile > 0 && field)
    throw Error("option 'tile' cannot be combined with a mask or a grid of tolerances; omit one of them");
  if (options.tile > 0) return by_tiles(grid, options, file, context);
  const FieldAtPoints at_points(field, grid.placement());
  UniformMesh uniform = uniform_mesh(grid, options.uniform, file, context);
  report(uniform.counts, context);
  const bool merges = options.tolerance > 0 || at_points.simplifies();
  return finished(
      uniform.points.empty() || !merges
          ? as_they_are(std::move(uniform))
          : by_collapses(std::move(uniform), at_points, options.tolerance, options.nearness, file, context),
      at_points, file, context);
}

ManifoldDualContouringOptions read_manifold_dual_contouring_options(const ExtractionInput& input,
                                                                    const IndexToWorld& placement) {
  const int tile = tile_option_table().read(input.options).tile;
  if (tile % 8 != 0 || (tile > 0 && tile < kLeastTile))
    throw Error("option 'tile' takes 0 and multiples of 8 from " + std::to_string(kLeastTile) + " on, not " +
                std::to_string(tile));
  return {.tolerance = asked_tolerance(input.options, placement),
          .nearness = nearness_option_table().read(input.options),
          .tile = tile,
          .uniform = read_dual_contouring_options(input)};
}

PolygonMesh manifold_dual_contouring(const ExtractionInput& input) {
  ManifoldDualContouringOptions options = read_manifold_dual_contouring_options(input, {});
  const auto contour = [&](const ExtractionInput& from) {
    return contour_certified(from, "manifold-dual-contouring", options.uniform.needs_normals(),
                             [&](const HermiteView& grid, double tolerance) {
                               options.tolerance = tolerance;
                               return manifold_dual_contouring(grid, options, input.field, input.context);
                             });
  };
  if (options.tile == 0 || !input.source) return contour(input);
  // The placement of all parts of a volume.
  options.whole = extent_of(*input.source, input.level_set.voxel_size());
  const LevelSet placed = with_extent(input.level_set, options.whole);
  return contour({.level_set = placed,
                  .isovalue = input.isovalue,
                  .source = input.source,
                  .options = input.options,
                  .context = input.context,
                  .field = input.field,
                  .hermite = input.hermite,
                  .written_in_single = input.written_in_single,
                  .caps = input.caps});
}

std::vector<OptionSpec> manifold_dual_contouring_options() {
  std::vector<OptionSpec> options = tolerance_options();
  for (OptionSpec& option : nearness_option_table().specs()) options.push_back(std::move(option));
  for (OptionSpec& option : tile_option_table().specs()) options.push_back(std::move(option));
  for (OptionSpec& option : dual_contouring_options()) options.push_back(std::move(option));
  return options;
}

}  // namespace hermesh
