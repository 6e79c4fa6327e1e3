#include "algorithms/voxelization/inside/surface_probe.h"

#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "algorithms/lattice/sample_side.h"
#include "algorithms/voxelization/inside/wall_walk.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Blocks whose triangles are kept: as many as meet at a corner, since places next to each other are asked
/// for in turn.
constexpr std::size_t kBlocksKept = 8;
/// Steps of at most a voxel that a crevice is followed.
constexpr int kSteps = 8;
constexpr int kWays = 8;  ///< directions along a sheet
/// Nowhere is a way to be found through a cell with more triangles, and to look for it takes long.
constexpr std::size_t kCrowded = 64;

/// The corner of a cell that is up from it along x if bit 2 is set, along y if bit 1 is and along z if bit 0
/// is.
CellObstacles::Voxel corner(const CellObstacles::Voxel& cell, unsigned i) {
  return {cell[0] + std::int32_t(i >> 2), cell[1] + std::int32_t(i >> 1 & 1), cell[2] + std::int32_t(i & 1)};
}

}  // namespace

SurfaceProbe::SurfaceProbe(const IndexSoup& soup, const TriangleBins& bins,
                           const std::vector<BlockMask>& inside)
    : inside_(inside), finder_(bins.blocks()), obstacles_(soup, bins, kBlocksKept) {}

/// Whether a voxel is inside: 0 or 1, or 2 where there is no block and nobody knows.
int SurfaceProbe::inside_at(const Voxel& voxel) {
  const std::uint32_t block = finder_.find(tile_of(voxel));
  if (block == BlockTable::kNone) return 2;
  const unsigned place = place_in_tile(voxel);
  return int(inside_[block][place >> 6] >> (place & 63) & 1);
}

/// Looks the corners of a cell up, unless they are known from the last question.
void SurfaceProbe::enter(const Voxel& cell) {
  if (has_cell_ && cell == cell_) return;
  cell_ = cell;
  has_cell_ = true;
  inside_corners_ = outside_corners_ = 0;
  for (unsigned i = 0; i < 8; ++i) {
    const int inside = inside_at(corner(cell, i));
    if (inside == 2) continue;
    (inside == 1 ? inside_corners_ : outside_corners_) |= 1u << i;
  }
}

Side SurfaceProbe::seen_from(const Vector3d& p) {
  enter(cell_of(p));
  const auto sees_one = [&](unsigned corners) {
    for (; corners != 0; corners &= corners - 1) {
      const Voxel voxel = corner(cell_, unsigned(std::countr_zero(corners)));
      if (obstacles_.is_free_in(cell_, p, side_place(voxel))) return true;
    }
    return false;
  };
  return sees_one(outside_corners_) ? Side::outer : sees_one(inside_corners_) ? Side::inner : Side::unknown;
}

/// Moves p to the middle between what is in the way along the normal, and returns how wide the gap is there,
/// at most 2.
double SurfaceProbe::centre(Vector3d& p, const Vector3d& normal) {
  const double above = obstacles_.free_part(p, p + normal), below = obstacles_.free_part(p, p - normal);
  p += 0.5 * (above - below) * normal;
  return above + below;
}

/// From p, where the gap between the sheet below and another is too narrow to see a voxel from, on to where
/// it is wider, as long as it widens. Every step is free of triangles, so that what is seen in the end is on
/// the same side of all of them as p is.
Side SurfaceProbe::followed_from(Vector3d p, const Vector3d& normal) {
  if (obstacles_.triangles_in(cell_of(p)).size() > kCrowded) return Side::unknown;
  const Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  double width = centre(p, normal);
  for (int step = 0;; ++step) {
    const Side side = seen_from(p);
    if (side != Side::unknown || step == kSteps) return side;
    Vector3d widest_at = p;
    double widest = width;
    for (int i = 0; i < kWays; ++i) {
      // Never along an axis of the grid: many a model has sheets in such planes, and a way within one meets
      // it nowhere.
      const double angle = 0.3 + i * 2.0 * std::numbers::pi / kWays;
      const Vector3d way = std::cos(angle) * u + std::sin(angle) * v;
      Vector3d at = p + 0.9 * obstacles_.free_part(p, p + way) * way;
      const double here = centre(at, normal);
      if (here <= widest) continue;
      widest = here;
      widest_at = at;
    }
    if (widest <= width) return Side::unknown;
    width = widest;
    p = widest_at;
  }
}

}  // namespace hermesh
