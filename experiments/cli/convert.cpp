// hermesh extract and remesh: a volume to a mesh; polygons to a level set and back to a mesh, at a voxel
// size, within an error bound or within a budget of triangles.
#include <algorithm>
#include <cmath>
#include <memory>
#include <sstream>

#include "algorithms/core/run_context.h"
#include "algorithms/extraction/adaptivity_field.h"
#include "algorithms/extraction/explain.h"
#include "algorithms/extraction/frustum.h"
#include "algorithms/extraction/volume_attributes.h"
#include "algorithms/io/mesh_file.h"
#include "algorithms/io/vdb_file.h"
#include "algorithms/remesh/auto_voxel.h"
#include "algorithms/remesh/height_field.h"
#include "algorithms/remesh/tiled_remesh.h"
#include "experiments/cli/bounded.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/conversions.h"
#include "experiments/cli/labels.h"
#include "experiments/cli/signals.h"
#include "validation/visible_loss.h"

namespace hermesh::cli {
namespace {

constexpr int kDefaultTile = 512;
constexpr double kShellVoxels = 3.0;  ///< thickness of a shell in voxels, unless a size is given
/// In shells of few voxels: the distance from their middle, in voxels, that vertices keep when they leave
/// their cells, and the truncation, both found by trials with tubes and furniture.
constexpr double kWithinShell = 1.25;
constexpr const char* kShellTruncation = "0.3";

struct ConvertArguments {
  Paths paths;
  VoxelizeArguments voxelizing;
  ExtractorArguments extracting;
  double isovalue = 0.0;
  std::string grid;    ///< empty: `sdf`, or the only scalar grid
  std::string source;  ///< empty: the polygons of the volume are not available
  std::string ends = "closed";
  std::string attributes;  ///< names of grids to sample, or "all"; empty: none
  std::string max_loss;    ///< a share with %; empty: not given
  // Where an adaptive extractor keeps its bound; empty: not given.
  std::string mask, frustum, outside, tolerance_grid;
  std::optional<int> frustum_resolution;
  BoundArguments bound;
  int tiles = 0;     ///< side of the tiles in voxels; 0: not given
  std::string tile;  ///< "I/N", the job; empty: not given
  // Solids other than that of the polygons: lengths, with % or a unit behind them; empty: not given.
  std::string shell, offset, fill_below;
};

// ---- Adaptivity.

constexpr const char* kFrustumForm =
    "\"px,py,pz lx,ly,lz angle aspect near far\", followed by \"ux,uy,uz\" unless the up vector is 0,1,0";

/// Reads a number for each entry, with commas between them. @throws Error
template <std::size_t N>
std::array<double, N> read_numbers(const std::string& word, const char* form) {
  std::istringstream stream(word);
  std::array<double, N> numbers{};
  char comma = ',';
  for (std::size_t i = 0; i < N && comma == ','; ++i) {
    stream >> numbers[i];
    if (i + 1 < N) stream >> comma;
  }
  if (!stream || stream.peek() != EOF || comma != ',') throw Error("'" + word + "' is not " + form);
  return numbers;
}

Frustum read_frustum(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  if (words.size() != 6 && words.size() != 7) throw Error(std::string("it must be ") + kFrustumForm);
  const auto vector = [&](std::size_t i) {
    return Eigen::Vector3d(read_numbers<3>(words[i], "three numbers with commas between them").data());
  };
  const auto number = [&](std::size_t i) { return read_numbers<1>(words[i], "a number")[0]; };
  Frustum frustum{.position = vector(0),
                  .look_at = vector(1),
                  .field_of_view = number(2),
                  .aspect = number(3),
                  .near = number(4),
                  .far = number(5)};
  if (words.size() == 7) frustum.up = vector(6);
  return frustum;
}

/// Reads the mask or the scale of a field from a file and checks it, so that an error names the file and
/// precedes the work.
LevelSet read_part(const std::string& file, LevelSet AdaptivityField::*part, AdaptivityField::Outside outside,
                   Session& session) {
  return about_file(file, [&] {
    AdaptivityField field{.mask = {}, .outside = outside, .scale = {}};
    field.*part = read_level_set(file, "", session.context);
    FieldEvaluator(&field, IndexToWorld());
    return field.*part;
  });
}

/// Returns the field that the options request, or none. @throws UsageError for options that contradict one
/// another, an invalid frustum, or an extractor that is not adaptive; Error for a file that cannot be used.
std::optional<AdaptivityField> read_adaptivity(const ConvertArguments& arguments, Session& session) {
  using Outside = AdaptivityField::Outside;
  const bool has_mask = !arguments.mask.empty() || !arguments.frustum.empty();
  if (!arguments.outside.empty() && !has_mask) throw UsageError("--outside needs --mask or --frustum");
  if (arguments.frustum_resolution && arguments.frustum.empty())
    throw UsageError("--frustum-resolution needs --frustum");
  if (!has_mask && arguments.tolerance_grid.empty()) return std::nullopt;
  as_usage([&] { check_adaptive(arguments.extracting.chosen.extractor); });
  AdaptivityField field;
  field.outside = !has_mask || arguments.outside == "everywhere" ? Outside::everywhere
                  : arguments.outside == "nothing"               ? Outside::nothing
                                                                 : Outside::simplify;
  if (!arguments.mask.empty())
    field.mask = read_part(arguments.mask, &AdaptivityField::mask, field.outside, session);
  if (!arguments.frustum.empty()) try {
      field.mask = frustum_mask(read_frustum(arguments.frustum), arguments.frustum_resolution.value_or(84),
                                session.context);
    } catch (const Error& error) {
      throw UsageError(std::string("--frustum: ") + error.what());
    }
  if (!arguments.tolerance_grid.empty())
    field.scale = read_part(arguments.tolerance_grid, &AdaptivityField::scale, field.outside, session);
  return field;
}

// ---- Extraction.

/// Returns the parameters of the extraction. `field` must outlive it.
ExtractRecipe extract_recipe(const ConvertArguments& arguments, const std::optional<AdaptivityField>& field) {
  return {.chosen = arguments.extracting.chosen,
          .isovalue = arguments.isovalue,
          .ends = arguments.ends == "open" ? Ends::open : Ends::closed,
          .field = field ? &*field : nullptr,
          .out = arguments.paths.out};
}

/// Writes the mesh, with the attributes of the polygons that it was made from, if they have any; a signal
/// that comes later has no effect.
int save(const ConvertArguments& arguments, PolygonMesh& mesh, const PolygonMesh& polygons, Session& session,
         int exit_code = kDone) {
  carry_attributes(polygons, mesh, session);
  write_output(arguments.paths.out, mesh, session);
  work_is_finished();
  return exit_code;
}

/// Splits the names of --attributes and checks that the output stores attributes. @throws UsageError
std::vector<std::string> attribute_names(const ConvertArguments& arguments) {
  std::vector<std::string> names;
  std::istringstream stream(arguments.attributes);
  for (std::string name; std::getline(stream, name, ',');) {
    if (std::ranges::find(names, name) != names.end())
      throw UsageError("--attributes names " + name + " twice");
    names.push_back(name);
  }
  std::filesystem::path out = arguments.paths.out;
  const auto is = [&](const char* ending) {
    const std::string own = out.extension().string();
    return std::ranges::equal(own, std::string(ending), [](char a, char b) { return (a | 0x20) == b; });
  };
  if (is(".gz")) out = out.stem();
  if (!names.empty() && !is(".ply"))
    throw UsageError("'" + arguments.paths.out + "' would lose the attributes: only .ply stores them");
  return names;
}

int run_extract(ConvertArguments& arguments, Session& session) {
  arguments.extracting.choose();
  check_mesh_output(arguments.paths.out);
  const std::vector<std::string> attributes = attribute_names(arguments);
  std::optional<PolygonMesh> source;
  if (!arguments.source.empty()) {
    const ChosenExtractor& chosen = arguments.extracting.chosen;
    as_usage([&] { check_source_has_effect(chosen.extractor, chosen.options, arguments.isovalue); });
    source = read_polygons(arguments.source, session);
  }
  const LevelSet level_set = read_level_set(arguments.paths.in, arguments.grid, session.context);
  note_label_map(level_set, session);
  const std::optional<AdaptivityField> field = read_adaptivity(arguments, session);
  Stopwatch watch;
  PolygonMesh mesh = about_file(arguments.paths.in, [&] {
    return extract_surface(level_set, source ? &*source : nullptr, extract_recipe(arguments, field),
                           session.context);
  });
  print_extracted(session, mesh, arguments.extracting.chosen.extractor.name, watch.seconds());
  if (!attributes.empty()) {
    std::string line = "attributes";
    for (const std::string& name : sample_attributes(mesh, arguments.paths.in, attributes, session.context))
      line += " " + name;
    print_summary(session, line);
  }
  return save(arguments, mesh, {}, session);
}

// ---- Remeshing at a voxel size.

/// Measures and notes the share of the visible surface of the polygons that the mesh does not show
/// (validation/visible_loss.h). Returns true if it is at most `max_loss`. @param voxel_size world units
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

/// Returns the share of the visible surface that may be lost. @throws UsageError
double most_loss(const std::string& text, ThinRule rule) {
  // Parts that are dropped on request must not be lost unnoticed.
  if (text.empty()) return rule == ThinRule::drop ? 0.01 : 1.0;
  double percent = 0.0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), percent);
  if (failure != std::errc() || std::string(end, text.data() + text.size()) != "%" ||
      !(percent >= 0.0 && percent <= 100.0))
    throw UsageError("--max-loss must be a percentage such as 1%, not '" + text + "'");
  return percent / 100.0;
}

