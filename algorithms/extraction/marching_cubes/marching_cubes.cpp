#include "algorithms/extraction/marching_cubes/marching_cubes.h"

#include <algorithm>
#include <optional>

#include "algorithms/lattice/blocks.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/hermite_input.h"
#include "algorithms/extraction/marching_cubes/triangulation_table.h"
#include "algorithms/hermite/representation.h"
#include "algorithms/hermite/samplers.h"

namespace hermesh {
namespace {

/// What one block adds to the mesh, and where in it.
struct BlockOutput {
  std::array<BlockMask, 3> edges{};
  std::array<std::array<std::uint32_t, 8>, 3> rank{};  ///< points of this block before each word, by axis
  std::uint32_t first_point = 0, first_triangle = 0;

  std::uint32_t point_on(int axis, int sample) const {
    const std::uint64_t before = edges[axis][sample >> 6] & ((std::uint64_t{1} << (sample & 63)) - 1);
    return first_point + rank[axis][sample >> 6] + static_cast<std::uint32_t>(std::popcount(before));
  }
};

/// Calls f(x, y, z, pattern) for the block's active cells.
template <class F>
void for_each_active_cell(const BlockGrid& grid, std::int32_t block, F&& f) {
  std::array<BlockMask, 8> corner;
  BlockMask active{};
  for (int c = 0; c < 8; ++c) corner[c] = grid.shifted_inside(block, c & 1, (c >> 1) & 1, c >> 2);
  for (int word = 0; word < 8; ++word) {
    std::uint64_t some = 0, every = ~0ull;
    for (const BlockMask& mask : corner) some |= mask[word], every &= mask[word];
    active[word] = some & ~every;
  }
  for_each_bit(active, [&](int sample) {
    int pattern = 0;
    for (int c = 0; c < 8; ++c) pattern |= static_cast<int>(test(corner[c], sample)) << c;
    f(sample >> 6, (sample >> 3) & 7, sample & 7, pattern);
  });
}

/// Where the surface meets an edge of a block, 0 to 1 along it: by linear interpolation of the samples, or, where there
/// are crossings, theirs, which are in the order of the edges.
void write_points(const BlockGrid& grid, std::int32_t index, const FloatHermite* hermite, const BlockOutput& output,
                  PolygonMesh& mesh) {
  const Block& block = grid.blocks()[index];
  const IndexToWorld& placement = grid.placement();
  const SignLeaf* leaf = hermite ? hermite->find(block.lower) : nullptr;
  const EdgeCrossing* crossing = leaf ? hermite->crossings.data() + leaf->first : nullptr;
  for (int axis = 0; axis < 3; ++axis)
    for_each_bit(output.edges[axis], [&](int sample) {
      const int local[3] = {sample >> 6, (sample >> 3) & 7, sample & 7};
      const auto end =
          grid.locate(index, local[0] + (axis == 0), local[1] + (axis == 1), local[2] + (axis == 2));
      const double from = grid.signed_value(block, sample);
      const double to = grid.signed_value(grid.blocks()[end.block], end.sample);
      Eigen::Vector3d position;
      for (int a = 0; a < 3; ++a) position[a] = block.lower[a] - placement.base[a] + local[a];
      const double offset = crossing ? double((crossing++)->offset) : from / (from - to);
      position[axis] += std::clamp(offset, kCrossingMargin, 1.0 - kCrossingMargin);
      mesh.points[output.point_on(axis, sample)] = placement.local(position).cast<float>();
    });
}

void write_triangles(const BlockGrid& grid, std::int32_t index, const std::vector<BlockOutput>& outputs,
                     PolygonMesh& mesh) {
  const bool mirrors = grid.placement().mirrors();
  Triangle* next = mesh.triangles.data() + outputs[index].first_triangle;
  for_each_active_cell(grid, index, [&](int x, int y, int z, int pattern) {
    const CellTriangles& cell = kTriangulation[pattern];
    for (int t = 0; t < cell.count; ++t, ++next)
      for (int corner = 0; corner < 3; ++corner) {
        const CellEdge edge = kCellEdges[cell.triangles[t][mirrors ? 2 - corner : corner]];
        const auto at = grid.locate(index, x + (edge.first_corner & 1), y + ((edge.first_corner >> 1) & 1),
                                    z + (edge.first_corner >> 2));
        (*next)[corner] = outputs[at.block].point_on(edge.axis, at.sample);
      }
  });
}

/// Exact crossings through the representation that needs no more than offsets (§2.7), or none if the samples are to be
/// interpolated.
std::optional<FloatHermite> directed_distances(const ExtractionInput& input) {
  if (input.options.text("crossings") == "samples") return std::nullopt;
  const auto sampled = [&] {
    if (input.hermite && input.isovalue == 0.0) return *input.hermite;
    const PolygonMesh& source =
        polygons_at_isovalue(input, "marching-cubes was asked for exact crossings", "-o crossings=samples");
    return sample_polygons(input.level_set, input.isovalue, source, input.context);
  };
  Represented data = through(Representation::directed, NormalCodeId::octahedral, sampled(), input.context);
  report_figures(data, input.level_set, input.context);
  return std::move(data.hermite);
}

}  // namespace

PolygonMesh marching_cubes(const LevelSet& level_set, double isovalue, const FloatHermite* crossings,
                           RunContext& context) {
  const BlockGrid grid = [&] {
    Stage stage(context, "read signs");
    return BlockGrid(level_set, isovalue, context);
  }();
  const std::size_t blocks = grid.blocks().size();
  std::vector<BlockOutput> outputs(blocks);
  std::vector<std::uint64_t> points(blocks), triangles(blocks);
  {
    Stage stage(context, "count");
    parallel_blocks(blocks, context, [&](std::size_t i) {
      const auto index = static_cast<std::int32_t>(i);
      BlockOutput& output = outputs[i];
      output.edges = grid.crossing_edges(index);
      std::uint32_t before = 0;
      for (int axis = 0; axis < 3; ++axis)
        for (int word = 0; word < 8; ++word) {
          output.rank[axis][word] = before;
          before += static_cast<std::uint32_t>(std::popcount(output.edges[axis][word]));
        }
      points[i] = before;
      for_each_active_cell(
          grid, index, [&](int, int, int, int pattern) { triangles[i] += kTriangulation[pattern].count; });
    });
  }
  PolygonMesh mesh;
  mesh.origin = grid.placement().origin;
  mesh.points.resize(exclusive_scan(points, "points"));
  mesh.triangles.resize(exclusive_scan(triangles, "triangles"));
  for (std::size_t i = 0; i < blocks; ++i) {
    outputs[i].first_point = static_cast<std::uint32_t>(points[i]);
    outputs[i].first_triangle = static_cast<std::uint32_t>(triangles[i]);
  }
  Stage stage(context, "fill");
  parallel_blocks(blocks, context, [&](std::size_t i) {
    const auto index = static_cast<std::int32_t>(i);
    write_points(grid, index, crossings, outputs[i], mesh);
    write_triangles(grid, index, outputs, mesh);
  });
  return mesh;
}

PolygonMesh marching_cubes(const ExtractionInput& input) {
  const std::optional<FloatHermite> crossings = directed_distances(input);
  return marching_cubes(input.level_set, input.isovalue, crossings ? &*crossings : nullptr, input.context);
}

std::vector<OptionSpec> marching_cubes_options() {
  return {{"crossings",
           "samples",
           "where points go: 'samples' interpolates the level set, 'exact' takes the polygons' hits as directed "
           "distances",
           {"samples", "exact"}}};
}

}  // namespace hermesh
