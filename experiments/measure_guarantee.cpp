// What manifold dual contouring promises, judged on the files that it writes: models, clean and dirty, and noise.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <sstream>
#include <tuple>

#include "algorithms/core/mesh_file.h"
#include "experiments/cell.h"
#include "experiments/guarantee_columns.h"
#include "experiments/measure.h"
#include "experiments/measurements.h"
#include "experiments/run_cells.h"
#include "experiments/test_volumes.h"
#include "validation/mesh_report.h"

namespace hermesh {
namespace {

constexpr const char* kGuaranteed = "manifold-dual-contouring";

/// What the bound may be exceeded by, in voxels: the slack of the extractor's own proof, and the gap of the judge's.
constexpr double kSlack = 0.01, kGap = 0.001;

/// Single precision in the file moves points by less than this, in voxels.
constexpr double kRounding = 1e-4;

/// Certifying the distance takes minutes beyond.
constexpr int kFinestCertified = 200;

struct Contender {
  const char* name;
  std::map<std::string, std::string> options;
};
const std::vector<Contender>& others() {
  static const std::vector<Contender> table = {{"adaptive-dual-contouring", {{"threshold", "0.1"}}},
                                               {"dual-contouring", {}},
                                               {"marching-cubes", {}},
                                               {"openvdb", {{"adaptivity", "0.1"}}}};
  return table;
}

/// Open and self-intersecting models take part, because the promise is made for every input: whatever the polygons,
/// there is a level set, and its surface is closed.
std::vector<std::string> models() {
  const std::vector<std::string> excluded = {
      "thai-statue",       // its file is not in every data folder, and the stand-in has nine million triangles
      "noise-sphere-10m",  // the surface of noise-sphere-1m, and at these resolutions the same level set
      "all-degenerate",    // seven triangles without area enclose nothing: there is no mesh to judge
  };
  std::vector<std::string> names = case_choices();
  std::erase_if(names, [&](const std::string& name) { return std::ranges::count(excluded, name) > 0; });
  return names;
}

std::vector<std::string> chosen_cases(const std::string& choice) {
  if (choice == "few") return {"turned-cube", "torus", "cad-part"};
  if (choice == "all") return models();
  return {choice};
}

std::vector<double> numbers(const std::string& text) {
  std::istringstream words(text);
  std::vector<double> result;
  for (double number; words >> number;) result.push_back(number);
  return result;
}

/// The mesh as its file holds it: rounding on the way is part of the promise.
MeshFile as_written(const PolygonMesh& mesh, RunContext& context) {
  if (mesh.empty()) return {};
  const auto path = std::filesystem::temp_directory_path() / ("hermesh-guarantee-" + std::to_string(getpid()) + ".ply");
  struct Removal {
    std::filesystem::path path;
    ~Removal() {
      std::error_code ignored;
      std::filesystem::remove(path, ignored);
    }
  } removal{path};
  write_mesh(path, mesh, context);
  return read_mesh_file(path, context);
}

void set_counts(Json& values, const validation::MeshReport& report) {
  values["boundary"] = report.boundary_edges;
  values["non_manifold_edges"] = report.non_manifold_edges;
  values["non_manifold_vertices"] = report.non_manifold_vertices;
  values["inconsistent"] = report.inconsistent_edges;
  values["degenerate"] = report.degenerate_polygons;
  values["self_intersections"] = report.self_intersections ? report.self_intersections->pairs : 0;
  values["components"] = report.components;
  values["euler"] = report.euler_characteristic;
}

std::vector<std::string> violations_of(const Json& values, double tolerance) {
  std::vector<std::string> result;
  for (const char* defect : {"boundary", "non_manifold_edges", "non_manifold_vertices", "inconsistent", "degenerate",
                             "self_intersections"})
    if (values[defect] > 0) result.push_back(std::string(defect) + " " + values[defect].dump());
  if (values.value("same_topology", "yes") != "yes")
    result.push_back("other topology than the uniform mesh");
  for (const char* way : {"from_upper", "to_upper"})
    if (values.contains(way) && values[way] > tolerance + kSlack)
      result.push_back(std::string(way) + " " + values[way].dump() + " beyond the tolerance");
  return result;
}

/// A level set and what its meshes are called.
struct Subject {
  std::string table, label;
  LevelSet level_set;
  const PolygonMesh* source = nullptr;
  double voxel_size = 1.0;
  Json values = Json::object();  ///< that its rows begin with
  bool certify = false;
};

/// What becomes of one extractor at one tolerance over all subjects of a table.
struct Sum {
  std::int64_t meshes = 0, triangles = 0, self_intersections = 0, violations = 0, beyond = 0;
  double seconds = 0.0, largest_share = 0.0;
};

class Guarantee {
 public:
  explicit Guarantee(const MeasurementInput& input)
      : input_(input), tolerances_(numbers(input.parameters.text("tolerances"))) {}