/// Reads the polygons of remesh, closed below if that is requested.
PolygonMesh read_input(const ConvertArguments& arguments, Session& session) {
  PolygonMesh mesh =
      read_polygons(arguments.paths.in, session, {.attributes = arguments.attributes != "none"});
  if (arguments.fill_below.empty()) return mesh;
  const double base =
      length_in_world_units("--fill-below", arguments.fill_below, session.metres, bounds(mesh).size().norm());
  return about_file(arguments.paths.in, [&] { return fill_below(mesh, base, session.context); });
}

/// Returns the offset that is requested, or none. @throws UsageError
std::optional<Offset> requested_offset(const ConvertArguments& arguments, const PolygonMesh& mesh,
                                       const Session& session) {
  const double diagonal = bounds(mesh).size().norm();
  if (!arguments.shell.empty())
    return Offset{Offset::Kind::shell, positive_length("--shell", arguments.shell, session.metres, diagonal)};
  if (!arguments.offset.empty())
    return Offset{Offset::Kind::solid,
                  length_in_world_units("--offset", arguments.offset, session.metres, diagonal)};
  return std::nullopt;
}

void report_offset(const Offset& offset, const OffsetErrors& errors, double voxel_size, Session& session) {
  made(session, "offset",
       {{"distance", offset.distance},
        {"radius", offset.radius()},
        {"largest_below", errors.below},
        {"largest_above", errors.above},
        {"samples", errors.samples},
        {"largest_from_offset", errors.from_offset},
        {"offset_samples", errors.offset_samples}});
  print_summary(session, "offset: " + std::to_string(errors.samples) + " points of the mesh are " +
                             text(offset.radius() - errors.below) + " to " +
                             length_text(session, offset.radius() + errors.above) +
                             " from the polygons, requested " + length_text(session, offset.radius()) + "; " +
                             std::to_string(errors.offset_samples) + " points of the offset are within " +
                             length_text(session, errors.from_offset) + " of the mesh (voxels of " +
                             length_text(session, voxel_size) + ")");
}

