// What manifold dual contouring promises, judged on the files that it writes: models, clean and dirty, noise,
// and patterns of signs.
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <sstream>
#include <tuple>
#include <utility>

#include "experiments/cases/sha256.h"
#include "experiments/cases/test_volumes.h"
#include "experiments/harness/cell.h"
#include "experiments/harness/run_cells.h"
#include "experiments/harness/solid_columns.h"
#include "experiments/measure.h"
#include "experiments/measurements/guarantee_columns.h"
#include "experiments/measurements/measurements.h"
#include "experiments/pipeline.h"
#include "validation/solid_comparison.h"

namespace hermesh {
namespace {

constexpr const char *kGuaranteed = "manifold-dual-contouring", *kOctree = "certified-octree";

/// The gap between the two ends of a certified distance, in voxels.
constexpr double kLargestGap = 0.001;

/// Enough for a hundredth of a solid; there are thousands of meshes.
constexpr std::int64_t kSolidSamples = 20'000;

/// Single precision in the file moves points by less than this, in voxels.
constexpr double kRounding = 1e-4;

/// Certifying the distance takes minutes beyond.
constexpr int kFinestCertified = 200;
/// Volumes of noise and patterns up to so many samples along a side.
constexpr int kLargestCertified = 32;

struct GuaranteedMethod {
  const char* name;
  GivenOptions options;
};
const std::vector<GuaranteedMethod>& others() {
  static const std::vector<GuaranteedMethod> table = {
      {"adaptive-dual-contouring", {{"threshold", "0.1"}, {"representation", "sparse-float"}}},
      {"dual-contouring", {}},
      {"marching-cubes", {}},
      {"openvdb", {{"adaptivity", "0.1"}}}};
  return table;
}

/// Open and self-intersecting models take part, because the promise is made for every input: whatever the
/// polygons, there is a level set, and its surface is closed.
std::vector<std::string> models() {
  const std::vector<std::string> excluded = {
      "thai-statue",  // its file is not in every data folder, and the stand-in has nine million triangles
      "noise-sphere-10m",  // the surface of noise-sphere-1m, and at these resolutions the same level set
      "all-degenerate",    // seven triangles without area enclose nothing: there is no mesh to judge
  };
  std::vector<std::string> names = case_choices();
  std::erase_if(names, [&](const std::string& name) { return std::ranges::count(excluded, name) > 0; });
  return names;
}

/// The cases that are made at 400 voxels, too: three scans, one of them open and in pieces, and three parts.
bool is_made_finer(const std::string& name) {
  static const std::vector<std::string> names = {"bunny-closed", "nefertiti",  "dragon",
                                                 "fandisk",      "rocker-arm", "casting"};
  return std::ranges::count(names, name) > 0;
}

std::vector<std::string> chosen_cases(const std::string& choice) {
  if (choice == "few") return {"turned-cube", "torus", "cad-part"};
  if (choice == "all") return models();
  return {choice};
}

/// Digits of a SHA-256 that are kept: of all meshes of all runs no two agree in them by chance.
constexpr std::size_t kDigestDigits = 16;

void set_defects(Json& values, const validation::MeshReport& report) {
  values["boundary"] = report.boundary_edges;
  values["non_manifold_edges"] = report.non_manifold_edges;
  values["non_manifold_vertices"] = report.non_manifold_vertices;
  values["inconsistent"] = report.inconsistent_edges;
  values["degenerate"] = report.degenerate_polygons;
  values["self_intersections"] = report.self_intersections ? report.self_intersections->pairs : 0;
  values["components"] = report.components;
  values["euler"] = report.euler_characteristic;
}

/// States no number for meshes that nobody judged, unless some could not be made.
void set_violations(Json& values, std::int64_t violations, bool judged) {
  if (judged || violations > 0) values["violations"] = violations;
}

/// A level set and what its meshes are called.
struct Subject {
  std::string kind, label;
  LevelSet level_set;
  int resolution = 0;
  const PolygonMesh* source = nullptr;
  double voxel_size = 1.0;
  bool certify = false;
};

/// What becomes of one extractor at one tolerance over all subjects of a kind.
struct GuaranteeSum {
  std::int64_t meshes = 0, triangles = 0, self_intersections = 0, violations = 0, beyond = 0;
  double seconds = 0.0, largest_share = 0.0;

