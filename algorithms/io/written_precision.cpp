#include "algorithms/io/written_precision.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/io/mesh_file_formats.h"
#include "algorithms/lattice/grid_placement.h"

namespace hermesh {
namespace {

constexpr double kMostRounding = 0.01;  // voxels

std::string text(double value) {
  char digits[32];
  return {digits, std::to_chars(digits, digits + sizeof digits, value, std::chars_format::general, 3).ptr};
}

/// Largest coordinates, along any axis, of the box of a volume's active samples.
struct Farthest {
  double from_zero = 0.0;    ///< from the zero of the world, world units
  double from_origin = 0.0;  ///< from the origin of its meshes, world units
};

Farthest farthest(const LevelSet& level_set) {
  const openvdb::FloatGrid& grid = *level_set.grid().grid;
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  Farthest result;
  // A volume without active samples has no mesh, and zeros pass every check.
  if (box.empty()) return result;
  const IndexToWorld placement = placement_of(grid);
  // The transform is affine, so a coordinate is largest at a corner of the box.
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d index;
    for (int axis = 0; axis < 3; ++axis)
      index[axis] =
          double(corner >> axis & 1 ? box.max()[axis] : box.min()[axis]) - placement.base[std::size_t(axis)];
    const Eigen::Vector3d local = placement.local(index);
    result.from_origin = std::max(result.from_origin, local.cwiseAbs().maxCoeff());
    result.from_zero = std::max(result.from_zero, (placement.origin + local).cwiseAbs().maxCoeff());
  }
  return result;
}

/// Half the distance between adjacent numbers at a coordinate, where the significand has `bits` bits.
double rounding_at(double coordinate, int bits) {
  return coordinate > 0.0 ? std::ldexp(1.0, std::ilogb(coordinate) - bits) : 0.0;
}

}  // namespace

bool is_written_in_single(const std::filesystem::path& path) {
  // By the name, because the file is not there yet.
  const auto named = mesh_formats::parse_mesh_path(path);
  return named && named->format == mesh_formats::Format::stl;
}

void check_written_precision(const std::filesystem::path& path, const LevelSet& level_set) {
  // The box of the active samples bounds every mesh of the volume, so none need be made to refuse it.
  const Farthest reach = farthest(level_set);
  const double voxel = level_set.voxel_size();
  const auto check = [&](double coordinate, int bits, const std::string& precision,
                         const std::string& advice) {
    // Rounding is to the nearest, so no coordinate moves farther than half a step.
    const double rounding = rounding_at(coordinate, bits);
    if (rounding <= kMostRounding * voxel) return;
    throw Error(mesh_formats::in_quotes(path.string()) + ": " + precision + " rounds coordinates of " +
                text(coordinate) + " by up to " + text(rounding) + ", more than a hundredth of a voxel of " +
                text(voxel) + ", so nothing was written; " + advice);
  };
  // From the coarsest to the finest: a file in single precision, one in double precision, and the mesh in
  // memory, whose points are single precision about its own origin whatever the file.
  const bool single = is_written_in_single(path);
  if (single)
    check(reach.from_zero, 24, "STL's single precision",
          "write .ply, .obj, .off, .glb or .3mf, which hold more, or move the model nearer to the origin");
  check(reach.from_zero, 53, "double precision", "move the model nearer to the origin, or use larger voxels");
  check(reach.from_origin, 24, "single precision about the mesh's own origin",
        "use larger voxels, or divide the model: its parts lie too far from one another");
}

}  // namespace hermesh
