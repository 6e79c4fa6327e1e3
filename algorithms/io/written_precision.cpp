#include "algorithms/io/written_precision.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/io/mesh_file_formats.h"
#include "algorithms/lattice/grid_placement.h"

namespace hermesh {
namespace {

using mesh_formats::three_digits;

constexpr double kMostRounding = 0.01;  // voxels

/// Largest coordinates, along any axis, of the box of a volume's active samples, in world units.
struct Farthest {
  double from_zero = 0.0;    ///< from the zero of the world
  double from_origin = 0.0;  ///< from the origin of its meshes
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

/// Returns half the distance between adjacent numbers at a coordinate, for a significand of `bits` bits.
double rounding_at(double coordinate, int bits) {
  return coordinate > 0.0 ? std::ldexp(1.0, std::ilogb(coordinate) - bits) : 0.0;
}

}  // namespace

bool is_written_in_single(const std::filesystem::path& path) {
  const auto named = mesh_formats::parse_mesh_path(path);
  return named && named->format == mesh_formats::Format::stl;
}

void check_written_precision(const std::filesystem::path& path, const LevelSet& level_set) {
  // The box of the active samples bounds every mesh of the volume.
  const Farthest reach = farthest(level_set);
  const double voxel = level_set.voxel_size();
  const auto check = [&](double coordinate, int bits, const std::string& precision,
                         const std::string& advice) {
    const double rounding = rounding_at(coordinate, bits);
    if (rounding <= kMostRounding * voxel) return;
    throw Error(mesh_formats::joined(mesh_formats::in_quotes(path.string()), ": ", precision,
                                     " rounds coordinates of ", three_digits(coordinate), " by up to ",
                                     three_digits(rounding), ", more than a hundredth of a voxel of ",
                                     three_digits(voxel), ", so nothing was written; ", advice));
  };
  // The points of the mesh in memory are in single precision about its own origin.
  if (is_written_in_single(path))
    check(reach.from_zero, 24, "STL's single precision",
          "write .ply, .obj, .off, .glb or .3mf, which hold more, or move the model nearer to the origin");
  check(reach.from_zero, 53, "double precision", "move the model nearer to the origin, or use larger voxels");
  check(reach.from_origin, 24, "single precision about the mesh's own origin",
        "use larger voxels, or divide the model: its parts lie too far from one another");
}

}  // namespace hermesh