  void add(const GuaranteeSum& other) {
    meshes += other.meshes;
    triangles += other.triangles;
    self_intersections += other.self_intersections;
    violations += other.violations;
    beyond += other.beyond;
    seconds += other.seconds;
    largest_share = std::max(largest_share, other.largest_share);
  }
};

/// Sums by kind of subject, extractor and tolerance (−1 for extractors that have none).
using GuaranteeSums = std::map<std::tuple<std::string, std::string, double>, GuaranteeSum>;

/// What becomes of one subject at all tolerances, and of the others.
struct Overview {
  const Subject& subject;
  std::int64_t meshes = 0;
  Json values = Json::object();
  double seconds = 0.0, held = 0.0;
  std::optional<double> excess = {};  ///< none where no distance was bounded
  std::vector<std::string> broken = {};
  std::string digests = {};

  void add(const Json& mesh, double tolerance, const std::vector<std::string>& violations) {
    ++meshes;
    seconds += mesh.value("seconds", 0.0);
    held = std::max(held, 100.0 * mesh.value("held_cells", 0.0) / std::max(1.0, mesh.value("cells", 0.0)));
    digests += mesh.value("digest", "");
    if (mesh.contains("triangles") && tolerance == 0.0) values["uniform"] = mesh["triangles"];
    if (mesh.contains("triangles") && tolerance == 1.0) values["adaptive"] = mesh["triangles"];
    for (const char* way : {"from_upper", "to_upper"})
      if (mesh.contains(way))
        excess = std::max(excess.value_or(-tolerance), mesh[way].get<double>() - tolerance);
    for (const std::string& violation : violations)
      broken.push_back("tolerance " + readable(tolerance) + ": " + violation);
  }
  /// Adds what counts of another extractor: edges and vertices that are not manifold, or open, and pairs of
  /// triangles that intersect.
  void add_other(const std::string& name, const Json& mesh) {
    const auto count = [&](const char* defect) { return mesh.value(defect, std::int64_t(0)); };
    const std::int64_t topology = count("boundary") + count("non_manifold_edges") +
                                  count("non_manifold_vertices") + count("inconsistent");
    values[name] = std::to_string(topology) + ", " + std::to_string(count("self_intersections"));
  }
  MeasuredRow row(bool judged) const {
    MeasuredRow result{subject.kind, subject.label, {{"resolution", subject.resolution}, {"meshes", meshes}}};
    set_violations(result.values, std::int64_t(broken.size()), judged);
    result.values.update(values);
    if (excess) result.values["excess"] = *excess;
    result.values["held_percent"] = held;
    result.values["seconds"] = seconds;
    result.values["digest"] = sha256_of_text(digests).substr(0, kDigestDigits);
    result.broken = broken;
    return result;
  }
};

bool is_octree(const MeasurementInput& input) { return input.parameters.is("extractor", kOctree); }
const char* judged_name(const MeasurementInput& input) { return is_octree(input) ? kOctree : kGuaranteed; }

/// What the labels of rows end with, so that rows of other parameters can stand side by side.
std::string label_end(const MeasurementInput& input) {
  std::string end;
  if (is_octree(input)) end += ", octree";
  if (input.parameters.is("placement", "average")) end += ", means";
  if (!input.parameters.is("largest_cube", "8")) end += ", cubes of " + input.parameters.text("largest_cube");
  if (input.parameters.is("representation", "sparse")) end += ", packed";
  return end;
}

/// The meshes of one subject after another.
class SubjectMeasurement {
 public:
  explicit SubjectMeasurement(const MeasurementInput& input)
      : input_(input),
        tolerances_(numbers_in(input.parameters.text("tolerances"))),
        judged_(input.parameters.is("judge", "yes")) {}

  std::vector<MeasuredRow> rows;
  GuaranteeSums sums;

