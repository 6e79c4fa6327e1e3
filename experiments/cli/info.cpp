// hermesh info: prints the contents of a mesh or volume file.
#include <algorithm>
#include <iostream>
#include <memory>

#include "algorithms/core/shown.h"
#include "algorithms/io/mesh_file.h"
#include "algorithms/io/vdb_file.h"
#include "algorithms/thesis/voxels/hermite_file.h"
#include "experiments/cli/cli11.h"

namespace hermesh::cli {
namespace {

std::string index_text(const std::array<int, 3>& index) {
  return "(" + std::to_string(index[0]) + ", " + std::to_string(index[1]) + ", " + std::to_string(index[2]) +
         ")";
}

Json numbers(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

void print_mesh(const std::filesystem::path& path, Session& session) {
  const MeshFile mesh = read_mesh_file(path, session.context);
  Bounds used;
  for (const Triangle& triangle : mesh.triangles)
    for (const std::uint32_t point : triangle) used.add(mesh.points[point]);
  for (const Quad& quad : mesh.quads)
    for (const std::uint32_t point : quad) used.add(mesh.points[point]);
  made(session, "kind", "polygon mesh");
  made(session, "points", mesh.points.size());
  made(session, "triangles", mesh.triangle_count());
  made(session, "quads", mesh.quads.size());
  made(session, "lower", numbers(used.lower));
  made(session, "upper", numbers(used.upper));
  if (mesh.origin) made(session, "origin", numbers(*mesh.origin));
  if (session.json) return;
  std::cout << "file       " << session.named(path.string()) << "\nkind       polygon mesh"
            << "\npoints     " << mesh.points.size() << "\ntriangles  " << mesh.triangles.size()
            << "\nquads      " << mesh.quads.size() << "\nlower      " << text(used.lower) << "\nupper      "
            << text(used.upper) << "\nsize       " << text(used.size()) << "\norigin     "
            << (mesh.origin ? text(*mesh.origin) : "not stated") << '\n';
}

Json to_json(const GridSummary& grid) {
  Json json = {{"name", grid.name},
               {"type", grid.value_type},
               {"class", grid.grid_class},
               {"voxel_size", grid.voxel_size}};
  if (!grid.is_read) return json;
  json["voxels"] = grid.active_voxels;
  json["memory_bytes"] = grid.memory_bytes;
  if (grid.active_voxels > 0) {
    json["lower"] = grid.lower;
    json["upper"] = grid.upper;
  }
  if (grid.background) json["background"] = *grid.background;
  return json;
}

void print_grid(const GridSummary& grid) {
  std::cout << "grid           " << shown(grid.name) << "\n  values       " << grid.value_type;
  std::cout << "\n  class        " << grid.grid_class << '\n';
  const auto& [x, y, z] = grid.voxel_size;
  const bool cubes = std::max({x, y, z}) - std::min({x, y, z}) < 1e-6 * x;
  std::cout << "  voxel size   " << (cubes ? text(x) : text(Eigen::Vector3d(x, y, z)));
  if (!grid.is_read) {
    std::cout << "\n  voxels       not read: values of this type are not supported\n";
    return;
  }
  std::cout << "\n  active       " << grid.active_voxels << " voxels";
  if (grid.active_voxels > 0)
    std::cout << ", indices " << index_text(grid.lower) << " to " << index_text(grid.upper);
  if (grid.background) std::cout << "\n  background   " << text(*grid.background);
  std::cout << "\n  memory       " << grid.memory_bytes << " bytes\n";
}

/// Prints the properties of Hermite data that describe_vdb() does not report.
void print_hermite(const std::filesystem::path& path, Session& session) {
  const HermiteSummary hermite = summary_of(read_hermite(path, session.context));
  made(session, "hermite",
       {{"representation", hermite.representation},
        {"normal_code", hermite.normal_code},
        {"crossings", hermite.crossings},
        {"leaves", hermite.leaves},
        {"memory_bytes", hermite.memory_bytes}});
  if (session.json) return;
  std::cout << "Hermite data\n  voxels       " << hermite.representation << "\n  normals      "
            << hermite.normal_code << "\n  crossings    " << hermite.crossings << ", in " << hermite.leaves
            << " leaves\n  memory       " << hermite.memory_bytes << " bytes";
  if (hermite.crossings > 0)
    std::cout << ", "
              << text(static_cast<double>(hermite.memory_bytes) / static_cast<double>(hermite.crossings))
              << " a crossing";
  std::cout << '\n';
}

void print_volume(const std::filesystem::path& path, Session& session) {
  const std::vector<GridSummary> grids = describe_vdb(path);
  Json list = Json::array();
  for (const GridSummary& grid : grids) list.push_back(to_json(grid));
  made(session, "kind", "OpenVDB");
  made(session, "grids", list);
  if (!session.json)
    std::cout << "file           " << session.named(path.string()) << "\nkind           OpenVDB, "
              << grids.size() << (grids.size() == 1 ? " grid\n" : " grids\n");
  bool has_hermite = false;
  for (const GridSummary& grid : grids) {
    if (!session.json) print_grid(grid);
    has_hermite |= grid.name == "hermite_signs" || grid.value_type.find("hermite_") != std::string::npos;
  }
  if (has_hermite) print_hermite(path, session);
}

}  // namespace

void add_info(CLI::App& app, Session& session) {
  CLI::App* command = add_command(app, session, "info", "Print the contents of a mesh or a .vdb file");
  auto file = std::make_shared<std::string>();
  command
      ->add_option(
          "FILE", *file,
          "Mesh (.ply .obj .off .stl .glb .gltf .3mf, also with .gz) or .vdb, or - for the standard input")
      ->required();
  add_files(*command, session, {.inputs = {file.get()}, .in = FileKind::mesh_or_volume});
  add_json_option(*command, session);
  set_work(*command, session, [file, &session] {
    const std::filesystem::path path = *file;
    if (is_mesh_path(path))
      print_mesh(path, session);
    else if (path.extension() == ".vdb")
      print_volume(path, session);
    else
      throw Error("unknown format of '" + *file + "': its name ends neither in .vdb nor in " + kMeshEndings);
    return kDone;
  });
}

}  // namespace hermesh::cli
