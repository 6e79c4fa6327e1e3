#include "algorithms/extraction/marching_cubes/marching_cubes.h"

#include <algorithm>
#include <optional>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/hermite_input.h"
#include "algorithms/extraction/marching_cubes/triangulation_table.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/lattice/crossing_edges.h"
#include "algorithms/lattice/grid_placement.h"
#include "algorithms/lattice/leaf_table.h"
#include "algorithms/thesis/voxels/representation.h"

namespace hermesh {
namespace {

/// The vertices and triangles of one leaf, and their positions in the mesh.
struct LeafOutput : CrossingEdges {
  std::uint32_t first_point, first_triangle;

  std::uint32_t point_on(int axis, int sample) const { return first_point + rank(axis, sample); }
};

/// The leaves, and the cells and samples beyond them.
class Leaves {
 public:
  Leaves(const LevelSet& level_set, double isovalue, RunContext& context)
      : table_(level_set, isovalue, context), placement_(placement_of(level_set)), isovalue_(isovalue) {}

  std::size_t size() const { return table_.size(); }
  const IndexToWorld& placement() const { return placement_; }
  const LeafTable& table() const { return table_; }

  /// Calls f(x, y, z, pattern) for each active cell that the leaf owns, with its first corner relative to the
  /// leaf. A leaf owns the cells that start in it. The surface may also pass through cells that start outside
  /// the leaves and extend into one. These cells are grouped by the block in which they start; of all leaves
  /// that such cells of a block touch above it, the first in the order of is_first_above() owns them.
  template <class F>
  void for_each_active_cell(std::size_t leaf, F&& f) const {
    for_each_active_cell_of_block(leaf, {0, 0, 0}, f);
    for (int below = 1; below < 8; ++below) {
      const std::array<int, 3> offset{-(below & 1), -(below >> 1 & 1), -(below >> 2)};
      if (table_.neighbour(leaf, offset[0], offset[1], offset[2]) < 0 && is_first_above(leaf, offset))
        for_each_active_cell_of_block(leaf, offset, f);
    }
  }

  /// Returns the sample at (x, y, z) from a leaf's first, each 0 to 8; negative inside, in units of the
  /// volume's values.
  double signed_value(std::size_t leaf, int x, int y, int z) const {
    const std::int32_t there = table_.neighbour(leaf, x >> 3, y >> 3, z >> 3);
    // An edge that ends in a tile is rare, so a search through the tree is fast enough.
    const float value =
        there < 0 ? table_.value_at(leaf, x, y, z) : table_.values(there)[sample_index(x & 7, y & 7, z & 7)];
    return double(table_.rule().scale) * (double(value) - isovalue_);
  }

 private:
  /// Returns the signs of the eight corners of the cells that start in the block at `offset` (in blocks, each
  /// 0 or −1) from a leaf.
  std::array<BlockMask, 8> corner_signs(std::size_t leaf, const std::array<int, 3>& offset) const {
    std::array<BlockMask, 8> corner;
    for (int c = 0; c < 8; ++c)
      corner[c] = shifted_mask(c & 1, c >> 1 & 1, c >> 2, [&](int ax, int ay, int az) -> const BlockMask& {
        const int dx = offset[0] + ax, dy = offset[1] + ay, dz = offset[2] + az;
        if (dx == 0 && dy == 0 && dz == 0) return table_.inside(leaf);
        return table_.signs(table_.neighbour(leaf, dx, dy, dz));
      });
    return corner;
  }

  /// Returns true if `leaf` is the first of the leaves in the blocks above the block at `offset`.
  bool is_first_above(std::size_t leaf, const std::array<int, 3>& offset) const {
    for (int above = 1; above < 8; ++above) {
      const int dx = offset[0] + (above & 1), dy = offset[1] + (above >> 1 & 1),
                dz = offset[2] + (above >> 2);
      if (dx == 0 && dy == 0 && dz == 0) return true;
      if (table_.neighbour(leaf, dx, dy, dz) >= 0) return false;
    }
    return true;
  }

  template <class F>
  void for_each_active_cell_of_block(std::size_t leaf, const std::array<int, 3>& offset, F&& f) const {
    const std::array<BlockMask, 8> corner = corner_signs(leaf, offset);
    BlockMask active{};
    for (int word = 0; word < 8; ++word) {
      // A cell is active if some of its corners are inside, but not every one.
      std::uint64_t some = 0, every = ~0ull;
      for (const BlockMask& mask : corner) some |= mask[word], every &= mask[word];
      active[word] = some & ~every;
    }
    for_each_bit(active, [&](int sample) {
      int pattern = 0;
      for (int c = 0; c < 8; ++c) pattern |= static_cast<int>(test(corner[c], sample)) << c;
      f(8 * offset[0] + (sample >> 6), 8 * offset[1] + (sample >> 3 & 7), 8 * offset[2] + (sample & 7),
        pattern);
    });
  }

