#include "algorithms/extraction/manifold_dual_contouring.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/adaptivity_field.h"
#include "algorithms/extraction/hermite_input.h"
#include "algorithms/extraction/certified_collapse/certified_decimation.h"
#include "algorithms/extraction/certified_octree/region_mesh.h"
#include "algorithms/extraction/embedded_mesh/uniform_mesh.h"

namespace hermesh {
namespace {

void report(const UniformCounts& counts, RunContext& context) {
  context.figure("cells", double(counts.cells));
  context.figure("several_sheets", double(counts.several_sheets));
  context.figure("held_cells", double(counts.held));
  context.figure("fanned_edges", double(counts.fanned_edges));
  context.figure("escaped", double(counts.escaped));
}

PolygonMesh in_world(const std::vector<Eigen::Vector3d>& points, std::vector<Triangle> triangles,
                     LargeArray<Quad> quads, const FilePoints& file, RunContext& context) {
  PolygonMesh result;
  result.origin = file.placement().origin;
  result.points.resize(points.size());
  parallel_blocks(points.size(), context, [&](std::size_t i) { result.points[i] = file.in_file(points[i]); });
  result.quads = std::move(quads);
  result.triangles = std::move(triangles);
  if (file.placement().mirrors()) {
    for (Quad& quad : result.quads) std::swap(quad[1], quad[3]);
    for (Triangle& triangle : result.triangles) std::swap(triangle[1], triangle[2]);
  }
  return result;
}

std::vector<Triangle> all_triangles(std::vector<Triangle> triangles, const LargeArray<Quad>& quads) {
  triangles.reserve(triangles.size() + 2 * quads.size());
  for (const Quad& q : quads) {
    triangles.push_back({q[0], q[1], q[2]});
    triangles.push_back({q[0], q[2], q[3]});
  }
  return triangles;
}

/// The field at single places of index space, relative to the placement's base.
class FieldAtPoints {
 public:
  FieldAtPoints(const AdaptivityField* field, const IndexToWorld& placement)
      : evaluator_(field, placement), base_(placement.base) {}

  bool is_constant() const {
    return !evaluator_.simplifies_outside() && !evaluator_.leaves_out_outside() && !evaluator_.has_scale();
  }
  bool simplifies() const { return evaluator_.simplifies_outside(); }
  bool leaves_out_outside() const { return evaluator_.leaves_out_outside(); }
  bool leaves_out(const Eigen::Vector3d& p) const {
    return evaluator_.leaves_out_outside() && !in_mask(cell_at(p));
  }
  float tolerance(const Eigen::Vector3d& p, double tolerance) const {
    const Cell cell = cell_at(p);
    if (evaluator_.simplifies_outside() && !in_mask(cell))
      return static_cast<float>(std::max(tolerance, kSimplifiedTolerance));
    // What is left out in the end must not have become part of what is not.
    if (evaluator_.leaves_out_outside() && !in_mask(cell)) return 0;
    if (!evaluator_.has_scale()) return static_cast<float>(tolerance);
    std::array<float, 512> scales;
    evaluator_.scales(cell.lower, cell.mask, scales);
    return static_cast<float>(tolerance * scales[cell.sample]);
  }

 private:
  struct Cell {
    std::array<std::int32_t, 3> lower;
    BlockMask mask{};
    std::size_t sample;
  };
  Cell cell_at(const Eigen::Vector3d& p) const {
    Cell cell;
    int at[3];
    for (int a = 0; a < 3; ++a) {
      const int index = static_cast<int>(std::floor(p[a])) + base_[a];
      cell.lower[a] = index & ~7;
      at[a] = index & 7;
    }
    cell.sample = static_cast<std::size_t>(sample_index(at[0], at[1], at[2]));
    cell.mask[cell.sample >> 6] = std::uint64_t{1} << (cell.sample & 63);
    return cell;
  }
  bool in_mask(const Cell& cell) const { return any(evaluator_.inside(cell.lower, cell.mask)); }

