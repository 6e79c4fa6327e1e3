#include "experiments/cli/conversions.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "algorithms/core/quad_diagonals.h"
#include "algorithms/core/run_context.h"
#include "algorithms/io/mesh_file.h"
#include "algorithms/search/transfer_attributes.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/help.h"
#include "experiments/variants.h"

namespace hermesh::cli {
namespace {

/// Refuses a name that the table lacks if it is close to one that it has. @throws Error with `message` and
/// the suggestion.
template <class Named>
void refuse_misspelled(const std::vector<Named>& table, const std::string& given,
                       const std::string& message) {
  std::vector<std::string> names;
  for (const Named& entry : table) names.push_back(entry.name);
  if (std::ranges::find(names, given) != names.end()) return;
  if (const std::string meant = did_you_mean(given, names); !meant.empty()) throw Error(message + meant);
}

/// Returns the method of that name with its options, given as key=value. @throws UsageError
template <class Method>
auto chosen_from(const std::vector<Method>& table, const std::string& kind, const std::string& name,
                 const std::vector<std::string>& texts, bool keep_open_sheets = false) {
  return as_usage([&] {
    refuse_misspelled(table, name, "there is no " + kind + " '" + name + "'");
    const Method& method = find_variant(table, name);
    GivenOptions given;
    for (const std::string& text : texts) {
      const auto option = parse_option(text);
      if (!given.insert(option).second)
        throw Error("option '" + option.first + "' of " + name + " is given twice");
    }
    for (const auto& [option, value] : given)
      refuse_misspelled(method.options, option, name + " has no option '" + option + "'");
    return hermesh::choose(table, name, keep_open_sheets ? with_open_sheets(name, given) : given);
  });
}

}  // namespace

void VoxelizeArguments::choose() {
  std::vector<std::string> all = options;
  if (signs) all.push_back("signs=" + *signs);
  chosen = chosen_from(all_voxelizers(), "voxelizer", voxelizer, all, thin.value_or("keep") == "keep");
}

void ExtractorArguments::choose() { chosen = chosen_from(all_extractors(), "extractor", extractor, options); }

ThinRule VoxelizeArguments::thin_rule(double isovalue) const {
  if (thin == "drop") return ThinRule::drop;
  const char* reason = reason_to_drop_thin_parts(chosen, isovalue);
  if (reason && thin) throw UsageError("--thin " + *thin + " has no effect: " + reason);
  if (reason) return ThinRule::drop;
  return thin == "refuse" ? ThinRule::refuse : ThinRule::keep;
}

VoxelizeRecipe VoxelizeArguments::recipe(const PolygonMesh& mesh, const std::string& file,
                                         double isovalue) const {
  const double longest_side = bounds(mesh).size().maxCoeff();
  if (voxel_size && *voxel_size > longest_side && !any_size)
    throw Error("'" + file + "' is smaller than a voxel: its longest side is " + text(longest_side) +
                " and --voxel-size is " + text(*voxel_size) + " world units; use smaller voxels");
  if (!voxel_size && !(longest_side > 0.0))
    throw Error("'" + file + "' has no extent, so --resolution gives no voxel size; use --voxel-size");
  return {.chosen = chosen,
          .voxel_size = voxel_size ? *voxel_size : longest_side / static_cast<double>(*resolution),
          .exterior_band = exterior_band,
          .interior_band = interior_band,
          .thin = thin_rule(isovalue)};
}

CLI::App* add_voxelize_options(CLI::App& command, VoxelizeArguments& arguments, bool with_like,
                               bool with_auto) {
  CLI::Option_group* size =
      command.add_option_group(with_auto ? "Voxel size, at most one of" : "Voxel size, exactly one of");
  size->add_option("--voxel-size", arguments.voxel_size, "Edge length of a voxel in world units")
      ->check(finite_number(std::numeric_limits<double>::min(), "a finite number above 0"));
  const CLI::Validator number = whole_number(1, std::int64_t(1) << 40);
  size->add_option("--resolution", arguments.resolution,
                   with_auto
                       ? "Voxels along the longest side of the mesh, or auto (default), which chooses 200 to "
                         "2000 such that at most 1 % of the visible surface is at walls and gaps that are "
                         "too thin for them, within printed limits of memory and time"
                       : "Voxels along the longest side of the mesh")
      ->transform(with_auto ? CLI::Validator(
                                  [number](std::string& given) {
                                    if (given != "auto") return number(given);
                                    given = "0";
                                    return std::string();
                                  },
                                  "")
                            : number);
  if (with_like)
    size->add_option("--like", arguments.like,
                     "A .vdb whose first float grid gives voxel size, rotation and position, so that both "
                     "volumes share one lattice");
  size->require_option(with_auto ? 0 : 1, 1);
  command.add_option("--voxelizer", arguments.voxelizer,
                     "Name of the voxelizer, see hermesh list (default: " + arguments.voxelizer + ")");
  command.add_option(
      "--signs", arguments.signs,
      "How the voxelizer hermesh finds the inside: flood-fill, winding-number, auto (flood-fill, or "
      "winding-number if the flood leaks), auto-sheets (auto without closing large holes), or unsigned for "
      "none. Default: winding-number with --error and --triangles, auto-sheets with --thin keep, else auto; "
      "short for --voxelizer-option signs=...");
  command
      .add_option("--thin", arguments.thin,
                  "Walls, wires and open sheets thinner than the voxels: keep (default) thickens them until "
                  "they appear, drop loses them, refuse is an error")
      ->check(CLI::IsMember({"keep", "drop", "refuse"}));
  command
      .add_option("--voxelizer-option", arguments.options,
                  "key=value, an option of the voxelizer, see hermesh list; may be repeated")
      ->allow_extra_args(false);
  // Both ends of an edge that the surface crosses are at most a voxel away from it.
  const auto band = finite_number(1.0, "a finite number of voxels of at least 1");
  command
      .add_option("--exterior-band", arguments.exterior_band,
                  "Width of the band outside, in voxels (default: 3; 1 suffices for marching cubes and is "
                  "faster)")
      ->check(band);
  command
      .add_option("--interior-band", arguments.interior_band,
                  "Width of the band inside, in voxels (default: 3; as --exterior-band)")
      ->check(band);
  return size;
}

void add_extractor_options(CLI::App& command, ExtractorArguments& arguments, const std::string& fallback) {
  arguments.extractor = fallback;
  command.add_option("--extractor", arguments.extractor,
                     "Name of the extractor, see hermesh list (default: " + fallback + ")");
  command.add_option("-o", arguments.options, "key=value, an option of the extractor; may be repeated")
      ->allow_extra_args(false)
      // In other programs -o often names the output.
      ->check([](const std::string& given) {
        return given.find('=') != std::string::npos ? std::string()
                                                    : "takes key=value, an option of a method, not '" +
                                                          given + "'; name the output without -o";
      });
}

void to_world_units(MeshFile& file, Session& session) {
  double scale = session.scale;
  if (file.metres > 0.0 && session.metres > 0.0)
    scale *= file.metres / session.metres;
  else if (file.metres > 0.0)
    session.metres = file.metres;
  if (scale == 1.0) return;
  // In double precision, so that each point is rounded once.
  for (Eigen::Vector3d& point : file.points) point *= scale;
  if (file.origin) *file.origin *= scale;
}

PolygonMesh polygons_of(MeshFile&& file, const std::string& path, Session& session) {
  to_world_units(file, session);
  PolygonMesh mesh = about_file(path, [&] { return to_polygon_mesh(std::move(file)); });
  choose_diagonals(mesh);
  return mesh;
}

PolygonMesh read_polygons(const std::string& path, Session& session, const ReadOptions& options) {
  return polygons_of(read_mesh_file(path, session.context, options), path, session);
}

MadeSolid make_solid(const PolygonMesh& mesh, const std::string& name, const VoxelizeArguments& arguments,
                     Session& session) {
  const VoxelizeRecipe recipe = arguments.recipe(mesh, name);
  MadeSolid made = about_file(name, [&] { return hermesh::make_solid(mesh, recipe, session.context); });
  print_voxelized(session, name, mesh, made, arguments.chosen.voxelizer.name);
  report_thin_parts(made.thin, session);
  return made;
}

double length_in_world_units(const std::string& option, const std::string& text, double metres,
                             double diagonal) {
  double value = 0.0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string unit(end, text.data() + text.size());
  if (failure != std::errc() || !std::isfinite(value))
    throw UsageError(option + " must be a number such as 0.05, 0.1% or 0.05mm, not '" + text + "'");
  if (unit.empty()) return value;
  if (unit == "%") return value / 100.0 * diagonal;
  const std::optional<double> length = metres_in(unit);
  if (!length) throw UsageError(option + " '" + text + "' has an unknown unit; see --units");
  if (!(metres > 0.0))
    throw UsageError(
        option + " '" + text +
        "' has a unit, but the mesh file states none; pass --units with that of the coordinates");
  return value * (*length / metres);
}

double positive_length(const std::string& option, const std::string& text, double metres, double diagonal) {
  const double length = length_in_world_units(option, text, metres, diagonal);
  if (!(length > 0.0)) throw UsageError(option + " must be greater than 0, not '" + text + "'");
  return length;
}

void print_voxelized(Session& session, const std::string& file, const PolygonMesh& mesh,
                     const VoxelizationFacts& facts, const std::string& voxelizer) {
  made(session, "polygons", mesh.triangle_count());
  made(session, "voxels", facts.voxels);
  made(session, "voxel_size", facts.voxel_size);
  made(session, "voxelizer", voxelizer);
  print_summary(session, "voxelized " + file + ": " + std::to_string(mesh.triangle_count()) + " triangles, " +
                             std::to_string(facts.voxels) + " voxels of " +
                             length_text(session, facts.voxel_size) + ", " + voxelizer + ", " +
                             seconds_text(facts.seconds));
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

void report_thin_parts(const std::optional<ThinParts>& thin, Session& session) {
  const ThinParts parts = thin.value_or(ThinParts{.area = 1.0});
  made(session, "thickened_share", parts.thickened_area / parts.area);
  made(session, "thickened_by", parts.thickest);
  made(session, "thinnest_wall", parts.thinnest_wall);
  made(session, "merged_share", parts.merged_area / parts.area);
}

void add_attributes_option(CLI::App& command, std::string& attributes) {
  command
      .add_option("--attributes", attributes,
                  "Colours, normals, texture coordinates, materials and other values of the polygons: all "
                  "(default) transfers those that OUT can store, none drops them")
      ->check(CLI::IsMember({"all", "none"}));
}

void carry_attributes(const PolygonMesh& polygons, PolygonMesh& mesh, Session& session) {
  if (polygons.attributes.empty()) return;
  // Distances are compared only, so their scale matters for precision alone.
  const double scale = bounds(polygons).size().maxCoeff() / 1000.0;
  SourceAttributes(polygons, scale > 0.0 ? scale : 1.0).add_to(mesh, session.context);
  Json names = Json::array();
  for (const MeshAttribute& attribute : mesh.attributes) names.push_back(attribute.name);
  made(session, "attributes", names);
}

void write_output(const std::string& path, const PolygonMesh& mesh, Session& session) {
  constexpr double kMillimetre = 0.001;
  if (session.units.empty() && session.metres > 0.0 && session.metres != kMillimetre && !states_unit(path))
    session.context.note("'" + path + "' stores no unit; its coordinates are in " + unit_of(session.metres) +
                         " as those of the input (--units mm converts them)");
  write_mesh(path, mesh, session.context, session.metres);
}

}  // namespace hermesh::cli
