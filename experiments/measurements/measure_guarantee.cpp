// The guarantees of the certified extractors, verified on the files of their meshes: models, clean and dirty,
// noise, and patterns of signs.
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <atomic>
#include <deque>
#include <exception>
#include <mutex>
#include <random>
#include <tuple>
#include <utility>

#include "experiments/cases/test_volumes.h"
#include "experiments/measurements/measurements.h"
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
/// Largest number of samples along a side of the volumes of noise and patterns that are certified.
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

/// Includes open and self-intersecting models, because the guarantee covers every input: any polygons have a
/// level set, and its surface is closed.
std::vector<std::string> models() {
  const std::vector<std::string> excluded = {
      "thai-statue",  // its file is not in every data directory, and the stand-in has nine million triangles
      "noise-sphere-10m",  // the surface of noise-sphere-1m, and at these resolutions the same level set
      "all-degenerate",    // seven triangles without area enclose nothing: there is no mesh to validate
  };
  std::vector<std::string> names = case_choices();
  std::erase_if(names, [&](const std::string& name) { return std::ranges::count(excluded, name) > 0; });
  return names;
}

/// Cases that are also meshed at 400 voxels: three scans, one of them open and in pieces, and three parts.
const std::set<std::string> kFiner = {"bunny-closed", "nefertiti",  "dragon",
                                      "fandisk",      "rocker-arm", "casting"};

std::vector<std::string> chosen_cases(const std::string& choice) {
  if (choice == "few") return {"turned-cube", "torus", "cad-part"};
  if (choice == "all") return models();
  return {choice};
}

/// Digits of a SHA-256, enough that no two meshes of all runs agree in them by chance.
constexpr std::size_t kDigestDigits = 16;

/// Sets no number for meshes that were not validated, unless some could not be made.
void set_violations(Json& values, std::int64_t violations, bool judged) {
  if (judged || violations > 0) values["violations"] = violations;
}

/// A level set and the label of its meshes.
struct Subject {
  std::string kind, label;
  LevelSet level_set;
  int resolution = 0;
  const PolygonMesh* source = nullptr;
  double voxel_size = 1.0;
  bool certify = false;
};

/// Sums of one extractor at one tolerance over all subjects of a kind.
struct GuaranteeSum {
  std::int64_t meshes = 0, triangles = 0, self_intersections = 0, violations = 0, beyond = 0;
  double seconds = 0.0, largest_share = 0.0;

  /// `tolerance`: none for extractors without one.
  void add(const Json& mesh, std::optional<double> tolerance, bool violates) {
    ++meshes;
    violations += violates;
    triangles += mesh.value("triangles", std::int64_t(0));
    self_intersections += mesh.value("self_intersections", std::int64_t(0));
    seconds += mesh.value("seconds", 0.0);
    if (tolerance.value_or(0.0) <= 0) return;
    const double upper = std::max(mesh.value("from_upper", 0.0), mesh.value("to_upper", 0.0));
    largest_share = std::max(largest_share, upper / *tolerance);
    beyond += mesh.value("lower", 0.0) > *tolerance + kRounding;
  }
};

/// A mesh that was made; the tolerance is none for extractors without one.
struct MadeMesh {
  std::string kind;
  Json values;
  std::optional<double> tolerance;
  bool violates;
};

/// Results of one subject at all tolerances, and of the other extractors.
struct Overview {
  const Subject& subject;
  std::int64_t meshes = 0;
  Json values = Json::object();
  double seconds = 0.0, held = 0.0;
  std::optional<double> excess = {};  ///< none if no distance was bounded
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
  /// Adds another extractor's numbers of open or non-manifold edges and vertices, and of self-intersecting
  /// pairs.
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

/// Returns the end of the labels of rows, which distinguishes rows of different parameters.
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
        tolerances_(words_in("0 " + input.parameters.text("tolerances"))),
        judged_(input.parameters.is("judge", "yes")) {}

  std::vector<MeasuredRow> rows;
  std::vector<MadeMesh> meshes;

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

