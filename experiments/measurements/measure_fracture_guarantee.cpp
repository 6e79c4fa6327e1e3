// The guarantees of a fracture, verified on the files that it writes: models, clean and dirty, and random
// solids.
#include <cmath>

#include "experiments/fracture/fracture_folder.h"
#include "experiments/fracture/fracture_subjects.h"
#include "experiments/fracture/fracture_trials.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

std::vector<std::string> fractured_cases(const std::string& choice) {
  if (choice == "none") return {};
  if (choice == "few") return {"torus", "cad-part"};
  if (choice != "all") return {choice};
  const std::set<std::string> excluded = {
      "thai-statue",     // not in every data directory, and the stand-in has nine million triangles
      "all-degenerate",  // seven triangles without area enclose nothing that could be broken
  };
  std::vector<std::string> names;
  for (const CaseInfo& info : list_cases())
    if (info.kind == "file" && !excluded.contains(info.name)) names.push_back(info.name);
  return names;
}

/// Sums over fractures.
struct VolumeSum {
  std::int64_t fractures = 0, pieces = 0, triangles = 0, seams = 0, broken_pieces = 0, crossing = 0,
               unmatched = 0, unbalanced = 0, thinned = 0, changed = 0, forced = 0;
  double volume = 0.0, uncut = 0.0, seconds = 0.0;

  void add(const validation::FractureReport& ledger, const FractureSummary& summary, double uncut_volume) {
    ++fractures;
    pieces += ledger.pieces;
    triangles += ledger.triangles;
    seams += ledger.seam_triangles;
    broken_pieces += ledger.broken_pieces;
    crossing += ledger.intersecting_pairs;
    unmatched += ledger.unmatched_cut + ledger.matched_original + ledger.repeated_triangles;
    unbalanced += !ledger.is_consistent();
    thinned += ledger.lost_a_piece();
    changed += static_cast<std::int64_t>(summary.labelled->repair.changed_samples);
    forced += static_cast<std::int64_t>(summary.labelled->repair.forced_changes);
    volume = std::max(volume, ledger.volume_difference());
    uncut = std::max(uncut, std::abs(ledger.pieces_volume / uncut_volume - 1.0));
    seconds += summary.seconds;
  }
  void add(const VolumeSum& other) {
    fractures += other.fractures, pieces += other.pieces, triangles += other.triangles, seams += other.seams;
    broken_pieces += other.broken_pieces, crossing += other.crossing, unmatched += other.unmatched;
    unbalanced += other.unbalanced, thinned += other.thinned, changed += other.changed,
        forced += other.forced;
    volume = std::max(volume, other.volume), uncut = std::max(uncut, other.uncut), seconds += other.seconds;
  }
  Json values() const {
    return {{"fractures", fractures}, {"pieces", pieces},         {"triangles", triangles},
            {"seams", seams},         {"broken", broken_pieces},  {"crossing", crossing},
            {"unmatched", unmatched}, {"unbalanced", unbalanced}, {"thinned", thinned},
            {"volume", volume},       {"uncut", 100.0 * uncut},   {"changed", changed},
            {"forced", forced},       {"seconds", seconds}};
  }
};

class FractureGuarantee {
 public:
  explicit FractureGuarantee(const MeasurementInput& input) : input_(input) {}

  /// Begins with the coarse ones, so that an interrupted run has seen all models.
  std::vector<MeasuredRow> run() {
    for (const double resolution : numbers_in(input_.parameters.text("resolutions")))
      for (const std::string& name : fractured_cases(input_.parameters.text("cases")))
        measure_model(name, resolution);
    for (int i = 0; i < int(input_.parameters.number("trials")); ++i) measure_trial(i);
    return {{"summary", "models", models_.values()}, {"summary", "trials", trials_.values()}};
  }