  std::vector<MeasuredRow> run() {
    for (const std::string& name : chosen_cases(input_.parameters.text("cases"))) measure_model(name);
    for (int i = 0; i < int(input_.parameters.number("noise_fields")); ++i) measure_noise(i);
    summarise();
    return std::move(rows_);
  }

 private:
  /// The rows that the filter throws away need not be made: models are left out here and not after hours.
  bool wanted(const std::string& table, const std::string& label) const {
    return ("guarantee/" + table + "/" + label).find(input_.filter) != std::string::npos;
  }

  void measure_model(const std::string& name) {
    if (!wanted("models", name)) return;
    const LoadedCase loaded = input_.tables.load(name, input_.context);
    const Voxelizer& voxelizer = find_variant(input_.tables.voxelizers, "hermesh");
    const bool stand_in = loaded.origin.starts_with("stand-in");
    const bool certify = input_.parameters.is("certify", "yes");
    for (const double resolution : numbers(input_.parameters.text("resolutions"))) {
      input_.context.progress(name + " at " + readable(resolution), 0.0);
      const double size = bounds(loaded.mesh).size().maxCoeff() / resolution;
      RunContext child = child_context(input_.context, false);
      const VoxelizationInput what = {.mesh = loaded.mesh,
                                      .voxel_size = size,
                                      .context = child,
                                      .options = Options(voxelizer.name, voxelizer.options, {})};
      std::optional<LevelSet> level_set;
      if (const auto failure = attempt([&] { level_set = voxelizer.voxelize(what); }))
        rows_.push_back({"models", name, {{"resolution", int(resolution)}}, {*failure}});
      else
        measure_all({"models", name, *level_set, &loaded.mesh, size,
                     Json{{"resolution", int(resolution)}, {"stand_in", stand_in ? "yes" : "no"}},
                     certify && resolution <= kFinestCertified});
    }
  }

  /// Even fields are uniform in [−1, 1], odd ones whole numbers, a third of them on the surface; outside all around.
  void measure_noise(int number) {
    const std::string label = (number % 2 == 0 ? "uniform " : "whole ") + std::to_string(number);
    if (!wanted("noise", label)) return;
    input_.context.progress("noise " + label, 0.0);
    const int n = int(input_.parameters.number("noise_size"));
    // Of each field its own, so that a field that breaks a promise can be made again alone.
    std::mt19937_64 random(input_.seed + std::uint64_t(number));
    std::uniform_real_distribution<float> value(-1.0f, 1.0f);
    std::uniform_int_distribution<int> whole(-1, 1);
    const LevelSet field = make_volume({n, n, n}, 1.0f, [&](int, int, int) {
      return number % 2 == 0 ? value(random) : static_cast<float>(whole(random));
    });
    Subject subject = {"noise", label, field};
    subject.certify = input_.parameters.is("certify", "yes");
    measure_all(subject);
  }

  void measure_all(const Subject& subject) {
    reference_ = {};
    reference_report_.reset();
    for (std::size_t i = 0; i <= tolerances_.size(); ++i) {
      const double tolerance = i == 0 ? 0.0 : tolerances_[i - 1];
      add_row(subject, {kGuaranteed, {{"tolerance", readable_exactly(tolerance)}}}, tolerance);
    }
    for (const Contender& other : others()) add_row(subject, other, std::nullopt);
  }

  static std::string readable_exactly(double number) {
    std::ostringstream text;
    text << number;
    return text.str();
  }

  void add_row(const Subject& subject, const Contender& contender, std::optional<double> tolerance) {
    MeasuredRow row{subject.table, subject.label, subject.values};
    row.values["extractor"] = contender.name;
    if (tolerance) row.values["tolerance"] = *tolerance;
    std::vector<std::string> violations;
    if (const auto failure = attempt([&] { fill(row.values, subject, contender, tolerance); }))
      violations = {*failure};
    else
      violations = violations_of(row.values, tolerance.value_or(0.0));
    add_to_sum(row, tolerance, !violations.empty());
    // The others promise less; their defects are figures.
    if (tolerance) row.broken = std::move(violations);
    rows_.push_back(std::move(row));
  }

  void fill(Json& values, const Subject& subject, const Contender& contender, std::optional<double> tolerance) {
    RunContext child = child_context(input_.context, false);
    const Extractor& extractor = find_variant(input_.tables.extractors, contender.name);
    const Options options(extractor.name, extractor.options, contender.options);
    PolygonMesh mesh;
    values["seconds"] = timed([&] {
      mesh = extractor.extract(
          {.level_set = subject.level_set, .source = subject.source, .options = options, .context = child});
    });
    values["triangles"] = mesh.triangle_count();
    if (tolerance)
      for (const auto& [name, value] : child.figures)
        if (std::ranges::count(kFigures, name) > 0) values[name] = value;
    judge(values, as_written(mesh, child), subject, tolerance, child);
  }