/// Chooses the voxel size, and prints it with its cost before the work starts.
void choose_voxel_size(const PolygonMesh& mesh, VoxelizeArguments& voxelizing, Session& session) {
  const AutoVoxelLimits limits;
  const AutoVoxel chosen = auto_voxel(mesh, limits, session.context);
  voxelizing.resolution = std::int64_t(limits.fewest_voxels);  // for the message if there is no extent
  if (!(chosen.voxel_size > 0.0)) return;
  voxelizing.voxel_size = chosen.voxel_size;
  const auto percent = [](double share) { return text(std::round(1e4 * share) / 100.0) + " %"; };
  const auto mebibytes = [](double bytes) { return text(std::ceil(bytes / (1 << 20))) + " MiB"; };
  made(session, "auto",
       {{"thin_share", chosen.thin_share},
        {"wanted_voxel_size", chosen.wanted},
        {"estimated_bytes", chosen.bytes},
        {"estimated_seconds", chosen.seconds}});
  print_summary(session,
                "resolution auto: voxels of " + length_text(session, chosen.voxel_size) + ", " +
                    text(std::round(bounds(mesh).size().maxCoeff() / chosen.voxel_size)) +
                    " along the longest side, about " + mebibytes(chosen.bytes) + " and " +
                    text(std::ceil(chosen.seconds)) + " s of CPU time (limits: " + text(limits.most_voxels) +
                    " voxels, " + mebibytes(limits.most_bytes) + ", " + text(limits.most_seconds) + " s); " +
                    percent(chosen.thin_share) + " of the visible surface is at thinner walls and gaps");
  if (chosen.thin_share > limits.share)
    session.context.note(
        "at the limits of --resolution auto, walls and gaps are too thin for the voxels at " +
        percent(chosen.thin_share) + " of the visible surface; voxels of " + text(chosen.wanted) +
        " would leave " + percent(limits.share) + " (--voxel-size)");
}

