// Extraction of a sphere, per active voxel: our methods compared with OpenVDB's, at several resolutions. A
// mesh is validated before it is timed; a wrong one is not timed, and the program then ends with 1.
#include <benchmark/benchmark.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <string>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/io/mesh_file.h"
#include "algorithms/variants.h"
#include "experiments/bench/failures.h"
#include "experiments/pipeline.h"
#include "reference/variants.h"

namespace hermesh {
namespace {

/// Returns the exact level set of a sphere whose diameter is `resolution` voxels of size 1, within three
/// voxels on either side; so that a benchmark of extraction depends on no voxelizer.
LevelSet sphere_level_set(int resolution) {
  initialize_openvdb();
  // About a lattice point, many samples would have exactly the same distance.
  const openvdb::Vec3f centre(0.3f, -0.2f, 0.1f);
  return make_level_set(openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
      0.5f * static_cast<float>(resolution), centre, 1.0f));
}

const LevelSet& sphere(int resolution) {
  static std::map<int, LevelSet> cache;
  auto found = cache.find(resolution);
  if (found == cache.end()) found = cache.emplace(resolution, sphere_level_set(resolution)).first;
  return found->second;
}

/// Returns the defect of a mesh of the sphere, if any: it must satisfy the guarantees (without
/// self-intersections, which take longer than the rest) and be one component of the sphere's volume. The
/// tolerance is that of a polygonal sphere of this size, whose chords lie inside by a share of about one over
/// the squared resolution.
std::optional<std::string> fault(const Extractor& extractor, const PolygonMesh& mesh, int resolution) {
  RunContext context;
  const auto& [report, check] = judge(to_mesh_file(mesh), extractor.promises, kCounts, context);
  if (!check.broken.empty()) return promise_verdict(extractor.promises, check);
  if (report.components != 1) return std::to_string(report.components) + " components";
  const double radius = 0.5 * resolution, volume = 4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3);
  if (std::abs(report.volume / volume - 1.0) > 20.0 / (resolution * resolution))
    return "volume " + std::to_string(report.volume) + " instead of " + std::to_string(volume);
  return std::nullopt;
}

void extract_sphere(benchmark::State& state, const Extractor& extractor, int resolution) {
  const LevelSet& level_set = sphere(resolution);
  const ExtractRecipe recipe{.chosen = {extractor, Options(extractor.name, extractor.options, {})}};
  const auto extract_once = [&] {
    RunContext context;
    return extract(level_set, nullptr, recipe, context).mesh;
  };
  try {
    if (const auto wrong = fault(extractor, extract_once(), resolution))
      throw Error(extractor.name + ": " + *wrong);
    for ([[maybe_unused]] auto iteration : state) benchmark::DoNotOptimize(extract_once());
  } catch (const std::exception& error) {
    ++failures;
    state.SkipWithError(error.what());
  }
  state.counters["s/voxel"] =
      benchmark::Counter(static_cast<double>(level_set.active_voxels()),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void register_all() {
  std::vector<Extractor> extractors(our_extractors().begin(), our_extractors().end());
  extractors.push_back(find_variant(reference_extractors(), "openvdb"));
  for (const int resolution : {32, 128, 512})
    for (const Extractor& extractor : extractors)
      benchmark::RegisterBenchmark(
          (extractor.name + "/sphere/" + std::to_string(resolution)).c_str(),
          [extractor, resolution](benchmark::State& state) { extract_sphere(state, extractor, resolution); })
          ->Unit(benchmark::kMillisecond)
          ->UseRealTime();
}

}  // namespace
}  // namespace hermesh

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  hermesh::register_all();
  const std::size_t ran = benchmark::RunSpecifiedBenchmarks();
  return ran == 0 || hermesh::failures > 0 ? 1 : 0;
}
