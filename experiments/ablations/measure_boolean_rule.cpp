// Equation 7.1 of the thesis against the rule of signs: a model less a copy of itself that is moved aside.
// Both results are meshed from the same 10 bytes by the same extraction, so only the rule differs: eq. 7.1
// combines the bytes, and the rule of signs combines the exact data, which are packed then.

#include "algorithms/hermite/combine.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/thesis/adaptive_dual_contouring/adaptive_dual_contouring.h"
#include "algorithms/thesis/voxels/dense_hermite.h"
#include "experiments/harness/cell.h"

namespace hermesh {
namespace {

constexpr const char* kPrintedRule = "eq. 7.1";
constexpr const char* kSigns = "signs";

/// Returns the mesh moved by shares of its longest side that are not whole numbers of voxels, with the same
/// origin and thus on the same lattice.
PolygonMesh moved_aside(PolygonMesh mesh) {
  const Eigen::Vector3f shares(0.231f, 0.117f, 0.071f);
  const auto longest = static_cast<float>(bounds(mesh).size().maxCoeff());
  for (Eigen::Vector3f& point : mesh.points) point += longest * shares;
  return mesh;
}

FloatHermite sampled(const PolygonMesh& mesh, double voxel_size, const MeasurementInput& input,
                     RunContext& context) {
  const LevelSet level_set = voxelize(
      mesh, {.chosen = choose(input.tables.voxelizers, "hermesh"), .voxel_size = voxel_size}, context);
  return sample_polygons(level_set, 0.0, mesh, context);
}

std::string label_of(const std::string& model, const std::string& resolution, const std::string& level) {
  return model + ", " + resolution + ", " + level;
}

MeasuredRow row_of(const std::string& model, const std::string& resolution, const std::string& level,
                   const ThesisDense& difference, const RunContext& context) {
  MeasuredRow row{"difference", label_of(model, resolution, level)};
  RunContext child = child_context(context, false);
  // Threshold 0 merges nothing, so that merging cannot hide the defects that a rule left.
  const PolygonMesh mesh = adaptive_dual_contouring(difference, {.threshold = 0.0}, nullptr, child);
  validation::CheckOptions options = kPromisesAlone;
  options.self_intersections = false;
  const auto& [report, check] = judge(to_mesh_file(mesh), Promises{}, options, child);
  row.values = {{"model", model},
                {"resolution", resolution},
                {"level", level},
                {"triangles", mesh.triangle_count()},
                {"open", report.boundary_edges},
                {"flipped", report.inconsistent_edges}};
  for (const auto& [figure, value] : child.figures)
    if (figure == "lost_crossings" || figure == "needless_crossings") row.values[figure] = value;
  return row;
}

}  // namespace

std::vector<MeasuredRow> measure_boolean_rule(const MeasurementInput& input) {
  std::vector<MeasuredRow> rows;
  for (const std::string& model : words_in(input.parameters.text("models"))) {
    const auto wanted = [&](const std::string& resolution) {
      return input.wants("difference", label_of(model, resolution, kPrintedRule)) ||
             input.wants("difference", label_of(model, resolution, kSigns));
    };
    const std::vector<std::string> resolutions = words_in(input.parameters.text("resolutions"));
    if (std::ranges::none_of(resolutions, wanted)) continue;
    const PolygonMesh mesh = input.tables.load(model, input.context).mesh, copy = moved_aside(mesh);
    for (const std::string& resolution : resolutions) {
      if (!wanted(resolution)) continue;
      input.context.progress(model + " " + resolution, 0.0);
      RunContext child = child_context(input.context, false);
      const double voxel_size = bounds(mesh).size().maxCoeff() / std::stod(resolution);
      const FloatHermite a = sampled(mesh, voxel_size, input, child),
                         b = sampled(copy, voxel_size, input, child);
      const auto packed = [&](const FloatHermite& data) { return to_dense<ThesisVoxel>(data, child); };
      rows.push_back(row_of(model, resolution, kPrintedRule,
                            combine(Boolean::subtract, packed(a), packed(b), child), input.context));
      rows.push_back(
          row_of(model, resolution, kSigns, packed(combine(Boolean::subtract, a, b, child)), input.context));
    }
  }
  return rows;
}

}  // namespace hermesh