  void measure_model(const std::string& name, double resolution) {
    RunContext child = child_context(input_.context, false);
    const LoadedCase loaded = input_.tables.load(name, child);
    const VoxelizeRecipe recipe{.chosen = choose(input_.tables.voxelizers, "hermesh"),
                                .resolution = resolution};
    const std::string label = name + (loaded.origin.starts_with("stand-in") ? ", stand-in" : "");
    std::optional<LevelSet> level_set;
    if (const auto failure = attempt([&] { level_set = voxelize(loaded.mesh, recipe, child); }))
      rows.push_back({"models", label, {{"resolution", int(resolution)}}, {*failure}});
    else
      measure_all({"models", label, *level_set, int(resolution), &loaded.mesh,
                   voxel_size_of(recipe, loaded.mesh),
                   input_.parameters.is("certify", "yes") && resolution <= kFinestCertified});
  }

  /// Even fields are uniform in [−1, 1], odd ones whole numbers, a third of them on the surface; outside all
  /// around.
  void measure_noise(int number, int n, const std::string& label) {
    // Of each field its own, so that a field that breaks a promise can be made again alone.
    std::mt19937_64 random(input_.seed + std::uint64_t(number));
    std::uniform_real_distribution<float> value(-1.0f, 1.0f);
    std::uniform_int_distribution<int> whole(-1, 1);
    measure_all({"noise", label,
                 make_volume({n, n, n}, 1.0f,
                             [&](int, int, int) {
                               return number % 2 == 0 ? value(random) : static_cast<float>(whole(random));
                             }),
                 n, nullptr, 1.0, input_.parameters.is("certify", "yes") && n <= kLargestCertified});
  }

  /// The first field has the 256 patterns of one cell's corners, some twice; the others random ones of 2 × 2
  /// × 2 cells.
  void measure_patterns(int number, const std::string& label) {
    const int given = int(input_.parameters.number("patterns_per_axis"));
    const int per_axis = number == 0 ? 7 : given;  // 7³ is the first cube above 256
    std::mt19937 random(std::uint32_t(input_.seed) + std::uint32_t(number));
    const auto pattern = [&](int i) {
      return number == 0 ? std::uint32_t(i % 256) : std::uint32_t(random());
    };
    const int size = number == 0 ? 2 : 3;
    measure_all({"patterns", label, make_patterns(per_axis, size, pattern, random), per_axis, nullptr, 1.0,
                 input_.parameters.is("certify", "yes") && per_axis * (size + 1) <= kLargestCertified});
  }

 private:
  void measure_all(Subject subject) {
    subject.label += label_end(input_);
    source_.reset();
    if (judged_ && subject.source) {
      RunContext child = child_context(input_.context, false);
      source_.emplace(to_mesh_file(*subject.source), child);
    }
    Overview overview{subject};
    for (std::size_t i = 0; i <= tolerances_.size(); ++i) {
      const double tolerance = i == 0 ? 0.0 : tolerances_[i - 1];
      GuaranteedMethod ours = {judged_name(input_),
                               {{"tolerance", readable_exactly(tolerance)},
                                {"placement", input_.parameters.text("placement")},
                                {"representation", input_.parameters.text("representation")}}};
      if (is_octree(input_)) ours.options["largest_cube"] = input_.parameters.text("largest_cube");
      const MeasuredRow& row = add_row(subject, ours, tolerance);
      overview.add(row.values, tolerance, row.broken);
    }
    if (judged_ && input_.parameters.is("others", "yes"))
      for (const GuaranteedMethod& other : others())
        overview.add_other(other.name, add_row(subject, other, std::nullopt).values);
    rows.push_back(overview.row(judged_));
    source_.reset();
    reference_ = {};  // of hundreds of subjects it would be gigabytes
    reference_report_.reset();
  }

  static std::string readable_exactly(double number) {
    std::ostringstream text;
    text << number;
    return text.str();
  }

