#include "algorithms/extraction/manifold_dual_contouring/manifold_dual_contouring.h"

#include <algorithm>
#include <cmath>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/adaptivity_field.h"
#include "algorithms/extraction/hermite_input.h"
#include "algorithms/extraction/manifold_dual_contouring/certified_decimation.h"
#include "algorithms/extraction/manifold_dual_contouring/uniform_mesh.h"

namespace hermesh {
namespace {

void report(const UniformMesh& mesh, RunContext& context) {
  context.figure("cells", double(mesh.cells));
  context.figure("several_sheets", double(mesh.several_sheets));
  context.figure("held_cells", double(mesh.held));
  context.figure("fanned_edges", double(mesh.fanned_edges));
  context.figure("escaped", double(mesh.escaped));
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

std::vector<Triangle> all_triangles(UniformMesh& mesh) {
  std::vector<Triangle> triangles = std::move(mesh.triangles);
  triangles.reserve(triangles.size() + 2 * mesh.quads.size());
  for (const Quad& q : mesh.quads) {
    triangles.push_back({q[0], q[1], q[2]});
    triangles.push_back({q[0], q[2], q[3]});
  }
  mesh.quads = {};
  return triangles;
}

/// The field at single places of index space, relative to the placement's base.
class FieldAtPoints {
 public:
  FieldAtPoints(const AdaptivityField* field, const IndexToWorld& placement)
      : evaluator_(field, placement), base_(placement.base) {}

  bool leaves_out(const Eigen::Vector3d& p) const {
    return evaluator_.leaves_out_outside() && !in_mask(cell_at(p));
  }
  float tolerance(const Eigen::Vector3d& p, double tolerance) const {
    const Cell cell = cell_at(p);
    if (evaluator_.simplifies_outside() && !in_mask(cell))
      return static_cast<float>(std::max(tolerance, kSimplifiedTolerance));
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

}  // namespace

PolygonMesh manifold_dual_contouring(const HermiteView& grid, const ManifoldDualContouringOptions& options,
                                     const AdaptivityField* field, RunContext& context) {
  const FilePoints file(grid.placement());
  const FieldAtPoints at_points(field, grid.placement());
  UniformMesh uniform = uniform_mesh(grid, options.uniform, file, context);
  report(uniform, context);
  const bool whole = !field || field->outside != AdaptivityField::Outside::nothing;
  if (uniform.points.empty() || (options.tolerance <= 0 && whole))
    return in_world(uniform.points, uniform.triangles, uniform.quads, file, context);

  const FineMesh fine(std::move(uniform.points), all_triangles(uniform));
  std::vector<float> asked(fine.points().size());
  parallel_blocks(asked.size(), context, [&](std::size_t i) {
    asked[i] = at_points.tolerance(fine.points()[i], options.tolerance);
  });
  CertifiedMesh coarse;
  if (options.tolerance > 0) coarse = decimate_certified(fine, asked, {}, file, context);
  const std::vector<Eigen::Vector3d>& places = options.tolerance > 0 ? coarse.points : fine.points();
  constexpr std::uint32_t kNone = 0xffffffffu;
  std::vector<std::uint32_t> number(places.size(), kNone);
  std::vector<Eigen::Vector3d> points;
  std::vector<Triangle> triangles;
  for (Triangle t : options.tolerance > 0 ? coarse.triangles : fine.triangles()) {
    if (!whole && at_points.leaves_out((places[t[0]] + places[t[1]] + places[t[2]]) / 3.0)) continue;
    for (std::uint32_t& p : t) {
      if (number[p] == kNone) {
        number[p] = static_cast<std::uint32_t>(points.size());
        points.push_back(places[p]);
      }
      p = number[p];
    }
    triangles.push_back(t);
  }
  return in_world(points, std::move(triangles), {}, file, context);
}

PolygonMesh manifold_dual_contouring(const ExtractionInput& input) {
  ManifoldDualContouringOptions options;
  options.uniform = read_dual_contouring_options(input.options);
  options.tolerance = input.options.number("tolerance");
  if (const double world = input.options.number("tolerance_world"); world > 0)
    options.tolerance = world / input.level_set.voxel_size();
  const bool needs_normals = options.uniform.placement == DualContouringOptions::Placement::optimal;
  const FloatHermite hermite = hermite_input(input, "manifold-dual-contouring", needs_normals);
  return manifold_dual_contouring(view_of(hermite, input.context), options, input.field, input.context);
}

std::vector<OptionSpec> manifold_dual_contouring_options() {
  std::vector<OptionSpec> options = dual_contouring_options();
  options.insert(options.begin(),
                 {.name = "tolerance",
                  .fallback = "0.1",
                  .help = "two-sided distance to the uniform mesh, in voxels, that is exceeded by no more than 0.005; larger "
                          "gives fewer polygons, 0 the uniform mesh itself",
                  .maximum = 1e6});
  options.insert(options.begin() + 1,
                 {.name = "tolerance_world",
                  .fallback = "0",
                  .help = "the same in world units, instead of tolerance where it is greater than 0",
                  .maximum = 1e30});
  return options;
}

}  // namespace hermesh
