#include "algorithms/thesis/adaptive_dual_contouring/adaptive_dual_contouring.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <sstream>

#include "algorithms/core/large_array.h"
#include "algorithms/core/option_table.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/hermite_input.h"
#include "algorithms/thesis/adaptive_dual_contouring/block_regions.h"

namespace hermesh {
namespace {

/// The mask grid of §6.4 in its last state: the point of each active cell. Numbers within blocks are half as
/// many bytes to touch as those of the mesh, and touching fresh memory is what the grid costs.
struct MaskGrid {
  LargeArray<std::uint16_t>
      numbers;  ///< by block and cell; of cells that are not active whatever the memory held
  std::vector<std::uint64_t> first;  ///< first point of each block
};

/// The points of the four cells around a tagged edge, of which each has a block (EdgeSource::blocks()).
struct PointsAround {
  Quad points;
  int step;       ///< by how many levels the coarsest and the finest of their regions differ
  bool complete;  ///< whether each of the cells has a point
};

PointsAround points_of(const MaskGrid& mask, const std::array<LatticePlace, 4>& cells) {
  PointsAround result;
  std::uint16_t n[4];
  for (int i = 0; i < 4; ++i) {
    n[i] = mask.numbers[512 * static_cast<std::size_t>(cells[i].block) +
                        static_cast<std::size_t>(cells[i].sample)];
    result.points[i] =
        static_cast<std::uint32_t>(mask.first[static_cast<std::size_t>(cells[i].block)]) + point_of(n[i]);
  }
  const auto [finest, coarsest] =
      std::minmax({level_of(n[0]), level_of(n[1]), level_of(n[2]), level_of(n[3])});
  result.step = coarsest - finest;
  result.complete = n[0] != kNoPoint && n[1] != kNoPoint && n[2] != kNoPoint && n[3] != kNoPoint;
  return result;
}

/// One run of adaptive_dual_contouring(), stage by stage.
class AdaptiveContourer {
 public:
  AdaptiveContourer(const EdgeSource& edges, const IndexToWorld& placement, const AdaptiveOptions& options,
                    const AdaptivityField* field, RunContext& context)
      : context_(context),
        edges_(edges),
        placement_(placement),
        options_(options),
        field_(field, placement),
        input_{edges, options_, field_},
        blocks_(edges.blocks().size()),
        groups_((blocks_ + kGroup - 1) / kGroup) {}

  PolygonMesh run() {
    PolygonMesh mesh;
    mesh.origin = placement_.origin;
    merge();
    number_points(mesh);
    connect(mesh);
    // A region may hold a whole component of the surface where a topology test is left out; no polygon uses
    // its point.
    if (field_.leaves_out_outside() || options_.topology_tests != AdaptiveOptions::TopologyTests::both)
      drop_unused_points(mesh);
    report();
    return mesh;
  }

 private:
  /// Blocks of a task. Groups depend on the data alone, and so does the order of points and polygons.
  static constexpr std::size_t kGroup = 64;

  /// Merges the cells of every block by itself, as §6.4 does. Groups of blocks keep their points until it is
  /// known how many there are before them: far fewer than active cells.
  void merge() {
    Stage stage(context_, "merge cells");
    mask_.numbers.resize(512 * blocks_);
    results_.resize(blocks_);
    places_.resize(groups_);
    parallel_blocks(groups_, context_, [&](std::size_t g) {
      // A task writes to its own blocks' part of the mask and to its own group.
      std::array<Eigen::Vector3f, 512> points;
      for_each_block(g, [&](std::size_t b) {
        std::uint16_t* mask = mask_.numbers.data() + 512 * b;
        if (field_.leaves_out_outside())
          std::fill_n(mask, 512, kNoPoint);  // without it every cell asked for is active
        results_[b] = merge_block(input_, static_cast<std::int32_t>(b), mask, points.data());
        places_[g].insert(places_[g].end(), points.begin(), points.begin() + results_[b].points);
      });
    });
  }