// ---- Remeshing by tiles.

/// Sets the options that --tiles and --tile imply, and returns the job. @throws UsageError for options that
/// contradict them
TileJob choose_tiles(ConvertArguments& arguments, const CLI::App& command) {
  refuse_idle(command,
              {"--mask", "--frustum", "--frustum-resolution", "--outside", "--tolerance-grid", "--isovalue",
               "--exterior-band", "--interior-band", "--shell", "--offset"},
              "it cannot be combined with --tiles and --tile");
  VoxelizeArguments& voxelizing = arguments.voxelizing;
  if (voxelizing.signs.value_or("winding-number") != "winding-number")
    throw UsageError(
        "--signs " + *voxelizing.signs +
        " needs the whole volume, which --tiles avoids; omit it, since tiles use winding-number");
  if (voxelizing.thin.value_or("drop") != "drop")
    throw UsageError("--thin " + *voxelizing.thin +
                     " needs the whole volume, which --tiles avoids; use --thin drop or smaller voxels");
  voxelizing.signs = "winding-number";
  voxelizing.thin = "drop";
  if (arguments.tiles == 0) arguments.tiles = kDefaultTile;
  arguments.extracting.options.push_back("tile=" + std::to_string(arguments.tiles));
  TileJob job;
  if (arguments.tile.empty()) return job;
  const char *at = arguments.tile.data(), *end = at + arguments.tile.size();
  const auto [slash, first] = std::from_chars(at, end, job.number);
  const auto [last, second] = slash != end && *slash == '/' ? std::from_chars(slash + 1, end, job.count)
                                                            : std::from_chars_result{at, std::errc()};
  if (first != std::errc() || second != std::errc() || last != end || job.number < 1 ||
      job.count < job.number || job.count > 1'000'000)
    throw UsageError("--tile must be the number of a job and that of all jobs, such as 1/4, not '" +
                     arguments.tile + "'");
  return job;
}

/// Remeshes tile by tile, as remesh() does, or writes the tiles of a job and returns nothing.
std::optional<Remeshed> remesh_by_tiles(const ConvertArguments& arguments, const PolygonMesh& mesh,
                                        const VoxelizeRecipe& recipe, const TileJob& job, Session& session) {
  const std::string &in = arguments.paths.in, &out = arguments.paths.out;
  Remeshed remeshed;
  remeshed.voxel_size = voxel_size_of(recipe, mesh);
  Stopwatch watch;
  TilePart part = about_file(in, [&] {
    return remesh_tiles(mesh, recipe, extract_recipe(arguments, std::nullopt), job, session.context);
  });
  part.metres = session.metres;
  remeshed.seconds = watch.seconds();
  made(session, "polygons", mesh.triangle_count());
  made(session, "voxel_size", remeshed.voxel_size);
  made(session, "tiles", part.tiles.size());
  print_summary(session, "remeshed " + in + ": " + std::to_string(mesh.triangle_count()) + " triangles, " +
                             std::to_string(part.tiles.size()) + " tiles of " +
                             std::to_string(arguments.tiles) + " voxels of " + text(remeshed.voxel_size) +
                             ", " + seconds_text(remeshed.seconds));
  session.context.note("walls, wires and gaps that are thinner than the voxels are lost with tiles");
  if (!arguments.tile.empty()) {
    write_tile_part(out, part);
    return std::nullopt;
  }
  std::vector<TilePart> parts;
  parts.push_back(std::move(part));
  remeshed.mesh = about_file(in, [&] { return join_parts(std::move(parts)); });
  remeshed.extract_seconds = watch.seconds();
  note_components(mesh, remeshed.mesh, session.context);
  return remeshed;
}

