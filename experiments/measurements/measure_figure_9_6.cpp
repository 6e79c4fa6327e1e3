// Figure 9.6 of the thesis: extraction at low resolutions by the new method and an old one, threaded and not.
#include <tbb/global_control.h>

#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

constexpr auto kShownThreads = tbb::global_control::max_allowed_parallelism;

/// Adaptive dual contouring is the thesis's new method; OpenVDB's mesher stands in for its old one.
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

/// Loads the Happy Buddha of the thesis if its file is available, else a decimated one.
LoadedCase load_buddha(const MeasurementInput& input) {
  return input.tables.load(
      is_at_hand("happy-buddha-full", input.context) ? "happy-buddha-full" : "happy-buddha", input.context);
}

std::string label_of_method(const Method& method, std::size_t threads) {
  return method.label + (threads == 1 ? ", 1 thread" : ", all threads");
}

/// All methods at one resolution, interleaved.
std::vector<MeasuredRow> race_at(double resolution, const LoadedCase& model, const MeasurementInput& input,
                                 const std::vector<Method>& all, const std::vector<std::size_t>& counts) {
  const LevelSet level_set = voxelized(model.mesh, {.resolution = resolution}, input);
  struct Made {
    std::size_t points = 0, polygons = 0;
  };
  std::vector<Made> made(all.size() * counts.size());
  std::vector<std::function<double()>> work;
  for (std::size_t m = 0; m < all.size(); ++m)
    for (const std::size_t count : counts) {
      const ExtractRecipe recipe{.chosen = choose(input.tables.extractors, all[m].extractor, all[m].options)};
      Made& kept = made[work.size()];
      work.push_back([&, recipe, count] {
        input.context.check();
        const tbb::global_control limit(kShownThreads, count);
        RunContext child = child_context(input.context, false);
        PolygonMesh mesh;
        const double seconds = timed([&] { mesh = extract(level_set, nullptr, recipe, child).mesh; });
        kept = {mesh.points.size(), mesh.triangles.size() + mesh.quads.size()};
        return seconds;
      });
    }
  // Larger ones take long enough not to depend on cold caches and pools.
  const auto seconds = race(work, int(input.parameters.number("repetitions")),
                            input.parameters.number("budget"), resolution <= 400);
  std::vector<MeasuredRow> rows;
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    const Method& method = all[i / counts.size()];
    const std::size_t count = counts[i % counts.size()], first = i - i % counts.size();
    MeasuredRow row{"extraction", label_of_method(method, count)};
    row.values = {{"resolution", resolution},
                  {"threads", count},
                  {"active", level_set.active_voxels()},
                  {"seconds", median(seconds[i])},
                  {"shortest", std::ranges::min(seconds[i])},
                  {"points", made[i].points},
                  {"polygons", made[i].polygons},
                  {"speedup", median(seconds[first]) / median(seconds[i])}};
    if (made[i].points != made[first].points)
      row.broken.push_back("the points depend on the number of threads");
    rows.push_back(std::move(row));
    if (i == first)
      rows.push_back({"points", method.label, {{"resolution", resolution}, {"points", made[i].points}}});
  }
  return rows;
}

}  // namespace

std::vector<MeasuredRow> measure_figure_9_6(const MeasurementInput& input) {
  std::vector<Method> all = methods(input.parameters);
  std::vector<std::size_t> counts = {1};
  if (thread_counts().back() > 1) counts.push_back(thread_counts().back());
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

}  // namespace hermesh
