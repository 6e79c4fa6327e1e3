// hermesh info: what a file holds.
#include <algorithm>
#include <iostream>
#include <memory>

#include "algorithms/io/mesh_file.h"
#include "algorithms/core/shown.h"
#include "algorithms/io/vdb_file.h"
#include "algorithms/hermite/hermite_file.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/format.h"
#include "experiments/cli/session.h"

namespace hermesh::cli {
namespace {

std::string index_text(const std::array<int, 3>& index) {
  return "(" + std::to_string(index[0]) + ", " + std::to_string(index[1]) + ", " + std::to_string(index[2]) +
         ")";
}

void print_mesh(const std::filesystem::path& path, RunContext& context) {
  const MeshFile mesh = read_mesh_file(path, context);
  Bounds used;
  for (const Triangle& triangle : mesh.triangles)
    for (const std::uint32_t point : triangle) used.add(mesh.points[point]);
  for (const Quad& quad : mesh.quads)
    for (const std::uint32_t point : quad) used.add(mesh.points[point]);
  std::cout << "file       " << path.string() << "\nkind       polygon mesh"
            << "\npoints     " << mesh.points.size() << "\ntriangles  " << mesh.triangles.size()
            << "\nquads      " << mesh.quads.size() << "\nlower      " << text(used.lower) << "\nupper      "
            << text(used.upper) << "\nsize       " << text(used.size()) << "\norigin     "
            << (mesh.origin ? text(*mesh.origin) : "not stated") << '\n';
}

void print_grid(const GridSummary& grid) {
  std::cout << "grid           " << shown(grid.name) << "\n  values       " << grid.value_type;
  std::cout << "\n  class        " << grid.grid_class << '\n';
  const auto& [x, y, z] = grid.voxel_size;
  const bool cubes = std::max({x, y, z}) - std::min({x, y, z}) < 1e-6 * x;
  std::cout << "  voxel size   " << (cubes ? text(x) : text(Eigen::Vector3d(x, y, z)));
  if (!grid.is_read) {
    std::cout << "\n  voxels       not read: this program knows no values of this type\n";
    return;
  }
  std::cout << "\n  active       " << grid.active_voxels << " voxels";
  if (grid.active_voxels > 0)
    std::cout << ", indices " << index_text(grid.lower) << " to " << index_text(grid.upper);
  if (grid.background) std::cout << "\n  background   " << text(*grid.background);
  std::cout << "\n  memory       " << grid.memory_bytes << " bytes\n";
}

/// Prints what describe_vdb() cannot tell of grids that hold Hermite data.
void print_hermite(const std::filesystem::path& path, RunContext& context) {
  const HermiteSummary hermite = summary_of(read_hermite(path, context));
  std::cout << "Hermite data\n  voxels       " << hermite.representation << "\n  normals      " << hermite.normal_code
            << "\n  crossings    " << hermite.crossings << ", in " << hermite.leaves << " leaves\n  memory       "
            << hermite.memory_bytes << " bytes";
  if (hermite.crossings > 0)
    std::cout << ", " << text(static_cast<double>(hermite.memory_bytes) / static_cast<double>(hermite.crossings))
              << " a crossing";
  std::cout << '\n';
}

void print_volume(const std::filesystem::path& path, RunContext& context) {
  const std::vector<GridSummary> grids = describe_vdb(path);
  std::cout << "file           " << path.string() << "\nkind           OpenVDB, " << grids.size()
            << (grids.size() == 1 ? " grid\n" : " grids\n");
  bool has_hermite = false;
  for (const GridSummary& grid : grids) {
    print_grid(grid);
    has_hermite |= grid.name == "hermite_signs" || grid.value_type.find("hermite_") != std::string::npos;
  }
  if (has_hermite) print_hermite(path, context);
}

}  // namespace

void add_info(CLI::App& app, Session& session) {
  CLI::App* command = add_command(app, session, "info", "What a mesh or a .vdb file holds");
  auto file = std::make_shared<std::string>();
  command->add_option("FILE", *file, "Mesh (.ply .obj .off .stl, also with .gz) or .vdb")->required();
  command->callback([file, &session] {
    session.command = [file, &session] {
      const std::filesystem::path path = *file;
      if (is_mesh_path(path))
        print_mesh(path, session.context);
      else if (path.extension() == ".vdb")
        print_volume(path, session.context);
      else
        throw Error("cannot tell what '" + *file + "' is: its name ends neither in .vdb nor in " +
                    ".ply, .obj, .off or .stl (.gz may follow)");
      return kDone;
    };
  });
}

}  // namespace hermesh::cli