  const MeasuredRow& add_row(const Subject& subject, const GuaranteedMethod& contender,
                             std::optional<double> tolerance) {
    MeasuredRow row{"meshes", subject.label, {{"resolution", subject.resolution}}};
    row.values["extractor"] = contender.name;
    if (tolerance) row.values["tolerance"] = *tolerance;
    std::vector<std::string> violations;
    if (const auto failure = attempt([&] { violations = fill(row.values, subject, contender, tolerance); }))
      violations = {*failure};
    add_to_sum(subject.kind, row, tolerance, !violations.empty());
    // The others promise less; their defects are figures.
    if (tolerance) row.broken = std::move(violations);
    rows.push_back(std::move(row));
    return rows.back();
  }

  /// What it breaks of the promises.
  std::vector<std::string> fill(Json& values, const Subject& subject, const GuaranteedMethod& contender,
                                std::optional<double> tolerance) {
    RunContext child = child_context(input_.context, false);
    Outcome outcome = run(job_of(subject, contender, tolerance), child);
    values["seconds"] = outcome.extract_seconds;
    values["triangles"] = outcome.made.mesh.triangle_count();
    values["digest"] = sha256_of_mesh(outcome.made.mesh).substr(0, kDigestDigits);
    if (tolerance)
      for (const auto& [name, value] : child.figures)
        if (std::ranges::count(kFigures, name) > 0) values[name] = value;
    if (judged_) describe(values, outcome, subject, tolerance, child);
    return outcome.judgement.promises.broken;
  }

  Job job_of(const Subject& subject, const GuaranteedMethod& contender,
             std::optional<double> tolerance) const {
    Job job{.source = {.polygons = subject.source, .volume = &subject.level_set},
            .extract = {.chosen = choose(input_.tables.extractors, contender.name, contender.options)},
            .format = ".ply"};
    // What the others would break of our promises is counted, though they promise less.
    job.extract.chosen.extractor.promises = find_variant(input_.tables.extractors, kGuaranteed).promises;
    if (!judged_) return job;
    // The distances over samples, which come along with the certificate, are not wanted.
    job.judge = {.self_intersections = true, .libraries = false, .samples = 1, .solid_samples = 0};
    if (!tolerance) return job;
    job.circumstances.bound = Circumstances::Bound{*tolerance, subject.voxel_size};
    if (*tolerance == 0) return job;
    if (reference_report_) job.circumstances.bound->uniform = &*reference_report_;
    if (subject.certify && !reference_.points.empty()) {
      job.judge->reference = &reference_;
      job.judge->reference_quads = validation::QuadRule::as_given;
      job.judge->certify = true;
      job.judge->certify_gap = kLargestGap * subject.voxel_size;
    }
    return job;
  }

  void describe(Json& values, Outcome& outcome, const Subject& subject, std::optional<double> tolerance,
                RunContext& context) {
    const validation::MeshReport& report = outcome.judgement.report;
    set_defects(values, report);
    if (source_) compare_with_source(values, outcome.written, subject, tolerance.value_or(0.0), context);
    if (const auto& from = report.certified_from_reference, &to = report.certified_to_reference; from && to) {
      values["from_upper"] = from->upper / subject.voxel_size;
      values["to_upper"] = to->upper / subject.voxel_size;
      values["lower"] = std::max(from->lower, to->lower) / subject.voxel_size;
    }
    if (tolerance && *tolerance == 0) {
      reference_ = std::move(outcome.written);
      reference_report_ = report;
    } else if (tolerance && reference_report_) {
      const bool same = report.components == reference_report_->components &&
                        report.euler_characteristic == reference_report_->euler_characteristic;
      values["same_topology"] = same ? "yes" : "no";
    }
  }

  /// The promise is about the level set; whether that has the solid of the polygons is a figure.
  void compare_with_source(Json& values, const MeshFile& written, const Subject& subject, double tolerance,
                           RunContext& context) const {
    const double explained = (1.0 + tolerance) * subject.voxel_size;
    set_solid(values,
              source_->compare(written, {.samples = kSolidSamples, .voxel_size = explained}, context));
  }

