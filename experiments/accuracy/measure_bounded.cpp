// hermesh remesh --error on many models: each mesh is certified by validation, or refused with a reason.
#include <chrono>

#include "algorithms/core/quad_diagonals.h"
#include "algorithms/remesh/bounded_remesh.h"
#include "experiments/harness/cell.h"

namespace hermesh {
namespace {

/// Models of the data folder and generated ones, clean and dirty.
constexpr const char* kFew =
    "turned-cube torus nested-spheres overlapping-spheres cad-part holed-sphere plate";
constexpr const char* kAll =
    "happy-buddha lucy armadillo asian-dragon nefertiti horse laurana fandisk rocker-arm joint cheese block "
    "sharp-sphere "
    "casting gears screw mixer bunny bunny-closed conrod bearing elephant boeing teapot abominevole "
    "many-small-holes "
    "openscad motor-bike dragon dragon-res2 chair moebius all-degenerate turned-cube cube leaning-cube torus "
    "nested-spheres overlapping-spheres cylinder cad-part holed-sphere plate";

class BoundedMeasurer {
 public:
  explicit BoundedMeasurer(const MeasurementInput& input) : input_(input) {}

  void run() {
    const std::vector<std::string> percents = words_in(input_.parameters.text("percents"), '-');
    for (const std::string& name : words_in(input_.parameters.is("models", "few") ? kFew : kAll)) {
      const auto label = [&](const std::string& percent) { return name + ", " + percent + " %"; };
      if (std::ranges::none_of(percents, [&](const auto& p) { return input_.wants("bounded", label(p)); }))
        continue;
      RunContext loading = child_context(input_.context, false);
      const LoadedCase model = input_.tables.load(name, loading);
      PolygonMesh mesh = model.mesh;
      choose_diagonals(mesh);
      for (const std::string& percent : percents) {
        if (!input_.wants("bounded", label(percent))) continue;
        MeasuredRow row{"bounded", label(percent)};
        input_.context.progress(row.label, 0.0);
        row.values["percent"] = std::stod(percent);
        if (const auto failure = attempt([&] { measure(mesh, std::stod(percent) / 100.0, row); }))
          row.values["outcome"] = "refused: " + *failure;
        input_.emit({std::move(row)});
      }
    }
  }

 private:
  void measure(const PolygonMesh& mesh, double share, MeasuredRow& row) {
    BoundedRemeshOptions options{.error = share * bounds(mesh).size().norm()};
    row.values["input_triangles"] = mesh.triangle_count();
    RunContext child = child_context(input_.context, false);
    const auto start = std::chrono::steady_clock::now();
    BoundedMesh made = bounded_remesh(mesh, options, child);
    const auto seconds = [&] {
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    row.values["outcome"] = "certified";
    if (!made.unmet.empty() && made.unmet.front().why == Unmet::hole) {
      options.over_holes = true;
      made = bounded_remesh(mesh, options, child);
      row.values["outcome"] = "certified but for holes";
    }
    row.values["seconds"] = seconds();
    row.values["voxel"] = made.voxel_size / options.error;
    row.values["rounds"] = made.rounds;
    if (!made.unmet.empty()) {
      row.values["outcome"] = "refused: " + explanation(made);
      return;
    }
    row.values["triangles"] = made.mesh.triangle_count();
    row.values["to"] = made.to_surface / options.error;
    row.values["from"] = made.from_surface / options.error;
    row.values["left_out"] = made.left_out_area + made.free_area;
    row.values["holes"] = made.hole_area;
    judge_outcome(mesh, made, options, row);
  }

  void judge_outcome(const PolygonMesh& mesh, const BoundedMesh& made, const BoundedRemeshOptions& options,
                     MeasuredRow& row) {
    RunContext child = child_context(input_.context, false);
    const MeshFile reference = to_mesh_file(mesh);
    const validation::CheckOptions judging{.libraries = false,
                                           .reference = &reference,
                                           .samples = std::int64_t(input_.parameters.number("samples")),
                                           .certify = true,
                                           .solid_samples = 0,
                                           .certify_gap = 0.01 * options.error};
    const Promises all{.closed = true, .manifold = true, .oriented = true, .no_self_intersection = true};
    const Judgement judged = judge(as_written(made.mesh, ".ply", child), all, judging, child);
    const validation::MeshReport& report = judged.report;
    row.values["watertight"] = report.watertight() ? "yes" : "no";
    row.values["judged_to"] = report.certified_to_reference->upper / options.error;
    row.values["judged_from"] = report.certified_from_reference->upper / options.error;
    row.values["sampled_to"] = report.to_reference->max / options.error;
    row.values["sampled_from"] = report.from_reference->max / options.error;
    for (const std::string& broken : judged.promises.broken) row.broken.push_back(broken);
    if (!options.over_holes && report.certified_to_reference->lower > made.to_surface)
      row.broken.push_back("the mesh is farther from the polygons than was proved");
    // Polygons that bound nothing need not be near, and the validator measures from all polygons.
    if (made.left_out_area + made.free_area <= 1e-6 * report.area &&
        report.certified_from_reference->lower > made.from_surface)
      row.broken.push_back("the polygons are farther from the mesh than was proved");
  }

  const MeasurementInput& input_;
};

}  // namespace

std::vector<MeasuredRow> measure_bounded(const MeasurementInput& input) {
  BoundedMeasurer(input).run();
  return std::vector<MeasuredRow>();
}

}  // namespace hermesh
