#include "algorithms/io/vdb_file.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <sstream>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/io/vdb_archive.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

using ScalarGrids = openvdb::TypeList<openvdb::FloatGrid, openvdb::DoubleGrid, openvdb::Int32Grid,
                                      openvdb::Int64Grid, openvdb::BoolGrid, openvdb::MaskGrid>;

// apply() calls its function, and returns true, only for a grid of one of the listed types.
bool is_scalar(const openvdb::GridBase& grid) {
  return grid.apply<ScalarGrids>([](const auto&) {});
}

Error not_scalar(const openvdb::GridBase& grid, const std::string& what) {
  return Error(what + " holds " + grid.valueType() +
               " values; a scalar grid is needed (float, double, int32, int64, bool or mask)");
}

/// Returns a mask as floats: 1 in active voxels.
openvdb::FloatGrid::Ptr from_mask(const openvdb::MaskGrid& mask) {
  auto grid = openvdb::FloatGrid::create(std::make_shared<openvdb::FloatTree>(
      mask.tree(), /*inactive=*/0.0f, /*active=*/1.0f, openvdb::TopologyCopy()));
  grid->insertMeta(mask);
  grid->setTransform(mask.transform().copy());
  return grid;
}

openvdb::FloatGrid::ConstPtr as_float(const openvdb::GridBase::Ptr& grid, const std::string& what) {
  if (auto same = openvdb::gridPtrCast<openvdb::FloatGrid>(grid)) return same;
  if (auto mask = openvdb::gridPtrCast<openvdb::MaskGrid>(grid)) return from_mask(*mask);
  // A value beyond single precision becomes infinite, which check_finite() refuses.
  openvdb::FloatGrid::Ptr converted;
  grid->apply<ScalarGrids>([&]<class Grid>(const Grid& scalar) {
    if constexpr (!std::is_same_v<Grid, openvdb::MaskGrid>)
      converted = std::make_shared<openvdb::FloatGrid>(scalar);
  });
  if (!converted) throw not_scalar(*grid, what);
  return converted;
}

/// Returns the grid to read if the user named none. @throws Error that lists the grids if the choice is
/// unclear.
std::string chosen_grid(VdbReader& file, const fs::path& path) {
  if (file.has("sdf")) return "sdf";
  const std::vector<std::string> names = file.names();
  std::vector<std::string> scalar;
  for (const std::string& name : names)
    if (is_scalar(*file.read_metadata(name))) scalar.push_back(name);
  if (names.empty()) throw Error(path.string() + " holds no grid");
  if (scalar.size() == 1) return scalar[0];
  if (names.size() == 1) return names[0];  // the reader refuses its type
  throw Error(path.string() + " holds several grids (" + file.joined_names() +
              "); choose one with --grid, or keep a mask or a tolerance in a file of its own");
}

void check_finite(const openvdb::FloatGrid& grid, const std::string& what) {
  // Inactive values and tiles count, too, since their signs are used.
  if (!std::isfinite(grid.background())) throw Error(what + " has a background that is not finite");
  for (auto it = grid.cbeginValueAll(); it; ++it)
    if (!std::isfinite(*it)) {
      std::ostringstream place;
      place << it.getCoord();
      throw Error(what + " holds a value that is not finite at index " + place.str() + "; replace it first");
    }
}

GridSummary summary_of(const openvdb::GridBase& grid, const std::string& name) {
  GridSummary summary;
  summary.name = name;
  summary.value_type = grid.type();
  summary.grid_class = openvdb::GridBase::gridClassToString(grid.getGridClass());
  summary.active_voxels = grid.activeVoxelCount();
  summary.memory_bytes = grid.memUsage();
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  if (!box.empty())
    for (int axis = 0; axis < 3; ++axis)
      summary.lower[axis] = box.min()[axis], summary.upper[axis] = box.max()[axis];
  for (int axis = 0; axis < 3; ++axis) summary.voxel_size[axis] = grid.voxelSize()[axis];
  grid.apply<ScalarGrids>([&]<class Grid>(const Grid& of_numbers) {
    if constexpr (!std::is_same_v<Grid, openvdb::MaskGrid>)
      summary.background = double(of_numbers.background());
  });
  return summary;
}

}  // namespace

LevelSet read_level_set(const fs::path& path, const std::string& grid_name, RunContext& context) {
  Stage stage(context, "read volume");
  return about_vdb_file(path, [&] {
    VdbReader file(path);
    const std::string name = grid_name.empty() ? chosen_grid(file, path) : grid_name;
    const std::string what = "the grid '" + shown(name) + "' of " + path.string();
    // The type is checked before memory is spent on a tree of vectors.
    const openvdb::GridBase::Ptr head = file.read_metadata(name);
    if (!is_scalar(*head)) throw not_scalar(*head, what);
    openvdb::FloatGrid::ConstPtr grid = as_float(file.read(name), what);
    check_finite(*grid, what);
    return make_level_set(std::move(grid));
  });
}

void write_level_set(const fs::path& path, const LevelSet& level_set, RunContext& context) {
  Stage stage(context, "write volume");
  initialize_openvdb();
  // A shallow copy, so that the name of a shared grid does not change.
  openvdb::FloatGrid::Ptr grid = openvdb::ConstPtrCast<openvdb::FloatGrid>(level_set.grid().grid)->copy();
  grid->setName("sdf");
  write_grids(path, {grid});
}

std::vector<GridSummary> describe_vdb(const fs::path& path) {
  return about_vdb_file(path, [&] {
    VdbReader file(path);
    std::vector<GridSummary> summaries;
    for (const std::string& name : file.names()) {
      const openvdb::GridBase::Ptr grid = file.can_read(name) ? file.read(name) : file.read_metadata(name);
      summaries.push_back(summary_of(*grid, name));
      summaries.back().is_read = file.can_read(name);
    }
    return summaries;
  });
}

}  // namespace hermesh
