// Speed of voxelizers, extractors, Booleans and fractures by number of threads.
#include <tbb/global_control.h>

#include "algorithms/hermite/combine.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/thesis/voxels/dense_hermite.h"
#include "experiments/fracture/fracture_run.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

constexpr auto kAllowedThreads = tbb::global_control::max_allowed_parallelism;
constexpr const char* kTimedVoxelizers[] = {"thesis", "hermesh", "openvdb"};
constexpr const char* kTimedExtractors[] = {"adaptive-dual-contouring", "dual-contouring",
                                            "marching-cubes",           "certified-octree",
                                            "manifold-dual-contouring", "openvdb"};
constexpr const char* kTimedSampling[] = {"level set → sparse, packed", "polygons → sparse, float"};
constexpr const char* kBooleans[] = {"union, sparse, packed", "union, thesis's 10-byte voxels",
                                     "union, fixed 10-byte voxels"};
constexpr const char* kThreadMethods[] = {"labelled", "thesis", "openvdb"};

/// Times one piece of work, which returns its seconds, with each number of threads, interleaved.
std::vector<MeasuredRow> times_by_threads(const std::string& table, const std::string& label,
                                          const std::function<double()>& work,
                                          const MeasurementInput& input) {
  const std::vector<std::size_t> counts = thread_counts();
  std::vector<double> cpu(counts.size(), 0.0);
  std::vector<std::function<double()>> runs;
  for (std::size_t i = 0; i < counts.size(); ++i)
    runs.push_back([&, i] {
      input.context.check();
      const tbb::global_control limit(kAllowedThreads, counts[i]);
      const double start = process_cpu_seconds();
      const double seconds = work();
      cpu[i] += process_cpu_seconds() - start;
      return seconds;
    });
  runs.back()();  // warms caches and pools
  cpu.back() = 0.0;
  const auto times =
      race(runs, int(input.parameters.number("repetitions")), input.parameters.number("budget"));
  std::vector<MeasuredRow> rows;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double seconds = median(times[i]), one = median(times[0]);
    MeasuredRow row{table, label};
    row.values = {{"threads", counts[i]},
                  {"seconds", seconds},
                  {"shortest", std::ranges::min(times[i])},
                  {"cpu_seconds", cpu[i] / double(times[i].size())},
                  {"speedup", one / seconds},
                  {"efficiency", one / seconds / double(counts[i])}};
    rows.push_back(std::move(row));
  }
  return rows;
}

class ThreadsMeasurer {
 public:
  explicit ThreadsMeasurer(const MeasurementInput& input) : input_(input) {}

  std::vector<MeasuredRow> run() {
    const bool voxelizers = input_.wants_any("voxelizers", kTimedVoxelizers);
    const bool extractors = input_.wants_any("extractors", kTimedExtractors);
    const bool hermite =
        input_.wants_any("hermite", kTimedSampling) || input_.wants_any("hermite", kBooleans);
    const bool fractures = input_.wants_any("fracture", kThreadMethods);
    if (!voxelizers && !extractors && !hermite && !fractures) return {};
    model_ = input_.tables.load(input_.parameters.text("case"), input_.context).mesh;
    if (voxelizers) race_voxelizers();
    if (!extractors && !hermite && !fractures) return std::move(rows_);
    level_set_ = voxelize(model_, recipe("hermesh"), input_.context);
    if (extractors) race_extractors();
    if (hermite) race_hermite();
    if (fractures) race_fractures();
    return std::move(rows_);
  }

 private:
  VoxelizeRecipe recipe(const std::string& voxelizer) const {
    return {.chosen = choose(input_.tables.voxelizers, voxelizer),
            .resolution = input_.parameters.number("resolution")};
  }

  /// Each run gets its own context, so that timed work shows no progress.
  void add(const std::string& table, const std::string& label, const std::function<void(RunContext&)>& work) {
    if (!input_.wants(table, label)) return;
    input_.context.progress(table + ", " + label, 0.0);
    const auto once = [&] {
      RunContext child = child_context(input_.context, false);
      return timed([&] { work(child); });
    };
    std::ranges::move(times_by_threads(table, label, once, input_), std::back_inserter(rows_));
  }

  void race_voxelizers() {
    for (const char* name : kTimedVoxelizers)
      add("voxelizers", name,
          [&, chosen = recipe(name)](RunContext& context) { voxelize(model_, chosen, context); });
  }

  void race_extractors() {
    for (const char* name : kTimedExtractors) {
      const auto& options = find_variant(input_.tables.extractors, name).options;
      GivenOptions given;
      if (std::ranges::find(options, "hermite", &OptionSpec::name) != options.end())
        given["hermite"] = "level-set";
      const ExtractRecipe recipe{.chosen = choose(input_.tables.extractors, name, given)};
      add("extractors", name,
          [&, recipe](RunContext& context) { extract(level_set_, nullptr, recipe, context); });
    }
  }

  void race_hermite() {
    constexpr NormalCodeId kCode = NormalCodeId::octahedral;
    add("hermite", kTimedSampling[0],
        [&](RunContext& context) { sample_level_set_packed(level_set_, 0.0, kCode, context); });
    add("hermite", kTimedSampling[1],
        [&](RunContext& context) { sample_polygons(level_set_, 0.0, model_, context); });
    if (!input_.wants_any("hermite", kBooleans)) return;
    RunContext& context = input_.context;
    const PackedHermite a = sample_level_set_packed(level_set_, 0.0, kCode, context);
    const PackedHermite b = shifted(a);
    add("hermite", kBooleans[0], [&](RunContext& own) { combine(Boolean::unite, a, b, own); });
    {
      const ThesisDense x = to_dense<ThesisVoxel>(a, context), y = to_dense<ThesisVoxel>(b, context);
      add("hermite", kBooleans[1], [&](RunContext& own) { combine(Boolean::unite, x, y, own); });
    }
    const FixedDense x = to_dense<FixedVoxel>(a, context), y = to_dense<FixedVoxel>(b, context);
    add("hermite", kBooleans[2], [&](RunContext& own) { combine(Boolean::unite, x, y, own); });
  }

  void race_fractures() {
    RunContext& context = input_.context;
    FractureObject object;
    object.level_set =
        voxelized(model_, {.resolution = input_.parameters.number("fracture_resolution")}, input_);
    object.hermite = sample_polygons(object.level_set, 0.0, model_, context);
    CutterChoices choices;
    choices.seed = input_.seed;
    const std::string word = "voronoi:" + readable(input_.parameters.number("pieces"));
    const MadeCutters cutters = make_cutters(parse_cutters(word), object.hermite, choices, context);
    for (const char* method : kThreadMethods) {
      if (!input_.wants("fracture", method)) continue;
      context.progress(std::string("fracture, ") + method, 0.0);
      const auto once = [&] {
        RunContext child = child_context(context, false);
        return run_fracture(
                   object, cutters, {.name = method, .options = {}}, [](PieceOutput&&) {}, child)
            .seconds;
      };
      std::ranges::move(times_by_threads("fracture", method, once, input_), std::back_inserter(rows_));
    }
  }

  const MeasurementInput& input_;
  PolygonMesh model_;
  LevelSet level_set_;
  std::vector<MeasuredRow> rows_;
};

}  // namespace

std::vector<MeasuredRow> measure_threads(const MeasurementInput& input) {
  return ThreadsMeasurer(input).run();
}

}  // namespace hermesh