  /// Gives every block its range of the shared array of points (§6.4), and moves the points from voxels to
  /// the mesh's space.
  void number_points(PolygonMesh& mesh) {
    Stage stage(context_, "number points");
    mask_.first.resize(blocks_);
    for (std::size_t b = 0; b < blocks_; ++b) mask_.first[b] = results_[b].points;
    mesh.points.resize(exclusive_scan(mask_.first, "points"));
    parallel_blocks(groups_, context_, [&](std::size_t g) {
      // A group's points are in the order of its blocks, so that one pointer walks over all of them.
      const Eigen::Vector3f* place = places_[g].data();
      for_each_block(g, [&](std::size_t b) {
        Eigen::Vector3d lower;
        for (int a = 0; a < 3; ++a) lower[a] = edges_.blocks()[b].lower[a] - placement_.base[a];
        for (std::uint32_t i = 0; i < results_[b].points; ++i)
          mesh.points[mask_.first[b] + i] = placement_.local(lower + (place++)->cast<double>()).cast<float>();
      });
    });
    places_ = {};
  }

  /// Connects points to polygons. Groups of blocks keep them until it is known how many come before: far
  /// fewer than crossing edges.
  void connect(PolygonMesh& mesh) {
    Stage stage(context_, "connect");
    std::vector<std::vector<Quad>> quads(groups_);
    std::vector<std::vector<Triangle>> triangles(groups_);
    std::vector<std::uint64_t> first_quad(groups_), first_triangle(groups_);
    steps_.resize(groups_);
    parallel_blocks(groups_, context_, [&](std::size_t g) {
      for_each_block(g, [&](std::size_t b) {
        for_each_polygon(b, [&](const Quad& polygon, int corners, int step) {
          ++steps_[g][static_cast<std::size_t>(corners - 3)][static_cast<std::size_t>(step)];
          // Triangles are where an edge lies on the border between regions of different size (fig. 6.4).
          if (corners == 4)
            quads[g].push_back(polygon);
          else
            triangles[g].push_back({polygon[0], polygon[1], polygon[2]});
        });
      });
      first_quad[g] = quads[g].size();
      first_triangle[g] = triangles[g].size();
    });
    // Quads and triangles have arrays of their own, and each group a range in either.
    mesh.quads.resize(exclusive_scan(first_quad, "quads"));
    mesh.triangles.resize(exclusive_scan(first_triangle, "triangles"));
    parallel_blocks(groups_, context_, [&](std::size_t g) {
      std::copy(quads[g].begin(), quads[g].end(),
                mesh.quads.begin() + static_cast<std::ptrdiff_t>(first_quad[g]));
      std::copy(triangles[g].begin(), triangles[g].end(),
                mesh.triangles.begin() + static_cast<std::ptrdiff_t>(first_triangle[g]));
    });
  }

  /// Calls f(points, 3 or 4, difference of level) for each polygon of the block's crossing edges (§6.5).
  template <class F>
  void for_each_polygon(std::size_t b, F&& f) const {
    const HermiteView::Block& block = edges_.blocks()[b];
    const bool mirrors = placement_.mirrors();
    for_each_edge_with_cells(edges_.blocks(), b,
                             [&](int, int sample, const std::array<LatticePlace, 4>& cells) {
                               auto [polygon, step, complete] = points_of(mask_, cells);
                               if (!complete) return;
                               int corners = 0;
                               // Points that are alike are dropped where they follow one another: cells of
                               // one region around an edge do, for it is a cube. With fewer than three left
                               // the edge lies within a region, or between two, and gives nothing.
                               for (int i = 0; i < 4; ++i)
                                 if (polygon[i] != polygon[(i + 1) & 3]) polygon[corners++] = polygon[i];
                               if (corners < 3) return;
                               // The sign at the edge's first sample orients the polygon; a placement that
                               // mirrors turns all of them about.
                               if (test(block.inside, sample) == mirrors)
                                 std::swap(polygon[1], polygon[corners - 1]);
                               f(polygon, corners, step);
                             });
  }