/// Places the vertices of a shell of few voxels nearer to the crossings of their cells, unless options say
/// where: otherwise those next to narrow gaps, with planes of opposite walls, come to lie inside the wall.
void place_within_shell(ExtractorArguments& extracting, double thickness_in_voxels) {
  const double reach = std::max(0.0, 0.5 * thickness_in_voxels - kWithinShell);
  if (reach >= 1.0) return;
  for (const auto& [name, value] : {std::pair<std::string, std::string>("reach", text(reach)),
                                    std::pair<std::string, std::string>("truncation", kShellTruncation)}) {
    const std::string& key = name;  // clang 14 captures no structured bindings
    const auto is_given = [&](const std::string& option) {
      return option.starts_with(key + "=") || option.starts_with("placement=");
    };
    const auto is_known = [&](const OptionSpec& option) { return option.name == key; };
    if (std::ranges::none_of(extracting.options, is_given) &&
        std::ranges::any_of(extracting.chosen.extractor.options, is_known))
      extracting.options.push_back(name + "=" + value);
  }
  extracting.choose();
}

int run_remesh(ConvertArguments& arguments, const CLI::App& command, Session& session) {
  VoxelizeArguments& voxelizing = arguments.voxelizing;
  const Paths& paths = arguments.paths;
  // The default limit holds for losses that the user requested.
  const bool requested = voxelizing.thin.has_value();
  std::optional<TileJob> job;
  if (arguments.tiles > 0 || !arguments.tile.empty()) job = choose_tiles(arguments, command);
  if (!arguments.shell.empty() || !arguments.offset.empty())
    refuse_idle(command, {"--thin", "--max-loss", "--isovalue"},
                "it cannot be combined with --shell and --offset");
  voxelizing.choose();
  arguments.extracting.choose();
  if (arguments.tile.empty())
    check_mesh_output(paths.out);
  else
    check_writable(paths.out);
  const ThinRule rule = voxelizing.thin_rule(arguments.isovalue);
  const double max_loss = most_loss(arguments.max_loss, requested ? rule : ThinRule::keep);
  const std::optional<AdaptivityField> field = read_adaptivity(arguments, session);
  const PolygonMesh mesh = read_input(arguments, session);
  const std::optional<Offset> offset = requested_offset(arguments, mesh, session);
  if (!voxelizing.voxel_size && voxelizing.resolution.value_or(0) == 0) {
    if (offset && offset->kind == Offset::Kind::shell)
      voxelizing.voxel_size = offset->distance / kShellVoxels;
    else
      choose_voxel_size(mesh, voxelizing, session);
  }
  VoxelizeRecipe recipe = voxelizing.recipe(mesh, paths.in, arguments.isovalue);
  recipe.offset = offset;
  if (offset && offset->kind == Offset::Kind::shell)
    place_within_shell(arguments.extracting, offset->distance / voxel_size_of(recipe, mesh));
  std::optional<Remeshed> result =
      job ? remesh_by_tiles(arguments, mesh, recipe, *job, session) : about_file(paths.in, [&] {
        return std::optional(remesh(mesh, recipe, extract_recipe(arguments, field), session.context));
      });
  if (!result) {
    work_is_finished();
    return kDone;
  }
  Remeshed& made = *result;
  if (!job) print_voxelized(session, paths.in, mesh, made, voxelizing.chosen.voxelizer.name);
  if (rule != ThinRule::drop && !offset) report_thin_parts(made.thin, session);
  if (made.thin && made.thin->has_open)
    session.context.note(
        "open surfaces became as thick as the voxels require; --shell gives them a thickness, and "
        "--fill-below "
        "makes the solid below a height field");
  print_extracted(session, made.mesh, arguments.extracting.chosen.extractor.name, made.extract_seconds);
  if (offset) report_offset(*offset, *made.offset, made.voxel_size, session);
  // Other isovalues, and parts outside a mask, do not show the polygons by intention.
  const bool is_of_polygons = !offset && arguments.isovalue == 0.0 && arguments.mask.empty() &&
                              arguments.frustum.empty() && !voxelizing.chosen.options.is("signs", "unsigned");
  const bool shows =
      !is_of_polygons || check_visible_loss(mesh, made.mesh, made.voxel_size, max_loss, session);
  return save(arguments, made.mesh, mesh, session, shows ? kDone : kNotMet);
}