  void add_to_sum(const std::string& kind, const MeasuredRow& row, std::optional<double> tolerance,
                  bool violates) {
    GuaranteeSum& sum = sums[{kind, row.values["extractor"].get<std::string>(), tolerance.value_or(-1.0)}];
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

  static inline const std::vector<std::string> kFigures = {"cells", "several_sheets", "held_cells",
                                                           "fanned_edges", "escaped"};

  const MeasurementInput& input_;
  const std::vector<double> tolerances_;
  const bool judged_;
  std::optional<validation::SolidReference> source_;  ///< the polygons of a model
  MeshFile reference_;                                ///< the subject's uniform mesh
  std::optional<validation::MeshReport> reference_report_;
};

/// Subjects side by side, for most of what is done to one is not parallel. Their rows are emitted in the
/// order of subjects.
class Guarantee {
 public:
  explicit Guarantee(const MeasurementInput& input) : input_(input) {}

  std::vector<MeasuredRow> run() {
    list_models();
    list_noise();
    list_patterns();
    for (std::size_t i = 0; i < work_.size(); ++i) results_.emplace_back(input_);
    std::vector<std::atomic<bool>> ready(work_.size());
    std::atomic<std::size_t> next = 0;
    std::size_t emitted = 0;
    std::exception_ptr failure;
    const auto work = [&] {
      for (std::size_t i; (i = next++) < work_.size();) {
        input_.context.check();
        // Isolated, so that a thread that waits for a part of one subject begins no other one meanwhile.
        tbb::this_task_arena::isolate([&] { work_[i].measure(results_[i]); });
        ready[i] = true;
        const std::lock_guard lock(output_);
        for (; emitted < work_.size() && ready[emitted]; ++emitted) emit(emitted);
        input_.context.progress(work_[i].name, double(++done_) / double(work_.size()));
      }
    };
    tbb::task_group group;
    for (int worker = 0; worker < tbb::this_task_arena::max_concurrency(); ++worker)
      group.run([&] {
        // An exception that the group saw would end the loops of other subjects halfway, without a word to
        // them.
        try {
          work();
        } catch (...) {
          const std::lock_guard lock(output_);
          if (!failure) failure = std::current_exception();
        }
      });
    group.wait();
    if (failure) {  // what is ready is not lost because something before it is not
      for (; emitted < work_.size(); ++emitted)
        if (ready[emitted]) emit(emitted);
      std::rethrow_exception(failure);
    }
    std::vector<MeasuredRow> rows;
    GuaranteeSums sums;
    for (const SubjectMeasurement& result : results_)
      for (const auto& [key, sum] : result.sums) sums[key].add(sum);
    summarise(sums, input_.parameters.is("judge", "yes"), rows);
    return rows;
  }

 private:
  struct Work {
    std::string name;
    std::function<void(SubjectMeasurement&)> measure;
  };

  void list_models() {
    for (const std::string& name : chosen_cases(input_.parameters.text("cases"))) {
      if (!input_.wants("models", name + label_end(input_))) continue;
      std::vector<double> resolutions = numbers_in(input_.parameters.text("resolutions"));
      if (is_made_finer(name) && input_.parameters.is("finer", "yes")) resolutions.push_back(400);
      for (const double resolution : resolutions)
        work_.push_back({name + " at " + readable(resolution),
                         [=](SubjectMeasurement& subject) { subject.measure_model(name, resolution); }});
    }
  }

  /// Every pair of fields has the next one of the sizes.
  void list_noise() {
    const std::vector<double> sizes = numbers_in(input_.parameters.text("noise_sizes"));
    for (int i = 0; i < int(input_.parameters.number("noise_fields")); ++i) {
      const std::string label = (i % 2 == 0 ? "uniform " : "whole ") + three_digits(i);
      const int n = int(sizes[std::size_t(i / 2) % sizes.size()]);
      if (input_.wants("noise", label + label_end(input_)))
        work_.push_back(
            {"noise " + label, [=](SubjectMeasurement& subject) { subject.measure_noise(i, n, label); }});
    }
  }

  void list_patterns() {
    for (int i = 0; i < int(input_.parameters.number("pattern_fields")); ++i) {
      const std::string label = (i == 0 ? "cells " : "random ") + three_digits(i);
      if (input_.wants("patterns", label + label_end(input_)))
        work_.push_back(
            {"patterns " + label, [=](SubjectMeasurement& subject) { subject.measure_patterns(i, label); }});
    }
  }