  const FieldEvaluator evaluator_;
  const std::array<std::int32_t, 3> base_;
};

/// Places of points, and polygons between them.
struct Polygons {
  std::vector<Eigen::Vector3d> points;
  std::vector<Triangle> triangles;
  LargeArray<Quad> quads;
  /// By triangle, two of each quad after them; or empty, for none: whether it stands for polygons within the mask,
  /// wherever its middle is.
  std::vector<std::uint8_t> shown;
};

std::vector<float> tolerances(const std::vector<Eigen::Vector3d>& points, const FieldAtPoints& field, double tolerance,
                              const RunContext& context) {
  std::vector<float> result(points.size());
  parallel_blocks(points.size(), context, [&](std::size_t i) { result[i] = field.tolerance(points[i], tolerance); });
  return result;
}

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

/// @param is_shown called with the number of a triangle, which of its corners, and the corner's point
template <class IsShown>
std::vector<std::uint8_t> shown_by(const Polygons& polygons, IsShown&& is_shown) {
  std::vector<std::uint8_t> result;
  for (const Triangle& t : all_triangles(polygons.triangles, polygons.quads)) {
    const std::size_t number = result.size();
    result.push_back(is_shown(number, 0, t[0]) || is_shown(number, 1, t[1]) || is_shown(number, 2, t[2]));
  }
  return result;
}

Polygons as_they_are(UniformMesh uniform) {
  return {std::move(uniform.points), std::move(uniform.triangles), std::move(uniform.quads), {}};
}

Polygons by_regions(const HermiteView& grid, const ManifoldDualContouringOptions& options, const FieldAtPoints& field,
                    const FilePoints& file, RunContext& context) {
  UniformCells uniform(grid, options.uniform, file, context);
  const RegionOptions asked{cell_tolerances(uniform.cells(), field, options.tolerance, context),
                            options.flatness, options.largest_cube};
  const bool in_hulls = options.uniform.placement == DualContouringOptions::Placement::average;
  RegionMesh merged = merge_regions(uniform, in_hulls, asked, file, context);
  report(uniform.counts(), context);
  Polygons result{std::move(merged.points), std::move(merged.triangles), std::move(merged.quads), {}};
  if (field.leaves_out_outside())
    // All cells of a cube have a tolerance, and so are in the mask.
    result.shown = shown_by(result, [&](std::size_t, int, std::uint32_t point) { return merged.of_cube[point] != 0; });
  return result;
}

Polygons by_collapses(UniformMesh uniform, const FieldAtPoints& field, double tolerance, const FilePoints& file,
                      RunContext& context) {
  const FineMesh fine(std::move(uniform.points),
                      all_triangles(std::move(uniform.triangles), std::exchange(uniform.quads, {})));
  const std::vector<float> asked = tolerances(fine.points(), field, tolerance, context);
  CertifiedMesh coarse = decimate_certified(fine, asked, {}, file, context);
  Polygons result{std::move(coarse.points), std::move(coarse.triangles), {}, {}};
  if (field.leaves_out_outside())
    // What has moved was merged; what is in the mask has a tolerance.
    result.shown = shown_by(result, [&](std::size_t t, int corner, std::uint32_t point) {
      const std::uint32_t before = fine.triangles()[coarse.fine_triangle[t]][corner];
      return asked[before] > 0 && result.points[point] != fine.points()[before];
    });
  return result;
}

Polygons polygons_of(const HermiteView& grid, ManifoldDualContouringOptions options, const FieldAtPoints& field,
                     const FilePoints& file, RunContext& context) {
  const bool regions = options.merging == ManifoldDualContouringOptions::Merging::regions;
  if (regions) options.uniform.reach = 0;
  const bool merges = options.tolerance > 0 || field.simplifies();
  if (regions && merges) return by_regions(grid, options, field, file, context);
  UniformMesh uniform = uniform_mesh(grid, options.uniform, file, context);
  report(uniform.counts, context);
  if (uniform.points.empty() || !merges) return as_they_are(std::move(uniform));
  return by_collapses(std::move(uniform), field, options.tolerance, file, context);
}

/// Only the triangles that the field does not leave out, and their points. A triangle of the uniform mesh is outside if its
/// middle is; one that was merged may have its middle anywhere.
Polygons within(const FieldAtPoints& field, Polygons all) {
  constexpr std::uint32_t kNone = 0xffffffffu;
  std::vector<std::uint32_t> number(all.points.size(), kNone);
  Polygons result;
  std::size_t triangle = 0;
  for (Triangle t : all_triangles(std::move(all.triangles), std::move(all.quads))) {
    const bool shown = !all.shown.empty() && all.shown[triangle];
    ++triangle;
    if (!shown && field.leaves_out((all.points[t[0]] + all.points[t[1]] + all.points[t[2]]) / 3.0)) continue;
    for (std::uint32_t& p : t) {
      if (number[p] == kNone) {
        number[p] = static_cast<std::uint32_t>(result.points.size());
        result.points.push_back(all.points[p]);
      }
      p = number[p];
    }
    result.triangles.push_back(t);
  }
  return result;
}

/// What a step of one voxel's length in index space is at most in the world, where voxels may be no cubes.
double longest_step(const IndexToWorld& placement) { return placement.linear.operatorNorm(); }

}  // namespace

PolygonMesh manifold_dual_contouring(const HermiteView& grid, const ManifoldDualContouringOptions& options,
                                     const AdaptivityField* field, RunContext& context) {
  const FilePoints file(grid.placement());
  const FieldAtPoints at_points(field, grid.placement());
  Polygons polygons = polygons_of(grid, options, at_points, file, context);
  if (at_points.leaves_out_outside()) polygons = within(at_points, std::move(polygons));
  return in_world(polygons.points, std::move(polygons.triangles), std::move(polygons.quads), file, context);
}

PolygonMesh manifold_dual_contouring(const ExtractionInput& input) {
  ManifoldDualContouringOptions options;
  options.uniform = read_dual_contouring_options(input.options);
  options.tolerance = input.options.number("tolerance");
  options.flatness = input.options.number("flatness");
  options.largest_cube = input.options.is("largest_cube", "8")   ? 8
                         : input.options.is("largest_cube", "4") ? 4
                                                                 : 2;
  if (input.options.is("merging", "regions")) options.merging = ManifoldDualContouringOptions::Merging::regions;
  const double world = input.options.number("tolerance_world");
  const auto contoured = [&](const HermiteView& grid) {
    if (world > 0) options.tolerance = world / longest_step(grid.placement());
    return manifold_dual_contouring(grid, options, input.field, input.context);
  };
  if (const std::optional<PackedHermite> packed = packed_hermite_input(input, "manifold-dual-contouring"))
    return with_normal_code(packed->normal_code,
                            [&](auto code) { return contoured(view_of(*packed, code, input.context)); });
  const bool needs_normals = options.uniform.placement == DualContouringOptions::Placement::optimal;
  const FloatHermite hermite = hermite_input(input, "manifold-dual-contouring", needs_normals);
  return contoured(view_of(hermite, input.context));
}

std::vector<OptionSpec> manifold_dual_contouring_options() {
  std::vector<OptionSpec> options = dual_contouring_options();
  for (OptionSpec& option : options)
    if (option.name == "reach") option.only_with.push_back("merging=collapses");
  options.insert(options.begin(),
                 {.name = "tolerance",
                  .fallback = "0.1",
                  .help = "two-sided distance to the uniform mesh, in voxels, that is exceeded by no more than 0.005; larger "
                          "gives fewer polygons, 0 the uniform mesh itself",
                  .maximum = 1e6,
                  .only_with = {"tolerance_world=0"}});
  options.insert(options.begin() + 1,
                 {.name = "tolerance_world",
                  .fallback = "0",
                  .help = "the same in world units, instead of tolerance where it is greater than 0",
                  .maximum = 1e30});
  options.insert(options.begin() + 2, {.name = "merging",
                                       .fallback = "collapses",
                                       .help = "collapses: fewest polygons; regions: cubes of up to 8 cells "
                                               "a side become one point each, many times "
                                               "as fast, with points held in their cells (reach=0); fastest "
                                               "where tolerance is above 2 voxels and "
                                               "placement=average",
                                       .choices = {"collapses", "regions"}});
  options.insert(options.begin() + 3,
                 {.name = "flatness",
                  .fallback = "0",
                  .help = "with merging=regions: how far a cube's point may be from the planes of its "
                          "crossings, in voxels, root "
                          "mean square, if tolerance allows more; 0 for what tolerance allows",
                  .maximum = 1e6,
                  .only_with = {"merging=regions"}});
  options.insert(
      options.begin() + 4,
      {.name = "largest_cube",
       .fallback = "8",
       .help =
           "with merging=regions: cells a side of the largest cubes; where flatness is below 0.2 or so, 4 "
           "is as fast as 8, and nearer",
       .choices = {"8", "4", "2"},
       .only_with = {"merging=regions"}});
  return options;
}

}  // namespace hermesh