// ---- Remeshing within a bound.

int run_bounded(const ConvertArguments& arguments, const CLI::App& command, Session& session) {
  refuse_idle(command,
              {"--tiles", "--tile", "--extractor", "-o", "--voxelizer", "--voxelizer-option",
               "--exterior-band", "--interior-band", "--isovalue", "--max-loss", "--mask", "--frustum",
               "--frustum-resolution", "--outside", "--tolerance-grid", "--shell", "--offset"},
              "with --error and --triangles the method is chosen for the bound");
  if (!arguments.bound.certificate.empty())
    refuse_idle(command, {"--scale", "--fill-below"}, "a certificate is about the input file as it is");
  check_bound_usage(arguments.bound, arguments.voxelizing, arguments.paths);
  check_mesh_output(arguments.paths.out);
  const PolygonMesh mesh = read_input(arguments, session);
  BoundedMesh made =
      remesh_within_bound(arguments.bound, arguments.voxelizing, arguments.paths, mesh, session);
  return save(arguments, made.mesh, mesh, session);
}

// ---- The command line.

void add_extract_options(CLI::App& command, ConvertArguments& arguments, const std::string& fallback) {
  add_extractor_options(command, arguments.extracting, fallback);
  command
      .add_option("--isovalue", arguments.isovalue,
                  "Value of the surface, in the units of the grid (default: 0)")
      ->check(finite_number());
  CLI::Option_group* group =
      command.add_option_group("Where an adaptive extractor keeps its bound (see also --outside)");
  CLI::Option* mask = group->add_option(
      "--mask", arguments.mask,
      "A .vdb with the region: where a level set is negative, where any other scalar grid differs from its "
      "background");
  group
      ->add_option("--frustum", arguments.frustum,
                   std::string("In place of a mask the view of a camera: ") + kFrustumForm +
                       "; position, point looked at, vertical angle in degrees, width over height, distances "
                       "of the clipping planes in world units")
      ->excludes(mask);
  group
      ->add_option("--frustum-resolution", arguments.frustum_resolution,
                   "Voxels along the longest side of the frustum's mask (default: 84)")
      ->check(CLI::Range(8, 4096));
  group
      ->add_option("--outside", arguments.outside,
                   "Outside the mask: simplify (default) merges as far as the topology allows "
                   "(manifold-dual-contouring: up to 8 voxels), nothing makes no polygons, so the mesh is "
                   "open and its boundary may touch itself, everywhere keeps the bound there, too")
      ->check(CLI::IsMember({"everywhere", "simplify", "nothing"}));
  group->add_option("--tolerance-grid", arguments.tolerance_grid,
                    "A .vdb whose values, none negative, scale the extractor's bound; the background applies "
                    "beyond its data");
}

void add_solid_options(CLI::App& command, ConvertArguments& arguments) {
  CLI::Option_group* group = command.add_option_group(
      "Other solids than that of the polygons; lengths as of --error, with % of the diagonal or a unit");
  CLI::Option* shell = group->add_option(
      "--shell", arguments.shell,
      "Thickness of walls: the solid of all points within half of it of the polygons, for sheets and open "
      "surfaces. Without a size, voxels are a third of it");
  group
      ->add_option("--offset", arguments.offset,
                   "Distance by which the solid grows or, with a negative number (--offset=-1mm), shrinks")
      ->excludes(shell);
  group
      ->add_option("--fill-below", arguments.fill_below,
                   "Height z of a flat base: closes a height field, such as a terrain, by walls and a base")
      ->excludes(shell);
}

