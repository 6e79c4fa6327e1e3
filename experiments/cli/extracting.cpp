#include "experiments/cli/extracting.h"

#include <cmath>

#include "algorithms/core/disjoint_sets.h"
#include "algorithms/io/mesh_units.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/format.h"
#include "experiments/cli/help/suggestions.h"
#include "experiments/cli/pipeline/json_report.h"
#include "experiments/cli/signals.h"
#include "experiments/cli/validators.h"
#include "experiments/cli/voxelizing.h"
#include "experiments/variants.h"
#include "validation/visible_loss.h"

namespace hermesh::cli {

void add_extractor_options(CLI::App& command, ExtractorArguments& arguments, const std::string& fallback) {
  arguments.extractor = fallback;
  command.add_option("--extractor", arguments.extractor,
                     "Name of the extractor, see hermesh list (default: " + arguments.extractor + ")");
  command.add_option("-o", arguments.options, "key=value, an option of the extractor; may be repeated")
      ->allow_extra_args(false)
      ->check(key_value());
}

ChosenExtractor choose_extractor(const ExtractorArguments& arguments) {
  return as_usage([&] {
    check_variant_name(all_extractors(), "extractor", arguments.extractor);
    const Extractor extractor = find_variant(all_extractors(), arguments.extractor);
    return ChosenExtractor{extractor, parse_options(extractor.name, extractor.options, arguments.options)};
  });
}

void print_extracted(Session& session, const PolygonMesh& mesh, const std::string& extractor,
                     double seconds) {
  made(session, "points", mesh.points.size());
  made(session, "triangles", mesh.triangle_count());
  made(session, "quads", mesh.quads.size());
  made(session, "extractor", extractor);
  print_summary(session, "extracted " + std::to_string(mesh.points.size()) + " points, " +
                             std::to_string(mesh.triangles.size()) + " triangles, " +
                             std::to_string(mesh.quads.size()) + " quads, " + extractor + ", " +
                             seconds_text(seconds));
}

namespace {

/// How many sets of polygons hang together by shared points.
std::size_t count_components(const PolygonMesh& mesh) {
  DisjointSets sets(mesh.points.size());
  std::vector<bool> used(mesh.points.size());
  const auto join = [&](const auto& polygons) {
    for (const auto& polygon : polygons)
      for (const std::uint32_t corner : polygon) used[corner] = true, sets.join(polygon[0], corner);
  };
  join(mesh.triangles);
  join(mesh.quads);
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < sets.size(); ++i) count += used[i] && sets.find(i) == i;
  return count;
}

}  // namespace

void note_components(const PolygonMesh& polygons, const PolygonMesh& mesh, Session& session) {
  const std::size_t before = count_components(polygons), after = count_components(mesh);
  if (after < 2 * before + 8) return;
  session.context.note(
      "the mesh has " + std::to_string(after) + " components and the polygons have " +
      std::to_string(before) +
      ": gaps and walls that are about as thin as a voxel came apart; smaller voxels mostly leave fewer");
}

void write_output(const std::string& path, const PolygonMesh& mesh, Session& session) {
  (session.units.empty() ? write_mesh : write_mesh_in_metres)(path, mesh, session.context);
}

bool check_visible_loss(const PolygonMesh& polygons, const PolygonMesh& mesh, double voxel_size,
                        double max_loss, Session& session) {
  constexpr std::int64_t kSamples = 4'000;
  const MeshFile model = to_mesh_file(polygons), file = to_mesh_file(mesh);
  const validation::VisibleLoss loss = validation::measure_visible_loss(
      validation::TriangleSoup(model), validation::TriangleSoup(file), voxel_size, kSamples, session.context);
  made(session, "visible_loss", loss.lost.value);
  made(session, "visible_loss_interval", std::vector<double>{loss.lost.lower, loss.lost.upper});
  made(session, "visible_filled", loss.filled.value);
  made(session, "invented_share", loss.invented.value);
  made(session, "invented_area", loss.invented_area);
  const auto percent = [](double share) { return text(100.0 * std::round(1e5 * share) / 1e5) + " %"; };
  const auto interval = [&](const validation::Estimate& share) {
    return percent(share.value) + " (" + percent(share.lower) + " to " + percent(share.upper) + ")";
  };
  // Single samples at edges may be wrong.
  constexpr double kNoticeable = 1e-3;
  if (loss.lost.value >= kNoticeable)
    session.context.note(
        interval(loss.lost) + " of the visible surface is not shown within half a voxel" +
        (loss.filled.value > 0.0 ? ", of it " + percent(loss.filled.value) + " where gaps are filled" : ""));
  if (loss.invented.value >= kNoticeable)
    session.context.note(interval(loss.invented) + " of the mesh, an area of " + text(loss.invented_area) +
                         ", is farther than a voxel from all polygons, as where holes are closed");
  if (loss.lost.value <= max_loss) return true;
  session.context.note("more than " + percent(max_loss) + " of the visible surface is lost (--max-loss)");
  return false;
}

void save(const std::string& path, const PolygonMesh& mesh, Session& session) {
  write_output(path, mesh, session);
  work_is_finished();
}

}  // namespace hermesh::cli