  /// Even fields are uniform in [−1, 1], odd ones integers, a third of them on the surface; the background is
  /// outside.
  void measure_noise(int number, int n, const std::string& label) {
    // One generator per field, so that a field that violates a guarantee can be reproduced on its own.
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
    for (const std::string& word : tolerances_) {
      const double tolerance = std::stod(word);
      GuaranteedMethod ours = {judged_name(input_),
                               {{"tolerance", word},
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

  const MeasuredRow& add_row(const Subject& subject, const GuaranteedMethod& contender,
                             std::optional<double> tolerance) {
    MeasuredRow row{"meshes", subject.label, {{"resolution", subject.resolution}}};
    row.values["extractor"] = contender.name;
    if (tolerance) row.values["tolerance"] = *tolerance;
    std::vector<std::string> violations;
    if (const auto failure = attempt([&] { violations = fill(row.values, subject, contender, tolerance); }))
      violations = {*failure};
    meshes.push_back({subject.kind, row.values, tolerance, !violations.empty()});
    // Defects of the others are values, since they guarantee less.
    if (tolerance) row.broken = std::move(violations);
    rows.push_back(std::move(row));
    return rows.back();
  }

  /// Returns the violated guarantees.
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
    // The others are checked against our guarantees, although they guarantee less.
    job.extract.chosen.extractor.promises = find_variant(input_.tables.extractors, kGuaranteed).promises;
    if (!judged_) return job;
    // One sample, since only the certified distances are used.
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
    values.update(
        Json{{"boundary", report.boundary_edges},
             {"non_manifold_edges", report.non_manifold_edges},
             {"non_manifold_vertices", report.non_manifold_vertices},
             {"inconsistent", report.inconsistent_edges},
             {"degenerate", report.degenerate_polygons},
             {"self_intersections", report.self_intersections ? report.self_intersections->pairs : 0},
             {"components", report.components},
             {"euler", report.euler_characteristic}});
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

  /// The guarantee concerns the level set; its agreement with the solid of the polygons is a value.
  void compare_with_source(Json& values, const MeshFile& written, const Subject& subject, double tolerance,
                           RunContext& context) const {
    const double explained = (1.0 + tolerance) * subject.voxel_size;
    const validation::SolidComparison solid =
        source_->compare(written, {.samples = kSolidSamples, .voxel_size = explained}, context);
    values["solid"] = validation::verdict_word(solid);
    if (solid.reference_volume.value > 0.0)
      values["solid_difference"] = 100.0 * solid.difference.value / solid.reference_volume.value;
    if (solid.mesh_area > 0.0) values["false_area"] = 100.0 * solid.false_area.value / solid.mesh_area;
  }

  static inline const std::vector<std::string> kFigures = {"cells", "several_sheets", "held_cells",
                                                           "fanned_edges", "escaped"};

  const MeasurementInput& input_;
  const std::vector<std::string> tolerances_;  ///< with 0
  const bool judged_;
  std::optional<validation::SolidReference> source_;  ///< the polygons of a model
  MeshFile reference_;                                ///< the subject's uniform mesh
  std::optional<validation::MeshReport> reference_report_;
};

/// Runs subjects concurrently, since most of the work on one is not parallel. Their rows are emitted in the
/// order of the subjects.
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
        // Isolated, so that a thread that waits within one subject does not start another one.
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
        // An exception that reached the group would end the loops of other subjects halfway.
        try {
          work();
        } catch (...) {
          const std::lock_guard lock(output_);
          if (!failure) failure = std::current_exception();
        }
      });
    group.wait();
    if (failure) {  // finished rows after a missing one are not lost
      for (; emitted < work_.size(); ++emitted)
        if (ready[emitted]) emit(emitted);
      std::rethrow_exception(failure);
    }
    return summary();
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
      if (kFiner.contains(name) && input_.parameters.is("finer", "yes")) resolutions.push_back(400);
      for (const double resolution : resolutions)
        work_.push_back({name + " at " + readable(resolution),
                         [=](SubjectMeasurement& subject) { subject.measure_model(name, resolution); }});
    }
  }

  /// Each pair of fields has the next of the sizes.
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

  /// Returns sums by kind of subject, extractor and tolerance (−1 for none).
  std::vector<MeasuredRow> summary() const {
    const bool judged = input_.parameters.is("judge", "yes");
    std::map<std::tuple<std::string, std::string, double>, GuaranteeSum> sums;
    for (const SubjectMeasurement& result : results_)
      for (const auto& [kind, mesh, tolerance, violates] : result.meshes)
        sums[{kind, mesh["extractor"].get<std::string>(), tolerance.value_or(-1.0)}].add(mesh, tolerance,
                                                                                         violates);
    std::vector<MeasuredRow> rows;
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
    return rows;
  }

  const MeasurementInput& input_;
  std::vector<Work> work_;
  std::deque<SubjectMeasurement> results_;
  std::mutex output_;
  std::size_t done_ = 0;
};

}  // namespace

std::vector<MeasuredRow> measure_guarantee(const MeasurementInput& input) { return Guarantee(input).run(); }

}  // namespace hermesh