void add_tile_options(CLI::App& command, ConvertArguments& arguments) {
  CLI::Option_group* group = command.add_option_group("For models larger than memory");
  group
      ->add_flag(
          "--tiles{" + std::to_string(kDefaultTile) + "}", arguments.tiles,
          "Work tile by tile, in memory of the size of a tile and the mesh; --tiles=256 for tiles of 256 "
          "voxels (default: 512). Polygons must be closed, and parts thinner than the voxels are lost. "
          "The same bytes as -o tile=512 --signs winding-number --thin drop")
      ->check(CLI::Range(int(kLeastTile), 1 << 20));
  group->add_option("--tile", arguments.tile,
                    "I/N: make the tiles of job I of N, and write them to OUT as a part for hermesh join");
}

}  // namespace

void add_conversions(CLI::App& app, Session& session) {
  auto arguments = std::make_shared<ConvertArguments>();
  CLI::App* command = add_command(app, session, "extract", "Convert a volume to a mesh");
  add_paths(*command, session, arguments->paths, "Volume: .vdb, or - for the standard input",
            FileKind::volume, kMeshOut, FileKind::mesh, true);
  add_json_option(*command, session);
  add_extract_options(*command, *arguments, "dual-contouring");
  command->add_option("--grid,--grid-name", arguments->grid,
                      "Name of the grid (default: sdf, or the only scalar grid)");
  command->add_option("--source", arguments->source,
                      "Mesh that the volume was made from, for extractors that use exact Hermite data");
  command
      ->add_option("--ends", arguments->ends,
                   "Where the surface reaches the end of the data: closed (default) by a flat cap half a "
                   "voxel beyond the last samples, or open, cut off at these")
      ->check(CLI::IsMember({"closed", "open"}));
  command->add_option(
      "--attributes", arguments->attributes,
      "Grids of the volume, separated by commas, or all, to sample at the vertices, for .ply");
  const auto labels = add_label_options(*command);
  set_work(*command, session, [arguments, labels, command, &session] {
    return asks_for_labels(*labels)
               ? run_extract_labels(*labels, arguments->paths, arguments->grid, *command, session)
               : run_extract(*arguments, session);
  });

  arguments = std::make_shared<ConvertArguments>();
  command = add_command(app, session, "remesh", "Convert polygons to a level set and back to a mesh");
  add_paths(*command, session, arguments->paths, kMeshIn, FileKind::mesh, kMeshOut, FileKind::mesh, true);
  add_json_option(*command, session);
  CLI::App* size = add_voxelize_options(*command, arguments->voxelizing, false, true);
  size->require_option(0, 2);
  add_extract_options(*command, *arguments, "manifold-dual-contouring");
  command->add_option("--max-loss", arguments->max_loss,
                      "Exit with 3 if more of the visible surface is lost, such as 1% (default: no limit, or "
                      "1% with --thin drop)");
  add_bound_options(*command, *size, arguments->bound);
  add_attributes_option(*command, arguments->attributes);
  set_work(*command, session, [arguments, command, size, &session] {
    const BoundArguments& bound = arguments->bound;
    const bool bounded_twice = bound.triangles && !bound.error.empty();
    if (size->count_all() > 1 + std::size_t(bounded_twice))
      throw UsageError(
          "at most one of --voxel-size, --resolution, --error and --triangles determines the size, or "
          "--error with --triangles");
    if (bound.triangles || !bound.error.empty()) return run_bounded(*arguments, *command, session);
    refuse_idle(*command,
                {"--over-holes", "--except-thin", "--through-volume", "--limit-points", "--smallest-voxel",
                 "--certificate"},
                "it needs --error or --triangles");
    return run_remesh(*arguments, *command, session);
  });
  add_solid_options(*command, *arguments);
  add_tile_options(*command, *arguments);
  add_join(app, session);
}

}  // namespace hermesh::cli