  template <class F>
  void for_each_block(std::size_t group, F&& f) const {
    for (std::size_t b = group * kGroup; b < std::min(blocks_, (group + 1) * kGroup); ++b) f(b);
  }

  /// Figures of the run, added up in the order of the blocks.
  void report() const {
    const auto sum = [&](auto&& of) {
      return std::accumulate(results_.begin(), results_.end(), 0.0,
                             [&](double total, const BlockResult& result) { return total + of(result); });
    };
    for (std::size_t level = 0; level < 3; ++level)
      context_.figure("regions_" + std::to_string(level + 1),
                      sum([&](const BlockResult& r) { return r.regions[level]; }));
    float largest = 0.0f;
    for (const BlockResult& result : results_) largest = std::max(largest, result.largest_plane_distance);
    context_.figure("largest_plane_distance", largest);
    report_escapes();
    // Polygons by the levels around them tell whether triangles are where fig. 6.4 has them.
    for (std::size_t corners : {4, 3})
      for (std::size_t step = 0; step < 4; ++step) {
        double polygons = 0.0;
        for (const Steps& steps : steps_) polygons += steps[corners - 3][step];
        context_.figure((corners == 4 ? "quads_step_" : "triangles_step_") + std::to_string(step), polygons);
      }
  }

  /// The figures about points outside their regions (trap T7).
  void report_escapes() const {
    std::array<double, kEscapeRanges.size() + 1> escaped{};
    float largest = 0.0f;
    for (const BlockResult& result : results_) {
      for (std::size_t i = 0; i < escaped.size(); ++i) escaped[i] += result.escaped[i];
      largest = std::max(largest, result.largest_escape);
    }
    context_.figure("escaped", std::accumulate(escaped.begin(), escaped.end(), 0.0));
    context_.figure("largest_escape", largest);
    // A range is called by its upper end, the last by its lower one.
    for (std::size_t i = 0; i < kEscapeRanges.size(); ++i) {
      std::ostringstream name;
      name << "escaped_to_" << kEscapeRanges[i];
      context_.figure(name.str(), escaped[i]);
    }
    context_.figure("escaped_beyond_4", escaped.back());
  }

