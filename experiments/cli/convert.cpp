// hermesh voxelize, extract, remesh: polygons to level set, level set to mesh, and both in one.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <optional>

#include "algorithms/core/memory_estimate.h"
#include "algorithms/core/mesh_file.h"
#include "algorithms/core/vdb_file.h"
#include "experiments/cli/format.h"
#include "experiments/cli/output_path.h"
#include "experiments/cli/session.h"
#include "experiments/cli/signals.h"
#include "experiments/harness.h"

namespace hermesh::cli {
namespace {

struct VoxelizeArguments {
  std::optional<double> voxel_size;  ///< world units
  std::optional<std::int64_t> resolution;
  double exterior_band = 3.0, interior_band = 3.0;  ///< voxels
  std::string voxelizer = "openvdb";
};

struct ExtractArguments {
  std::string extractor = "dual-contouring";
  double isovalue = 0.0;
  std::string grid;                  ///< empty: `sdf`, or the only scalar grid there is
  std::string source;                ///< empty: the polygons are not at hand
  std::vector<std::string> options;  ///< key=value
};

struct Paths {
  std::string in, out;
};

/// A variant that was looked up, with its options checked.
struct ChosenExtractor {
  Extractor extractor;
  Options options;
};

CLI::Validator finite_number() {
  return CLI::Validator(
      [](const std::string& given) {
        double value = 0.0;
        return CLI::detail::lexical_cast(given, value) && std::isfinite(value)
                   ? std::string()
                   : "must be a finite number, not '" + given + "'";
      },
      "");
}

CLI::Validator at_least(double minimum, const std::string& words) {
  return CLI::Validator(
      [minimum, words](const std::string& given) {
        double value = 0.0;
        const bool good = CLI::detail::lexical_cast(given, value) && std::isfinite(value) && value >= minimum;
        return good ? std::string() : "must be " + words + ", not '" + given + "'";
      },
      "");
}

void add_voxelize_options(CLI::App& command, VoxelizeArguments& arguments) {
  // Exactly one of the two, or the program would have to guess a size.
  CLI::Option_group* size = command.add_option_group("Voxel size, exactly one of");
  size->add_option("--voxel-size", arguments.voxel_size, "Edge of a voxel in world units")
      ->check(at_least(std::numeric_limits<double>::min(), "a finite number above 0"));
  size->add_option("--resolution", arguments.resolution, "Voxels along the longest side of the mesh")
      ->check(at_least(1.0, "a whole number of at least 1"));
  size->require_option(1);
  command.add_option("--voxelizer", arguments.voxelizer,
                     "Name of the voxelizer, see hermesh list (default: " + arguments.voxelizer + ")");
  // Both ends of an edge that the surface crosses are at most a voxel away from it.
  const auto band = at_least(1.0, "a finite number of voxels of at least 1");
  command
      .add_option("--exterior-band", arguments.exterior_band,
                  "Width of the band outside, in voxels (default: 3)")
      ->check(band);
  command
      .add_option("--interior-band", arguments.interior_band,
                  "Width of the band inside, in voxels (default: 3)")
      ->check(band);
}

void add_extract_options(CLI::App& command, ExtractArguments& arguments) {
  command.add_option("--extractor", arguments.extractor,
                     "Name of the extractor, see hermesh list (default: " + arguments.extractor + ")");
  command
      .add_option("--isovalue", arguments.isovalue,
                  "Value of the surface, in the units of the grid (default: 0)")
      ->check(finite_number());
  command.add_option("-o", arguments.options, "key=value, an option of the extractor; may be repeated")
      ->allow_extra_args(false);
}

Voxelizer choose_voxelizer(const VoxelizeArguments& arguments) {
  return as_usage([&] { return find_variant(all_voxelizers(), arguments.voxelizer); });
}

ChosenExtractor choose_extractor(const ExtractArguments& arguments) {
  return as_usage([&] {
    const Extractor extractor = find_variant(all_extractors(), arguments.extractor);
    std::map<std::string, std::string> given;
    for (const std::string& text : arguments.options)
      if (const auto option = parse_option(text); !given.insert(option).second)
        throw Error("option '" + option.first + "' of " + extractor.name + " is given twice");
    return ChosenExtractor{extractor, Options(extractor.name, extractor.options, given)};
  });
}

double voxel_size_for(const PolygonMesh& mesh, const VoxelizeArguments& arguments, const std::string& file) {
  if (arguments.voxel_size) return *arguments.voxel_size;
  const double longest_side = bounds(mesh).size().maxCoeff();
  if (!(longest_side > 0.0))
    throw Error("'" + file + "' has no extent, so that --resolution gives no voxel size: use --voxel-size");
  return longest_side / static_cast<double>(*arguments.resolution);
}

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

void print_summary(const Session& session, const std::string& line) {
  if (session.quiet) return;
  std::cout << line << '\n';
}

LevelSet voxelize(const PolygonMesh& mesh, const std::string& file, const VoxelizeArguments& arguments,
                  const Voxelizer& voxelizer, Session& session) {
  const double voxel_size = voxel_size_for(mesh, arguments, file);
  check_voxelization_fits(mesh, voxel_size, arguments.exterior_band, arguments.interior_band);
  const Stopwatch watch;
  LevelSet level_set = voxelizer.voxelize(
      {mesh, voxel_size, arguments.exterior_band, arguments.interior_band, session.context});
  session.context.check();
  print_summary(session, "voxelized " + file + ": " + std::to_string(mesh.triangle_count()) + " triangles, " +
                             std::to_string(level_set.active_voxels()) + " voxels of " + text(voxel_size) +
                             ", " + voxelizer.name + ", " + seconds_text(watch.seconds()));
  return level_set;
}

PolygonMesh extract(const LevelSet& level_set, const PolygonMesh* source, const ChosenExtractor& chosen,
                    double isovalue, Session& session) {
  const Stopwatch watch;
  PolygonMesh mesh = chosen.extractor.extract({level_set, isovalue, source, chosen.options, session.context});
  session.context.check();
  // No reader takes a mesh file without polygons, ours included.
  if (mesh.empty())
    throw Error("there is no surface at the isovalue " + text(isovalue) +
                ", nothing was written: the volume has no sample inside, or none outside");
  print_summary(session, "extracted " + std::to_string(mesh.points.size()) + " points, " +
                             std::to_string(mesh.triangles.size()) + " triangles, " +
                             std::to_string(mesh.quads.size()) + " quads, " + chosen.extractor.name + ", " +
                             seconds_text(watch.seconds()));
  return mesh;
}

void save(const std::string& path, const PolygonMesh& mesh, Session& session) {
  write_mesh(path, mesh, session.context);
  work_is_finished();
}

int run_voxelize(const Paths& paths, const VoxelizeArguments& arguments, Session& session) {
  const Voxelizer voxelizer = choose_voxelizer(arguments);
  check_volume_output(paths.out);
  const PolygonMesh mesh = read_mesh(paths.in, session.context);
  const LevelSet level_set = voxelize(mesh, paths.in, arguments, voxelizer, session);
  write_level_set(paths.out, level_set, session.context);
  work_is_finished();
  return kDone;
}

int run_extract(const Paths& paths, const ExtractArguments& arguments, Session& session) {
  const ChosenExtractor chosen = choose_extractor(arguments);
  check_mesh_output(paths.out);
  std::optional<PolygonMesh> source;
  if (!arguments.source.empty()) source = read_mesh(arguments.source, session.context);
  const LevelSet level_set = read_level_set(paths.in, arguments.grid, session.context);
  save(paths.out, extract(level_set, source ? &*source : nullptr, chosen, arguments.isovalue, session),
       session);
  return kDone;
}

int run_remesh(const Paths& paths, const VoxelizeArguments& voxelizing, const ExtractArguments& extracting,
               Session& session) {
  const Voxelizer voxelizer = choose_voxelizer(voxelizing);
  const ChosenExtractor chosen = choose_extractor(extracting);
  check_mesh_output(paths.out);
  const PolygonMesh mesh = read_mesh(paths.in, session.context);
  const LevelSet level_set = voxelize(mesh, paths.in, voxelizing, voxelizer, session);
  save(paths.out, extract(level_set, &mesh, chosen, extracting.isovalue, session), session);
  return kDone;
}

void add_paths(CLI::App& command, Paths& paths, const std::string& in, const std::string& out) {
  command.add_option("IN", paths.in, in)->required();
  command.add_option("OUT", paths.out, out)->required();
}

constexpr const char* kMeshIn = "Mesh: .ply .obj .off .stl, also with .gz";
constexpr const char* kMeshOut = "Mesh: .ply .obj .off .stl";

}  // namespace

void add_conversions(CLI::App& app, Session& session) {
  struct Arguments {
    Paths paths;
    VoxelizeArguments voxelizing;
    ExtractArguments extracting;
  };
  const auto arguments = std::make_shared<Arguments>();

  CLI::App* command = add_command(app, session, "voxelize", "Polygons to a level set, the grid named sdf");
  add_paths(*command, arguments->paths, kMeshIn, "Level set: .vdb");
  add_voxelize_options(*command, arguments->voxelizing);
  command->callback([arguments, &session] {
    session.command = [arguments, &session] {
      return run_voxelize(arguments->paths, arguments->voxelizing, session);
    };
  });

  command = add_command(app, session, "extract", "A volume to a mesh");
  add_paths(*command, arguments->paths, "Volume: .vdb", kMeshOut);
  add_extract_options(*command, arguments->extracting);
  command->add_option("--grid", arguments->extracting.grid,
                      "Name of the grid (default: sdf, or the only scalar grid there is)");
  command->add_option("--source", arguments->extracting.source,
                      "Mesh that the volume was made from, for extractors that want exact Hermite data");
  command->callback([arguments, &session] {
    session.command = [arguments, &session] {
      return run_extract(arguments->paths, arguments->extracting, session);
    };
  });

  command = add_command(app, session, "remesh", "Polygons to a level set and back to a mesh");
  add_paths(*command, arguments->paths, kMeshIn, kMeshOut);
  add_voxelize_options(*command, arguments->voxelizing);
  add_extract_options(*command, arguments->extracting);
  command->callback([arguments, &session] {
    session.command = [arguments, &session] {
      return run_remesh(arguments->paths, arguments->voxelizing, arguments->extracting, session);
    };
  });
}

}  // namespace hermesh::cli
