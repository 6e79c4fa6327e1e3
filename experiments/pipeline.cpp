#include "experiments/pipeline.h"

#include <unistd.h>

#include <atomic>
#include <filesystem>

#include "experiments/measure.h"

namespace hermesh {
using validation::MeshReport;

MeshFile as_written(const PolygonMesh& mesh, const std::string& format, RunContext& context) {
  if (mesh.empty()) return {};
  static std::atomic<int> files = 0;
  struct TemporaryFile {
    std::filesystem::path path;
    ~TemporaryFile() {
      std::error_code ignored;
      std::filesystem::remove(path, ignored);
    }
  } const file{std::filesystem::temp_directory_path() /
               ("hermesh-judged-" + std::to_string(getpid()) + "-" + std::to_string(files++) + format)};
  write_mesh(file.path, mesh, context);
  return read_mesh_file(file.path, context);
}

// ---- Guarantees.

namespace {

std::string counted(std::int64_t count, const char* what) { return std::to_string(count) + " " + what; }

void check_bound(const Circumstances::Bound& bound, const MeshReport& report,
                 std::vector<std::string>& broken) {
  // In voxels: the guaranteed excess over the tolerance, the gap between certified and true distance
  // (certify_gap), and the effect of single precision in the file.
  constexpr double kSlack = 0.005 + 0.001 + 1e-4;
  const auto certify = [&](const std::optional<validation::HausdorffBound>& distance, const char* way) {
    if (distance && distance->upper / bound.voxel_size > bound.tolerance + kSlack)
      broken.push_back("tolerance (up to " + std::to_string(distance->upper / bound.voxel_size) + " voxels " +
                       way + " the uniform mesh)");
  };
  certify(report.certified_from_reference, "from");
  certify(report.certified_to_reference, "to");
  if (bound.uniform && (report.components != bound.uniform->components ||
                        report.euler_characteristic != bound.uniform->euler_characteristic))
    broken.push_back("topology (other than the uniform mesh's)");
}

struct NamedPromise {
  bool Promises::*promised;
  const char* word;
  char letter;
};
constexpr NamedPromise kPromises[] = {{&Promises::closed, "closed", 'c'},
                                      {&Promises::manifold, "manifold", 'm'},
                                      {&Promises::oriented, "oriented", 'o'},
                                      {&Promises::no_self_intersection, "no self-intersection", 'i'}};

}  // namespace

std::vector<std::string> promise_words(const Promises& promises) {
  std::vector<std::string> words;
  for (const auto& [promised, word, letter] : kPromises)
    if (promises.*promised) words.push_back(word);
  return words;
}

PromiseCheck check_promises(const Promises& promises, const MeshReport& report,
                            const Circumstances& circumstances) {
  PromiseCheck check;
  if (promises.closed && !report.closed() && !circumstances.cut_open)
    check.broken.push_back("closed (" + counted(report.boundary_edges, "boundary edges)"));
  const std::int64_t vertices = circumstances.cut_open ? 0 : report.non_manifold_vertices;
  if (promises.manifold && report.non_manifold_edges + vertices > 0)
    check.broken.push_back("manifold (" + counted(report.non_manifold_edges, "edges and ") +
                           counted(vertices, "vertices are not)"));
  if (promises.oriented && !report.oriented())
    check.broken.push_back("oriented (" + counted(report.inconsistent_edges, "inconsistent edges)"));
  // A completely flipped component has no inconsistent edge, but a negative volume. Components of a mesh that
  // may intersect itself have no inside of their own, so only the whole is checked.
  const bool inside_out =
      (promises.no_self_intersection && !report.faces_outwards()) || (report.closed() && report.volume < 0.0);
  if (promises.oriented && report.oriented() && inside_out && !circumstances.encloses_the_outside)
    check.broken.push_back("oriented (inside out, the volume is negative)");
  if (promises.no_self_intersection) {
    if (!report.self_intersections)
      check.unchecked.push_back("no self-intersection");
    else if (report.self_intersections->pairs > 0)
      check.broken.push_back("no self-intersection (" + counted(report.self_intersections->pairs, "pairs)"));
    if (report.degenerate_polygons + report.duplicate_polygons > 0)
      check.broken.push_back("no self-intersection (" +
                             counted(report.degenerate_polygons, "degenerate and ") +
                             counted(report.duplicate_polygons, "duplicate polygons)"));
  }
  if (circumstances.bound) check_bound(*circumstances.bound, report, check.broken);
  return check;
}

std::string promise_verdict(const Promises& promises, const PromiseCheck& check) {
  const auto joined = [](const std::vector<std::string>& words) {
    std::string text;
    for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
    return text;
  };
  if (!check.broken.empty()) return "BROKEN: " + joined(check.broken);
  const std::vector<std::string> words = promise_words(promises);
  if (words.empty()) return "promises nothing";
  return "promises " + joined(words) + (check.unchecked.empty() ? ": kept" : ": not all checked");
}

std::string promise_letters(const Promises& promises, const PromiseCheck& check) {
  std::string letters;
  for (const auto& [promised, word, letter] : kPromises)
    if (promises.*promised) letters += letter;
  if (letters.empty()) return "none";
  return letters + (!check.broken.empty() ? " BROKEN" : check.unchecked.empty() ? " kept" : " unchecked");
}

Judgement judge(const MeshFile& mesh, const Promises& promises, const validation::CheckOptions& options,
                RunContext& context, const Circumstances& circumstances) {
  Judgement result{validation::check_mesh(mesh, options, context), {}};
  result.promises = check_promises(promises, result.report, circumstances);
  return result;
}

// ---- All stages.

Outcome run(const Job& job, RunContext& context) {
  Outcome result;
  const PolygonMesh* polygons = job.source.polygons;
  if (job.source.load) polygons = &(result.polygons = job.source.load(context));
  result.volume = job.source.volume ? *job.source.volume : voxelize(*polygons, job.voxelize, context);
  ExtractRecipe recipe = job.extract;
  if (!job.format.empty()) recipe.out = "mesh" + job.format;
  result.extract_seconds = timed([&] { result.made = extract(result.volume, polygons, recipe, context); });
  if (!job.judge) return result;
  const PolygonMesh& mesh = result.made.mesh;
  result.written = job.format.empty() ? to_mesh_file(mesh) : as_written(mesh, job.format, context);
  if (mesh.empty()) return result;
  Circumstances circumstances = job.circumstances;
  circumstances.cut_open |= recipe.ends == Ends::open && result.made.ends.any();
  result.judgement =
      judge(result.written, recipe.chosen.extractor.promises, *job.judge, context, circumstances);
  return result;
}

}  // namespace hermesh
