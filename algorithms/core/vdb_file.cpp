#include "algorithms/core/vdb_file.h"

#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <sstream>

#include "algorithms/core/atomic_file.h"
#include "algorithms/core/level_set_grid.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

/// Runs f and turns what OpenVDB throws into one sentence about the file.
template <class F>
auto about_file(const fs::path& path, F&& f) {
  try {
    return f();
  } catch (const openvdb::LookupError& e) {
    throw Error(path.string() + " holds a grid of a type that this program does not know (" + e.what() + ")");
  } catch (const openvdb::Exception& e) {
    throw Error(path.string() + " cannot be read as a .vdb file (" + e.what() + "); is it complete?");
  } catch (const std::bad_alloc&) {
    throw Error(path.string() + " asks for more memory than there is; is it complete?");
  } catch (const std::length_error&) {
    throw Error(path.string() + " asks for more memory than there is; is it complete?");
  }
}

/// OpenVDB reports a missing file and one of another kind in the same words; these are ours.
void check_is_vdb(const fs::path& path) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) throw Error(path.string() + " does not exist");
  if (fs::is_directory(path, ignored)) throw Error(path.string() + " is a folder, not a .vdb file");
  std::ifstream in(path, std::ios::binary);
  if (!in) throw Error(path.string() + " cannot be opened for reading");
  constexpr std::int64_t kMagic = 0x56444220;
  std::int64_t magic = 0;
  if (!in.read(reinterpret_cast<char*>(&magic), sizeof magic))
    throw Error(path.string() + (fs::file_size(path, ignored) == 0
                                     ? " is empty"
                                     : " is truncated: it is too short for a .vdb file"));
  if (magic != kMagic) throw Error(path.string() + " is not a .vdb file");
}

/// Reads what stands before the grids, which names where each of them ends. OpenVDB itself takes the bytes that are
/// missing at the end of a truncated file for zeros.
class GridEnds : public openvdb::io::Archive {
 public:
  void check(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    readHeader(in);
    openvdb::io::setVersion(in, libraryVersion(), fileVersion());  // the descriptors are read by it
    openvdb::MetaMap metadata;
    metadata.readMeta(in);
    if (!inputHasGridOffsets()) return;
    std::int64_t end = 0;
    for (std::int32_t left = readGridCount(in); left > 0 && in; --left) {
      openvdb::io::GridDescriptor descriptor;
      descriptor.read(in);
      end = std::max(end, descriptor.getEndPos());
      descriptor.seekToEnd(in);
    }
    if (!in || end > static_cast<std::int64_t>(fs::file_size(path)))
      throw Error(path.string() + " is truncated: its last grid ends beyond the end of the file");
  }
};

std::string names_of(const openvdb::io::File& file) {
  std::string names;
  for (auto it = file.beginName(); it != file.endName(); ++it) names += (names.empty() ? "" : ", ") + *it;
  return names;
}

openvdb::FloatGrid::ConstPtr as_float(const openvdb::GridBase::Ptr& grid, const std::string& what) {
  if (auto same = openvdb::gridPtrCast<openvdb::FloatGrid>(grid)) return same;
  if (auto doubles = openvdb::gridPtrCast<openvdb::DoubleGrid>(grid))
    return std::make_shared<openvdb::FloatGrid>(*doubles);
  if (auto integers = openvdb::gridPtrCast<openvdb::Int32Grid>(grid))
    return std::make_shared<openvdb::FloatGrid>(*integers);
  throw Error(what + " holds " + grid->valueType() +
              " values; a scalar grid is needed (float, double or int32)");
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
  initialize_openvdb();
  check_is_vdb(path);
  return about_file(path, [&] {
    GridEnds().check(path);
    openvdb::io::File file(path.string());
    file.open(/*delayLoad=*/false);
    const std::string names = names_of(file);
    std::string name = grid_name;
    if (name.empty() && file.hasGrid("sdf")) name = "sdf";
    if (name.empty()) {
      if (names.empty()) throw Error(path.string() + " holds no grid");
      if (names.find(", ") != std::string::npos)
        throw Error(path.string() + " holds several grids (" + names + "); choose one with --grid");
      name = names;
    }
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
  AtomicFile file(path);
  // A shallow copy, so that naming it does not change the grid that others hold.
  openvdb::FloatGrid::Ptr grid = openvdb::ConstPtrCast<openvdb::FloatGrid>(level_set.grid().grid)->copy();
  grid->setName("sdf");
  try {
    openvdb::io::File out(file.path().string());
    out.write(openvdb::GridCPtrVec{grid});
    out.close();
  } catch (const openvdb::Exception& e) {
    throw Error(path.string() + " cannot be written (" + e.what() + ")");
  }
  file.commit();
}

std::vector<GridSummary> describe_vdb(const fs::path& path) {
  initialize_openvdb();
  check_is_vdb(path);
  return about_file(path, [&] {
    GridEnds().check(path);
    openvdb::io::File file(path.string());
    file.open(/*delayLoad=*/false);
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
      summary.voxel_size = std::cbrt(std::abs(grid->transform().voxelVolume()));
      if (const auto scalar = openvdb::gridConstPtrCast<openvdb::FloatGrid>(grid))
        summary.background = scalar->background();
    }
    return summaries;
  });
}

}  // namespace hermesh