 private:
  struct Broken {
    std::string label, cutters;
  };
  std::vector<Broken> fractures_of(const std::string& name) const {
    std::vector<Broken> result;
    for (const std::string& cutters : words_in(input_.parameters.text("cutters")))
      for (const std::string& pieces : words_in(input_.parameters.text("pieces"))) {
        const std::string word = cutters + ":" + pieces;
        if (input_.wants("models", name + ", " + word)) result.push_back({name + ", " + word, word});
      }
    return result;
  }

  /// An object and its mesh before it is broken. Some have no sample inside and thus nothing to break.
  struct Subject {
    FractureObject object;
    PolygonMesh uncut = {};
  };
  Subject subject_of(const PolygonMesh& mesh, double longest) const {
    RunContext child = child_context(input_.context, false);
    Subject subject{sample_subject(mesh, longest, input_).object};
    subject.uncut = uncut_mesh(subject.object, child);
    return subject;
  }

  void measure_model(const std::string& name, double resolution) {
    const std::vector<Broken> all = fractures_of(name);
    if (all.empty()) return;
    input_.context.progress(name + " at " + readable(resolution), 0.0);
    Subject subject;
    const auto failure = attempt([&] {
      RunContext child = child_context(input_.context, false);
      subject = subject_of(input_.tables.load(name, child).mesh, resolution);
    });
    if (failure) return input_.emit({{"models", name, {{"resolution", int(resolution)}}, {*failure}}});
    for (const auto& [label, cutters] : all) {
      MeasuredRow row{"models", label, Json::object()};
      VolumeSum sum;
      for (int i = 0; i < int(input_.parameters.number("seeds")); ++i)
        judge(subject, cutters, input_.seed + std::uint64_t(i), sum, row);
      row.values = sum.values();
      row.values["resolution"] = int(resolution);
      models_.add(sum);
      input_.emit({row});
    }
  }

  void measure_trial(int number) {
    const FractureTrial trial = fracture_trial(input_.seed + std::uint64_t(number));
    const std::string label = trial.kind + " " + std::to_string(input_.seed + std::uint64_t(number));
    if (!input_.wants("trials", label)) return;
    input_.context.progress(label, 0.0);
    MeasuredRow row{"trials", label, Json::object()};
    VolumeSum sum;
    Subject subject;
    if (const auto failure = attempt([&] { subject = subject_of(trial.mesh, trial.longest); }))
      row.broken.push_back(*failure);
    else
      judge(subject, trial.cutters, input_.seed + std::uint64_t(number), sum, row);
    row.values = sum.values();
    row.values["resolution"] = int(trial.longest);
    row.values["cutters"] = trial.cutters;
    trials_.add(sum);
    input_.emit({row});
  }

  /// Runs one fracture with the default options and adds its violations to the row.
  void judge(const Subject& subject, const std::string& cutters, std::uint64_t seed, VolumeSum& sum,
             MeasuredRow& row) {
    if (subject.object.hermite.leaves.empty()) return;
    const auto failure = attempt([&] {
      RunContext child = child_context(input_.context, false);
      CutterChoices choices;
      choices.seed = seed;
      const MadeCutters made = make_cutters(parse_cutters(cutters), subject.object.hermite, choices, child);
      FractureFolder folder(input_.out / "pieces");  // removed with it
      const FractureMethod method;
      const FractureSummary summary = run_fracture(
          subject.object, made, method, [&](PieceOutput&& piece) { folder.add(std::move(piece), child); },
          child);
      const validation::FractureReport ledger =
          folder.judge(child, subject.uncut, reach_of_pieces(subject.object, method, summary));
      sum.add(ledger, summary, mass_properties(subject.uncut).volume);
      if (ledger.is_consistent()) return;
      for (const std::string& sentence : ledger.sentences())
        row.broken.push_back("seed " + std::to_string(seed) + ": " + sentence);
    });
    if (failure) row.broken.push_back("seed " + std::to_string(seed) + ": " + *failure);
  }

  const MeasurementInput& input_;
  VolumeSum models_, trials_;
};

}  // namespace

std::vector<MeasuredRow> measure_fracture_guarantee(const MeasurementInput& input) {
  return FractureGuarantee(input).run();
}

}  // namespace hermesh