  RunContext& context_;
  const EdgeSource& edges_;
  const IndexToWorld& placement_;
  const AdaptiveOptions options_;
  const FieldEvaluator field_;
  const RegionInput input_;
  const std::size_t blocks_, groups_;
  /// Points of each group, those of its blocks one after another: voxels from the block's first sample.
  std::vector<std::vector<Eigen::Vector3f>> places_;
  MaskGrid mask_;
  std::vector<BlockResult> results_;
  /// Polygons by corners, less 3, and by difference of level.
  using Steps = std::array<std::array<std::uint32_t, 4>, 2>;
  std::vector<Steps> steps_;  ///< by group
};

/// The options that set AdaptiveOptions.
const OptionTable<AdaptiveOptions>& adaptive_option_table() {
  using Options = AdaptiveOptions;
  using Placement = Options::Placement;
  using Nearest = Options::Nearest;
  using Tests = Options::TopologyTests;
  static const auto table =
      OptionTable<Options>()
          .number("threshold", &Options::threshold, {},
                  "square voxels: cells are merged while the sum of the squared distances to their planes is "
                  "less; larger "
                  "merges more, 0 nothing")
          .choice("placement", &Options::placement,
                  {{"optimal", Placement::optimal}, {"average", Placement::average}},
                  "where a region's point goes: 'optimal' minimises the QEF and keeps sharp features, "
                  "'average' takes the "
                  "mean of its crossings")
          .number("truncation", &Options::truncation, {.maximum = 1.0},
                  "singular values below this share of the largest are dropped; larger is smoother and keeps "
                  "fewer "
                  "features, 0 drops none that can be told from 0",
                  {"placement=optimal"})
          .choice("minimiser", &Options::nearest,
                  {{"mass-point", Nearest::mass_point}, {"corner", Nearest::corner}},
                  "where singular values are dropped, the minimiser nearest to the 'mass-point' of the "
                  "crossings, or to "
                  "the first 'corner' of the cell or region (the pseudo-inverse alone)",
                  {"placement=optimal"})
          .choice(
              "topology_tests", &Options::topology_tests,
              {{"both", Tests::both},
               {"table", Tests::table},
               {"signs", Tests::signs},
               {"none", Tests::none}},
              "what a region must pass to be merged: the look-up 'table', the 'signs' of middles, 'both' (as "
              "printed), or 'none'; without one the topology may change");
  return table;
}

}  // namespace

PolygonMesh adaptive_dual_contouring(const FloatHermite& hermite, const AdaptiveOptions& options,
                                     const AdaptivityField* field, RunContext& context) {
  const SparseEdges edges = [&] {
    Stage stage(context, "blocks");
    return SparseEdges(hermite, context);
  }();
  return AdaptiveContourer(edges, hermite.placement, options, field, context).run();
}

PolygonMesh adaptive_dual_contouring(const ThesisDense& hermite, const AdaptiveOptions& options,
                                     const AdaptivityField* field, RunContext& context) {
  const PackedEdges edges = [&] {
    Stage stage(context, "blocks");
    return PackedEdges(hermite, context);
  }();
  PolygonMesh mesh = AdaptiveContourer(edges, hermite.placement, options, field, context).run();
  // A region may have lost all edges that lead out of it, and its point is then no polygon's.
  if (edges.lost() + edges.needless() > 0) drop_unused_points(mesh);
  context.figure("lost_crossings", static_cast<double>(edges.lost()));
  context.figure("needless_crossings", static_cast<double>(edges.needless()));
  if (edges.lost() > 0)
    context.note(std::to_string(edges.lost()) + " of " +
                 std::to_string(edges.lost() + edges.tagged() - edges.needless()) +
                 " edge crossings were lost by the 10 bytes of §4.2 and leave holes; -o "
                 "lost_crossings=repaired closes "
                 "them, other representations lose none");
  return mesh;
}

PolygonMesh adaptive_dual_contouring(const ExtractionInput& input) {
  const AdaptiveOptions options = adaptive_option_table().read(input.options);
  // As printed: what is meshed are the 10 bytes themselves, with the edges that they say have data.
  if (input.options.is("representation", "thesis") && input.options.is("lost_crossings", "kept"))
    return adaptive_dual_contouring(thesis_hermite_input(input, "adaptive-dual-contouring"), options,
                                    input.field, input.context);
  // Means of crossings that are never merged need no planes.
  const bool needs_normals =
      options.placement == AdaptiveOptions::Placement::optimal || options.threshold > 0;
  const FloatHermite hermite = hermite_input(input, "adaptive-dual-contouring", needs_normals);
  return adaptive_dual_contouring(hermite, options, input.field, input.context);
}

std::vector<OptionSpec> adaptive_dual_contouring_options() {
  std::vector<OptionSpec> options = adaptive_option_table().specs();
  // The Hermite data has options of its own: where the crossings come from, and how they are stored
  // (hermite_input.h).
  // What the print says is the default here: its own 10 bytes.
  std::vector<OptionSpec> of_hermite = hermite_options();
  for (OptionSpec& option : of_hermite)
    if (option.name == "representation") option.fallback = "thesis";
  options.insert(options.end(), of_hermite.begin(), of_hermite.end());
  options.push_back(
      {.name = "lost_crossings",
       .fallback = "kept",
       .help = "crossings along x and y whose normal has the code 0, which the print takes for none: 'kept' "
               "lost, so that the mesh has holes there, or 'repaired' by the middle of their edge",
       .choices = {"kept", "repaired"},
       .only_with = {"representation=thesis"}});
  return options;
}

}  // namespace hermesh