  void judge(Json& values, MeshFile written, const Subject& subject, std::optional<double> tolerance,
             RunContext& context) {
    // The distances over samples, which come along with the certificate, are not wanted.
    validation::JudgeOptions options = {.self_intersections = true, .libraries = false, .samples = 1};
    if (tolerance.value_or(0.0) > 0 && subject.certify && !written.points.empty() && !reference_.points.empty()) {
      options.reference = &reference_;
      options.certify = true;
      options.certify_gap = kGap * subject.voxel_size;
    }
    const validation::MeshReport report = validation::judge(written, options, context);
    set_counts(values, report);
    if (const auto &from = report.certified_from_reference, &to = report.certified_to_reference; from && to) {
      values["from_upper"] = from->upper / subject.voxel_size;
      values["to_upper"] = to->upper / subject.voxel_size;
      values["lower"] = std::max(from->lower, to->lower) / subject.voxel_size;
    }
    if (tolerance && *tolerance == 0) {
      reference_ = std::move(written);
      reference_report_ = report;
    } else if (tolerance && reference_report_) {
      const bool same = report.components == reference_report_->components &&
                        report.euler_characteristic == reference_report_->euler_characteristic;
      values["same_topology"] = same ? "yes" : "no";
    }
  }

  void add_to_sum(const MeasuredRow& row, std::optional<double> tolerance, bool violates) {
    Sum& sum = sums_[{row.table, row.values["extractor"].get<std::string>(), tolerance.value_or(-1.0)}];
    ++sum.meshes;
    sum.violations += violates;
    sum.triangles += row.values.value("triangles", std::int64_t(0));
    sum.self_intersections += row.values.value("self_intersections", std::int64_t(0));
    sum.seconds += row.values.value("seconds", 0.0);
    const double upper = std::max(row.values.value("from_upper", 0.0), row.values.value("to_upper", 0.0));
    if (tolerance.value_or(0.0) <= 0) return;
    sum.largest_share = std::max(sum.largest_share, upper / *tolerance);
    sum.beyond += row.values.value("lower", 0.0) > *tolerance + kRounding;
  }

  void summarise() {
    std::int64_t violations = 0, meshes = 0;
    for (const auto& [key, sum] : sums_) {
      const auto& [table, extractor, tolerance] = key;
      MeasuredRow row{"summary", table + ", " + extractor};
      row.values = {{"meshes", sum.meshes},     {"triangles", sum.triangles},
                    {"seconds", sum.seconds},   {"self_intersections", sum.self_intersections},
                    {"violations", sum.violations}};
      if (tolerance >= 0) row.values["tolerance"] = tolerance;
      if (sum.largest_share > 0) row.values["largest_share"] = sum.largest_share;
      if (sum.largest_share > 0) row.values["beyond"] = sum.beyond;
      if (tolerance >= 0) meshes += sum.meshes;
      if (tolerance >= 0) violations += sum.violations;
      rows_.push_back(std::move(row));
    }
    rows_.push_back(
        {"summary", std::string("all of ") + kGuaranteed, {{"meshes", meshes}, {"violations", violations}}});
  }

  static inline const std::vector<std::string> kFigures = {"cells", "several_sheets", "held_cells", "fanned_edges",
                                                           "escaped"};

  const MeasurementInput& input_;
  std::vector<double> tolerances_;
  MeshFile reference_;  ///< the subject's uniform mesh
  std::optional<validation::MeshReport> reference_report_;
  std::map<std::tuple<std::string, std::string, double>, Sum> sums_;
  std::vector<MeasuredRow> rows_;
};

}  // namespace

Measurement guarantee_measurement() {
  std::vector<std::string> cases = case_choices();
  cases.insert(cases.begin(), {"few", "all"});
  return {.name = "guarantee",
          .summary = "what manifold dual contouring promises, on models and on noise",
          .parameters = {{"cases", "few", "three small ones, all models, or one case", cases},
                         {"resolutions", "50", "voxels along the longest side",
                          {"30", "50", "100", "200", "50 100", "50 100 200"}},
                         {"tolerances", "0.1 1", "of the adaptive meshes, in voxels",
                          {"0.1", "1", "0.1 1", "0.05 0.1 0.25 0.5 1 2"}},
                         {"certify", "yes", "whether distances are bounded, up to 200 voxels", {"yes", "no"}},
                         {"noise_fields", "4", "random volumes, every second of whole numbers", {}, 0, 100000},
                         {"noise_size", "10", "samples along each side of them", {}, 2, 256}},
          .tables = {{"models", "meshes of models, as their files hold them", "case", guarantee_mesh_columns()},
                     {"noise", "meshes of noise", "field", guarantee_mesh_columns(), false},
                     {"summary", "how many break a promise", "what", guarantee_summary_columns()}},
          .measure = [](const MeasurementInput& input) { return Guarantee(input).run(); }};
}

}  // namespace hermesh