  static std::string three_digits(int number) {
    const std::string digits = std::to_string(number);
    return std::string(digits.size() < 3 ? 3 - digits.size() : 0, '0') + digits;
  }

  void emit(std::size_t i) { input_.emit(std::exchange(results_[i].rows, {})); }

  void summarise(const GuaranteeSums& sums, bool judged, std::vector<MeasuredRow>& rows) {
    std::int64_t violations = 0, meshes = 0;
    for (const auto& [key, sum] : sums) {
      const auto& [kind, extractor, tolerance] = key;
      MeasuredRow row{"summary", kind + ", " + extractor};
      row.values = {{"meshes", sum.meshes}, {"triangles", sum.triangles}, {"seconds", sum.seconds}};
      if (judged) row.values["self_intersections"] = sum.self_intersections;
      set_violations(row.values, sum.violations, judged);
      if (tolerance >= 0) row.values["tolerance"] = tolerance;
      if (sum.largest_share > 0) row.values["largest_share"] = sum.largest_share;
      if (sum.largest_share > 0) row.values["beyond"] = sum.beyond;
      if (tolerance >= 0) meshes += sum.meshes;
      if (tolerance >= 0) violations += sum.violations;
      rows.push_back(std::move(row));
    }
    rows.push_back({"summary", std::string("all of ") + judged_name(input_), {{"meshes", meshes}}});
    set_violations(rows.back().values, violations, judged);
  }

  const MeasurementInput& input_;
  std::vector<Work> work_;
  std::deque<SubjectMeasurement> results_;
  std::mutex output_;
  std::size_t done_ = 0;
};

}  // namespace

Measurement guarantee_measurement() {
  std::vector<std::string> cases = case_choices();
  cases.insert(cases.begin(), {"few", "all"});
  return {
      .name = "guarantee",
      .summary = "what the certified extractors promise, on models and on noise",
      .parameters =
          {{"cases", "few", "three small ones, all models, or one case", cases},
           {"resolutions",
            "50",
            "voxels along the longest side",
            {"30", "50", "100", "200", "50 100", "50 100 200"}},
           {"finer", "no", "whether six named models are made at 400, too", {"yes", "no"}},
           {"tolerances",
            "0.1 1",
            "of the adaptive meshes, in voxels",
            {"0.1", "1", "0.1 1", "0.05 0.1 0.25 0.5 1 2", "2.5 4 8", "2.5 4 8 14"}},
           {"extractor", kGuaranteed, "whose promises are judged", {kGuaranteed, kOctree}},
           {"placement", "unbiased", "option of the extractor", {"unbiased", "optimal", "average"}},
           {"largest_cube", "8", "option of the extractor", {"8", "4", "2"}},
           {"representation", "sparse-float", "option of the extractor", {"sparse-float", "sparse"}},
           {"judge", "yes", "whether meshes are judged, or made for their digests alone", {"yes", "no"}},
           {"certify", "yes", "whether distances are bounded, up to 200 voxels", {"yes", "no"}},
           {"others", "yes", "whether other extractors are judged beside it", {"yes", "no"}},
           {"noise_fields", "4", "random volumes, every second of whole numbers", {}, 0, 1000},
           {"noise_sizes", "10", "samples along each side of them, in turn", {"8", "10", "32", "32 64"}},
           {"pattern_fields", "2", "volumes of patterns of signs", {}, 0, 1000},
           {"patterns_per_axis", "5", "of them along each side of a volume", {}, 1, 40}},
      .tables = {{"models", "models, at all tolerances", "case", guarantee_overview_columns(), true, true},
                 {"noise", "fields of noise, at all tolerances", "field", guarantee_overview_columns(), true,
                  true},
                 {"patterns", "patterns of signs, at all tolerances", "field", guarantee_overview_columns(),
                  true, true},
                 {"meshes", "single meshes, as their files hold them", "subject", guarantee_mesh_columns(),
                  false, true},
                 {"summary", "how many break a promise", "what", guarantee_summary_columns()}},
      .measure = [](const MeasurementInput& input) { return Guarantee(input).run(); }};
}

}  // namespace hermesh
