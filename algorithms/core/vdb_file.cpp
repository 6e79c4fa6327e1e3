#include "algorithms/core/vdb_file.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <sstream>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/vdb_archive.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

openvdb::FloatGrid::ConstPtr as_float(const openvdb::GridBase::Ptr& grid, const std::string& what) {
  if (auto same = openvdb::gridPtrCast<openvdb::FloatGrid>(grid)) return same;
  if (auto doubles = openvdb::gridPtrCast<openvdb::DoubleGrid>(grid))
    return std::make_shared<openvdb::FloatGrid>(*doubles);
  if (auto integers = openvdb::gridPtrCast<openvdb::Int32Grid>(grid))
    return std::make_shared<openvdb::FloatGrid>(*integers);
  if (auto integers = openvdb::gridPtrCast<openvdb::Int64Grid>(grid))
    return std::make_shared<openvdb::FloatGrid>(*integers);
  if (auto truths = openvdb::gridPtrCast<openvdb::BoolGrid>(grid)) return std::make_shared<openvdb::FloatGrid>(*truths);
  throw Error(what + " holds " + grid->valueType() +
              " values; a scalar grid is needed (float, double, int32, int64 or bool)");
}

bool is_scalar(const openvdb::GridBase& grid) {
  return grid.isType<openvdb::FloatGrid>() || grid.isType<openvdb::DoubleGrid>() ||
         grid.isType<openvdb::Int32Grid>() || grid.isType<openvdb::Int64Grid>() || grid.isType<openvdb::BoolGrid>();
}

/// The grid to read where the user named none. @throws Error
std::string chosen_grid(openvdb::io::File& file, const fs::path& path) {
  if (file.hasGrid("sdf")) return "sdf";
  std::vector<std::string> scalar;
  int grids = 0;
  for (auto it = file.beginName(); it != file.endName(); ++it, ++grids)
    if (is_scalar(*file.readGridMetadata(*it))) scalar.push_back(*it);
  if (grids == 0) throw Error(path.string() + " holds no grid");
  if (scalar.size() == 1) return scalar[0];
  if (grids == 1) return *file.beginName();  // its type is the reader's complaint
  throw Error(path.string() + " holds several grids (" + grid_names(file) +
              "); choose one with --grid, or keep a mask or a tolerance in a file of its own");
}

void check_finite(const openvdb::FloatGrid& grid, const std::string& what) {
  if (!std::isfinite(grid.background())) throw Error(what + " has a background that is not finite");
  for (auto it = grid.cbeginValueAll(); it; ++it)
    if (!std::isfinite(*it)) {
      std::ostringstream place;
      place << it.getCoord();
      throw Error(what + " holds a value that is not finite at index " + place.str() + "; replace it first");
    }
}

}  // namespace

LevelSet read_level_set(const fs::path& path, const std::string& grid_name, RunContext& context) {
  Stage stage(context, "read volume");
  return about_vdb_file(path, [&] {
    openvdb::io::File file(path.string());
    open_vdb(file, path);
    const std::string names = grid_names(file);
    const std::string name = grid_name.empty() ? chosen_grid(file, path) : grid_name;
    if (!file.hasGrid(name))
      throw Error(path.string() + " has no grid named '" + name + "'; it has " +
                  (names.empty() ? "none" : names));
    const std::string what = "the grid '" + name + "' of " + path.string();
    openvdb::FloatGrid::ConstPtr grid = as_float(file.readGrid(name), what);
    check_finite(*grid, what);
    return make_level_set(std::move(grid));
  });
}

void write_level_set(const fs::path& path, const LevelSet& level_set, RunContext& context) {
  Stage stage(context, "write volume");
  initialize_openvdb();
  // A shallow copy, so that naming it does not change the grid that others hold.
  openvdb::FloatGrid::Ptr grid = openvdb::ConstPtrCast<openvdb::FloatGrid>(level_set.grid().grid)->copy();
  grid->setName("sdf");
  write_grids(path, {grid});
}

std::vector<GridSummary> describe_vdb(const fs::path& path) {
  return about_vdb_file(path, [&] {
    openvdb::io::File file(path.string());
    open_vdb(file, path);
    std::vector<GridSummary> summaries;
    for (auto it = file.beginName(); it != file.endName(); ++it) {
      GridSummary& summary = summaries.emplace_back();
      summary.name = *it;
      const openvdb::GridBase::Ptr grid = file.readGrid(*it);
      summary.value_type = grid->type();
      summary.grid_class = openvdb::GridBase::gridClassToString(grid->getGridClass());
      summary.active_voxels = grid->activeVoxelCount();
      summary.memory_bytes = grid->memUsage();
      const openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
      if (!box.empty())
        for (int axis = 0; axis < 3; ++axis)
          summary.lower[axis] = box.min()[axis], summary.upper[axis] = box.max()[axis];
      for (int axis = 0; axis < 3; ++axis) summary.voxel_size[axis] = grid->voxelSize()[axis];
      using Numbers = openvdb::TypeList<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::Int32Grid, openvdb::Int64Grid,
                                        openvdb::BoolGrid>;
      grid->apply<Numbers>([&](const auto& of_numbers) { summary.background = double(of_numbers.background()); });
    }
    return summaries;
  });
}

}  // namespace hermesh
