#include "algorithms/extraction/manifold_dual_contouring/manifold_dual_contouring.h"

#include <algorithm>
#include <optional>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/hermite_input.h"
#include "algorithms/extraction/manifold_dual_contouring/decimation.h"
#include "algorithms/extraction/manifold_dual_contouring/distance_certificate.h"
#include "algorithms/extraction/manifold_dual_contouring/uniform_mesh.h"

namespace hermesh {
namespace {

void report(const UniformMesh& mesh, RunContext& context) {
  context.figure("cells", double(mesh.cells));
  context.figure("several_sheets", double(mesh.several_sheets));
  context.figure("fanned_edges", double(mesh.fanned_edges));
  context.figure("escaped", double(mesh.escaped));
}

PolygonMesh in_world(const std::vector<Eigen::Vector3d>& points, std::vector<Triangle> triangles,
                     std::vector<Quad> quads, const FilePoints& file, RunContext& context) {
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

/// Collapses, and again with less room wherever the distance cannot be proved. Nothing if that never ends, which has not
/// been seen: the uniform mesh serves then.
std::optional<DecimatedMesh> certified(const FineMesh& fine, double tolerance, const FilePoints& file,
                                       RunContext& context) {
  constexpr int kAttempts = 6;
  const std::vector<float> asked(fine.points().size(), static_cast<float>(tolerance));
  std::vector<float> allowed = asked;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    DecimatedMesh mesh = begin_decimation(fine, allowed, context);
    decimate(mesh, file, context);
    const DistanceCertificate certificate = certify_distance(mesh, asked, context);
    context.figure("unproved", double(certificate.fine_triangles + certificate.coarse_triangles));
    if (certificate.holds()) return mesh;
    for (const std::uint32_t sample : certificate.samples) allowed[sample] *= attempt == 0 ? 0.3f : 0.0f;
  }
  return std::nullopt;
}

}  // namespace

PolygonMesh manifold_dual_contouring(const HermiteView& grid, const ManifoldDualContouringOptions& options,
                                     RunContext& context) {
  const FilePoints file(grid.placement());
  UniformMesh uniform = uniform_mesh(grid, options.uniform, file, context);
  report(uniform, context);
  if (options.tolerance <= 0 || uniform.points.empty())
    return in_world(uniform.points, uniform.triangles, uniform.quads, file, context);
  const FineMesh fine(std::move(uniform.points), all_triangles(uniform));
  const std::optional<DecimatedMesh> coarse = certified(fine, options.tolerance, file, context);
  if (!coarse) return in_world(fine.points(), fine.triangles(), {}, file, context);
  std::vector<std::uint32_t> number(fine.points().size(), kNoSample);
  std::vector<Eigen::Vector3d> points;
  std::vector<Triangle> triangles = coarse->triangles;
  for (Triangle& t : triangles)
    for (std::uint32_t& p : t) {
      if (number[p] == kNoSample) {
        number[p] = static_cast<std::uint32_t>(points.size());
        points.push_back(coarse->points[p]);
      }
      p = number[p];
    }
  return in_world(points, std::move(triangles), {}, file, context);
}

PolygonMesh manifold_dual_contouring(const ExtractionInput& input) {
  ManifoldDualContouringOptions options;
  options.uniform = read_dual_contouring_options(input.options);
  options.tolerance = input.options.number("tolerance");
  const bool needs_normals = options.uniform.placement == DualContouringOptions::Placement::optimal;
  const FloatHermite hermite = hermite_input(input, "manifold-dual-contouring", needs_normals);
  return manifold_dual_contouring(view_of(hermite, input.context), options, input.context);
}

std::vector<OptionSpec> manifold_dual_contouring_options() {
  std::vector<OptionSpec> options = dual_contouring_options();
  options.insert(options.begin(),
                 {.name = "tolerance",
                  .fallback = "0.1",
                  .help = "two-sided distance to the uniform mesh that is never exceeded, in voxels; larger gives fewer "
                          "polygons, 0 the uniform mesh itself",
                  .maximum = 1e6});
  return options;
}

}  // namespace hermesh
