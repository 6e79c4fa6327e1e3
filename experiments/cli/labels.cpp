// hermesh extract of label maps: a mesh for each label, or all walls in one mesh.
#include "experiments/cli/labels.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <set>

#include "algorithms/fracture/piece_output.h"
#include "algorithms/labels/label_mesh.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/conversions.h"
#include "experiments/cli/signals.h"

namespace hermesh::cli {
namespace {

/// Returns the extension of a mesh file, with a .gz after it.
std::string mesh_extension(const std::filesystem::path& path) {
  const std::string last = path.extension().string();
  const bool packed = last.size() == 3 && last[1] == 'g' && last[2] == 'z';
  return packed ? path.stem().extension().string() + last : last;
}

/// Returns the name of the file of a label: "out-3.ply" for "out.ply".
std::string file_of_label(const std::string& out, std::uint32_t label) {
  const std::string extension = mesh_extension(out);
  return out.substr(0, out.size() - extension.size()) + "-" + std::to_string(label) + extension;
}

/// Reads the numbers of --labels; empty for all. @throws UsageError
std::set<std::uint32_t> numbers_of(const std::string& text) {
  std::set<std::uint32_t> result;
  if (text == "all") return result;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (;;) {
    std::uint32_t label = 0;
    const auto [stop, failure] = std::from_chars(at, end, label);
    if (failure != std::errc() || label == 0 || label > kGreatestLabel || (stop != end && *stop != ','))
      throw UsageError("--labels must be all, or labels such as 1,2,5, not '" + text + "'");
    result.insert(label);
    if (stop == end) return result;
    at = stop + 1;
  }
}

/// @throws Error for a label that the map does not hold
void check_labels(const LabelMap& map, const std::set<std::uint32_t>& asked, const std::string& file) {
  const std::map<std::uint32_t, std::uint64_t> samples = map.samples();
  for (const std::uint32_t number : asked) {
    if (samples.contains(number)) continue;
    constexpr std::size_t kMost = 20;
    std::string list;
    for (std::size_t n = 0; const auto& [label, count] : samples) {
      list += (n > 0 ? ", " : "") + (n < kMost ? std::to_string(label) : "…");
      if (++n > kMost) break;
    }
    throw Error("'" + file + "' has no label " + std::to_string(number) + "; its labels are " + list);
  }
}

/// Returns the report of a label, with its mesh in `piece`.
Json report_of(const LabelMeshes& made, const LabelMeshes::Label& label, PieceOutput& piece) {
  piece.mesh = made.mesh_of(label);
  measure_piece(piece);
  Json neighbours = Json::array();
  for (const auto& [number, wall] : piece.neighbours)
    if (number > 0)
      neighbours.push_back({{"label", number}, {"triangles", wall.first}, {"area", wall.second}});
  return {{"label", label.label},
          {"samples", label.samples},
          {"volume", piece.mass.volume},
          {"area", piece.mass.area},
          {"points", piece.mesh.points.size()},
          {"triangles", piece.mesh.triangle_count()},
          {"neighbours", std::move(neighbours)}};
}

void note_changes(const LabelMeshes& made, const std::vector<LabelMeshes::Label>& labels, Session& session) {
  if (const std::uint64_t changed = made.fracture.repair.changed_samples; changed > 0)
    session.context.note(std::to_string(changed) + (changed == 1 ? " sample" : " samples") +
                         " got the label of a neighbour, so that the boundary of each label is manifold");
  for (const LabelMeshes::Label& label : labels)
    if (label.piece == 0)
      session.context.note("label " + std::to_string(label.label) + " has no mesh: its samples (" +
                           std::to_string(label.samples) + ") got the labels of neighbours");
}

}  // namespace

std::shared_ptr<LabelArguments> add_label_options(CLI::App& command) {
  auto arguments = std::make_shared<LabelArguments>();
  CLI::Option_group* group =
      command.add_option_group("For label maps (hermesh import --labels), in place of an isosurface");
  CLI::Option* label =
      group
          ->add_option("--label", arguments->label,
                       "Extract the boundary of one label: the same mesh as with --labels all")
          ->transform(whole_number(1, kGreatestLabel));
  CLI::Option* labels = group->add_option(
      "--labels", arguments->labels,
      "all, or labels such as 1,2,5: a mesh per label, out-1.ply, out-2.ply, … for the output out.ply. Each "
      "is watertight, and neighbours share their walls triangle by triangle, without gaps and overlaps");
  labels->excludes(label);
  group->add_flag("--shared-walls", arguments->shared_walls,
                  "With --labels all: one .ply with each wall once, and per polygon `label` and the "
                  "`neighbour` that it faces (0: background)");
  group
      ->add_option("--smoothing", arguments->smoothing,
                   "Maximum distance of vertices from the boundary between voxels, in voxels (default: 0.5)")
      ->check(CLI::Range(kLeastSmoothing, 0.5));
  return arguments;
}

bool asks_for_labels(const LabelArguments& arguments) {
  return arguments.label || !arguments.labels.empty() || arguments.shared_walls || arguments.smoothing;
}

void note_label_map(const LevelSet& volume, Session& session) {
  if (is_label_map(volume))
    session.context.note(
        "the volume is a label map, of which an isosurface joins labels; pass --labels all or --label N for "
        "the boundary of each label");
}

int run_extract_labels(const LabelArguments& arguments, const Paths& paths, const std::string& grid,
                       const CLI::App& command, Session& session) {
  refuse_idle(command,
              {"--extractor", "-o", "--isovalue", "--source", "--ends", "--attributes", "--mask", "--frustum",
               "--frustum-resolution", "--outside", "--tolerance-grid"},
              "it is for isosurfaces, not for the boundaries of labels");
  if (!arguments.label && arguments.labels.empty())
    throw UsageError(std::string(arguments.shared_walls ? "--shared-walls" : "--smoothing") +
                     " needs --labels all, or --label N");
  if (arguments.shared_walls && arguments.labels != "all")
    throw UsageError("--shared-walls is for all labels: pass --labels all");
  const std::set<std::uint32_t> asked =
      arguments.label ? std::set{static_cast<std::uint32_t>(*arguments.label)} : numbers_of(arguments.labels);
  const bool many = !arguments.label && !arguments.shared_walls;
  check_mesh_output(paths.out);
  if (many && session.writes_stream)
    throw UsageError("--labels writes a file per label: name a file, or pass --label N or --shared-walls");
  if (arguments.shared_walls && !mesh_extension(paths.out).starts_with(".ply"))
    throw UsageError("'" + paths.out + "' would lose the labels of polygons: only .ply stores them");

  const LabelMap map = read_label_map(paths.in, grid, session.context);
  check_labels(map, asked, paths.in);
  Stopwatch watch;
  const LabelMeshOptions options{.smoothing = arguments.smoothing.value_or(0.5)};
  const LabelMeshes made_meshes =
      about_file(paths.in, [&] { return label_meshes(map, options, session.context); });
  std::vector<LabelMeshes::Label> labels;
  for (const LabelMeshes::Label& label : made_meshes.labels)
    if (asked.empty() || asked.contains(label.label)) labels.push_back(label);
  note_changes(made_meshes, labels, session);
  const double seconds = watch.seconds();

  Json list = Json::array();
  std::size_t points = 0, triangles = 0;
  for (const LabelMeshes::Label& label : labels) {
    session.context.check();
    PieceOutput piece;
    Json report = report_of(made_meshes, label, piece);
    points += piece.mesh.points.size();
    triangles += piece.mesh.triangle_count();
    if (arguments.label && piece.mesh.empty())
      throw Error("'" + paths.in + "': label " + std::to_string(label.label) +
                  " has no mesh, since its samples got the labels of neighbours");
    std::string file;
    if (!arguments.shared_walls && !piece.mesh.empty()) {
      file = many ? file_of_label(paths.out, label.label) : paths.out;
      write_output(file, piece.mesh, session);
      report["file"] = session.named(file);
    }
    list.push_back(report);
    print_summary(session, "label " + std::to_string(label.label) + ": " + std::to_string(label.samples) +
                               " samples, volume " + text(piece.mass.volume) + ", " +
                               std::to_string(piece.mesh.triangle_count()) + " triangles" +
                               (many && !file.empty() ? ", " + file : ""));
  }
  if (arguments.shared_walls) {
    const PolygonMesh walls = made_meshes.shared_walls();
    points = walls.points.size(), triangles = walls.triangle_count();
    write_output(paths.out, walls, session);
  }
  work_is_finished();
  made(session, "points", points);
  made(session, "triangles", triangles);
  made(session, "quads", 0);
  made(session, "extractor", "labels");
  made(session, "smoothing", options.smoothing);
  made(session, "changed_samples", made_meshes.fracture.repair.changed_samples);
  made(session, "labels", list);
  print_summary(session, "extracted " + std::to_string(labels.size()) +
                             (labels.size() == 1 ? " label, " : " labels, ") + std::to_string(points) +
                             " points, " + std::to_string(triangles) + " triangles, " +
                             seconds_text(seconds));
  return kDone;
}

}  // namespace hermesh::cli