  const LeafTable table_;
  const IndexToWorld placement_;
  const double isovalue_;
};

/// Writes the intersection of the surface with each crossed edge of a leaf, 0 to 1 along the edge: by linear
/// interpolation of the samples, or from the crossings, if there are any, which are in the order of the
/// edges.
void write_points(const Leaves& leaves, std::size_t leaf, const FloatHermite* hermite,
                  const LeafOutput& output, PolygonMesh& mesh) {
  const IndexToWorld& placement = leaves.placement();
  const std::array<std::int32_t, 3> lower = leaves.table().lower(leaf);
  const SignLeaf* signs = hermite ? hermite->find(lower) : nullptr;
  const EdgeCrossing* crossing = signs ? hermite->crossings.data() + signs->first : nullptr;
  output.for_each([&](int axis, int sample) {
    const int local[3] = {sample >> 6, (sample >> 3) & 7, sample & 7};
    const double from = leaves.signed_value(leaf, local[0], local[1], local[2]);
    const double to =
        leaves.signed_value(leaf, local[0] + (axis == 0), local[1] + (axis == 1), local[2] + (axis == 2));
    Eigen::Vector3d position;
    for (int a = 0; a < 3; ++a) position[a] = lower[a] - placement.base[a] + local[a];
    // Differences of signed values at both ends cannot be 0, because the signs differ. A margin at the ends
    // prevents vertices from coinciding.
    const double offset = crossing ? double((crossing++)->offset) : from / (from - to);
    position[axis] += std::clamp(offset, kCrossingMargin, 1.0 - kCrossingMargin);
    mesh.points[output.point_on(axis, sample)] = placement.local(position).cast<float>();
  });
}

void write_triangles(const Leaves& leaves, std::size_t leaf, const std::vector<LeafOutput>& outputs,
                     PolygonMesh& mesh) {
  const bool mirrors = leaves.placement().mirrors();
  // Vertices of neighbouring leaves are identified only by index, from their ranks, and need not be written
  // yet.
  Triangle* next = mesh.triangles.data() + outputs[leaf].first_triangle;
  leaves.for_each_active_cell(leaf, [&](int x, int y, int z, int pattern) {
    const CellTriangles& cell = kTriangulation[pattern];
    for (int t = 0; t < cell.count; ++t, ++next)
      for (int corner = 0; corner < 3; ++corner) {
        const CellEdge edge = kCellEdges[cell.triangles[t][mirrors ? 2 - corner : corner]];
        // An edge that changes sign starts in a leaf, as the table guarantees.
        const LatticePlace at =
            leaves.table().locate(leaf, x + (edge.first_corner & 1), y + ((edge.first_corner >> 1) & 1),
                                  z + (edge.first_corner >> 2));
        (*next)[corner] = outputs[at.block].point_on(edge.axis, at.sample);
      }
  });
}

/// Returns exact crossings from the representation that stores only offsets (§2.7), or none if the samples
/// are to be interpolated.
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
  const Leaves leaves = [&] {
    Stage stage(context, "read signs");
    return Leaves(level_set, isovalue, context);
  }();
  // Count, scan, fill (core/parallel.h): a leaf writes its own entry, then its own range of vertices and
  // triangles. The order of the mesh is that of the leaves, for any thread schedule.
  std::vector<LeafOutput> outputs(leaves.size());
  std::vector<std::uint64_t> points(leaves.size()), triangles(leaves.size());
  {
    Stage stage(context, "count");
    parallel_blocks(leaves.size(), context, [&](std::size_t leaf) {
      LeafOutput& output = outputs[leaf];
      output.crossing = leaves.table().crossing_edges(leaf);
      output.count_before();
      points[leaf] = static_cast<std::uint64_t>(output.crossing_count());
      leaves.for_each_active_cell(
          leaf, [&](int, int, int, int pattern) { triangles[leaf] += kTriangulation[pattern].count; });
    });
  }
  PolygonMesh mesh;
  mesh.origin = leaves.placement().origin;
  mesh.points.resize(exclusive_scan(points, "points"));
  mesh.triangles.resize(exclusive_scan(triangles, "triangles"));
  // From here on point_on() returns indices of the mesh. The fill reads the outputs of other leaves and does
  // not change any.
  for (std::size_t leaf = 0; leaf < leaves.size(); ++leaf) {
    outputs[leaf].first_point = static_cast<std::uint32_t>(points[leaf]);
    outputs[leaf].first_triangle = static_cast<std::uint32_t>(triangles[leaf]);
  }
  Stage stage(context, "fill");
  parallel_blocks(leaves.size(), context, [&](std::size_t leaf) {
    write_points(leaves, leaf, crossings, outputs[leaf], mesh);
    write_triangles(leaves, leaf, outputs, mesh);
  });
  return mesh;
}

PolygonMesh marching_cubes(const ExtractionInput& input) {
  const std::optional<FloatHermite> crossings = directed_distances(input);
  return marching_cubes(input.level_set, input.isovalue, crossings ? &*crossings : nullptr, input.context);
}

std::vector<OptionSpec> marching_cubes_options() {
  return {
      {"crossings",
       "samples",
       "where points go: 'samples' interpolates the level set, 'exact' takes the polygons' hits as directed "
       "distances",
       {"samples", "exact"}}};
}

}  // namespace hermesh
