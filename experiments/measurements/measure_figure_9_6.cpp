// Figure 9.6 of the thesis: extraction at low resolutions by the new method and an old one, threaded and not.
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "experiments/cases/cases.h"
#include "experiments/harness/cell.h"
#include "experiments/harness/run_cells.h"
#include "experiments/measure.h"
#include "experiments/measurements/measurements.h"
#include "experiments/pipeline.h"

namespace hermesh {
namespace {

constexpr auto kShownThreads = tbb::global_control::max_allowed_parallelism;

/// Who is timed; of the thesis's two methods the adaptive one is the new, and OpenVDB's mesher stands for the
/// old.
struct Method {
  std::string label, extractor;
  GivenOptions options;
};
std::vector<Method> methods(const Options& parameters) {
  const std::string tolerance = parameters.text("tolerance");
  return {{"adaptive-dual-contouring",
           "adaptive-dual-contouring",
           {{"threshold", std::to_string(parameters.number("threshold"))}, {"hermite", "level-set"}}},
          {"certified-octree", "certified-octree", {{"tolerance", tolerance}, {"hermite", "level-set"}}},
          {"manifold-dual-contouring",
           "manifold-dual-contouring",
           {{"tolerance", tolerance}, {"hermite", "level-set"}}},
          {"openvdb", "openvdb", {}}};
}

/// The Happy Buddha as the thesis had it if its file is at hand, else decimated.
LoadedCase load_buddha(const MeasurementInput& input) {
  return input.tables.load(
      is_at_hand("happy-buddha-full", input.context) ? "happy-buddha-full" : "happy-buddha", input.context);
}

std::string label_of_method(const Method& method, std::size_t threads) {
  return method.label + (threads == 1 ? ", 1 thread" : ", all threads");
}

/// All methods at one resolution, in turns.
std::vector<MeasuredRow> race_at(double resolution, const LoadedCase& model, const MeasurementInput& input,
                                 const std::vector<Method>& all, const std::vector<std::size_t>& counts) {
  const LevelSet level_set =
      voxelize(model.mesh, {.chosen = choose(input.tables.voxelizers, "hermesh"), .resolution = resolution},
               input.context);
  struct Made {
    std::size_t points = 0, polygons = 0;
  };
  std::vector<Made> made(all.size() * counts.size());
  std::vector<Contender> contenders;
  for (std::size_t m = 0; m < all.size(); ++m)
    for (const std::size_t count : counts) {
      const ExtractRecipe recipe{.chosen = choose(input.tables.extractors, all[m].extractor, all[m].options)};
      Made& kept = made[contenders.size()];
      const auto run = [&, recipe, count] {
        input.context.check();
        const tbb::global_control limit(kShownThreads, count);
        RunContext child = child_context(input.context, false);
        PolygonMesh mesh;
        const double seconds = timed([&] { mesh = extract(level_set, nullptr, recipe, child).mesh; });
        kept = {mesh.points.size(), mesh.triangles.size() + mesh.quads.size()};
        return seconds;
      };
      contenders.push_back({.run = run,
                            .budget_seconds = input.parameters.number("budget"),
                            .repetitions = int(input.parameters.number("repetitions")),
                            .seconds = {}});
    }
  if (resolution <= 400)  // larger ones are long enough not to mind cold caches and pools
    for (Contender& contender : contenders) contender.run();
  race(contenders);
  std::vector<MeasuredRow> rows;
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const Method& method = all[i / counts.size()];
    const std::size_t count = counts[i % counts.size()], first = i - i % counts.size();
    MeasuredRow row{"extraction", label_of_method(method, count)};
    row.values = {{"resolution", resolution},
                  {"threads", count},
                  {"active", level_set.active_voxels()},
                  {"seconds", median(contenders[i].seconds)},
                  {"shortest", std::ranges::min(contenders[i].seconds)},
                  {"points", made[i].points},
                  {"polygons", made[i].polygons},
                  {"speedup", median(contenders[first].seconds) / median(contenders[i].seconds)}};
    if (made[i].points != made[first].points)
      row.broken.push_back("the points depend on the number of threads");
    rows.push_back(std::move(row));
    if (i == first)
      rows.push_back({"points", method.label, {{"resolution", resolution}, {"points", made[i].points}}});
  }
  return rows;
}

std::vector<MeasuredRow> measure_figure_9_6(const MeasurementInput& input) {
  std::vector<Method> all = methods(input.parameters);
  std::vector<std::size_t> counts = {1};
  if (const std::size_t most = tbb::global_control::active_value(kShownThreads); most > 1)
    counts.push_back(most);
  std::erase_if(all, [&](const Method& method) {
    return !input.wants("points", method.label) && std::ranges::none_of(counts, [&](std::size_t count) {
      return input.wants("extraction", label_of_method(method, count));
    });
  });
  const LoadedCase model = load_buddha(input);
  std::vector<MeasuredRow> rows = {
      {"input",
       std::filesystem::path(model.name).filename().string() + ", " + model.origin,
       {{"triangles", model.mesh.triangle_count()}}}};
  if (all.empty()) return rows;
  for (const double resolution : numbers_in(input.parameters.text("resolutions"))) {
    input.context.progress("resolution " + readable(resolution), 0.0);
    std::ranges::move(race_at(resolution, model, input, all, counts), std::back_inserter(rows));
  }
  return rows;
}

}  // namespace

Measurement figure_9_6_measurement() {
  return {.name = "figure-9-6",
          .summary = "time and points of extraction by resolution, method and threads (figure 9.6)",
          .parameters = {{"resolutions",
                          "50 100 200 400 800",
                          "voxels along the longest side",
                          {"50 100 200 400 800", "50 100 200", "50 100 200 400 800 1600"}},
                         {"threshold",
                          "0.25",
                          "of adaptive-dual-contouring, square voxels; see table_9_2.toml",
                          {},
                          0,
                          1e6},
                         {"tolerance", "0.1", "of the two guaranteed methods, voxels", {}, 0, 100},
                         {"repetitions", "5", "of every contender, in turns", {}, 1, 1000},
                         {"budget", "30", "seconds that one contender's repetitions may take", {}, 0, 1e6}},
          .tables = {{"input", "the model", "model", {{"triangles", "triangles", "of the model"}}},
                     {"extraction",
                      "extraction from the level set",
                      "method",
                      {{"resolution", "voxels", "along the longest side"},
                       {"threads", "threads", "how many"},
                       {"active", "active voxels", "of the level set"},
                       {"seconds", "time [s]", "median; Hermite data included"},
                       {"shortest", "min [s]", "shortest"},
                       {"points", "points", "of the mesh"},
                       {"polygons", "polygons", "triangles and quads"},
                       {"speedup", "speedup", "times as fast as with one thread, by medians"}}},
                     {.name = "points",
                      .title = "points by resolution",
                      .first_column = "method",
                      .columns = {{"resolution", "voxels", "along the longest side"},
                                  {"points", "points", "of the mesh"}},
                      .printed = false}},
          .measure = measure_figure_9_6};
}

}  // namespace hermesh
