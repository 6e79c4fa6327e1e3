#include "algorithms/voxelization/surface_probe.h"

#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "algorithms/core/sample_side.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// How far off a side the way to a voxel starts, in voxels: beyond rounding and beyond doubled faces.
constexpr double kOff = 1e-3;
/// Blocks whose triangles are kept: as many as meet at a corner, since places next to each other are asked for in turn.
constexpr std::size_t kKept = 8;
/// Steps of at most a voxel that a crevice is followed.
constexpr int kSteps = 8;
constexpr int kWays = 8;  ///< directions along a sheet

/// The corner of a cell that is up from it along x if bit 2 is set, along y if bit 1 is and along z if bit 0
/// is.
CellObstacles::Voxel corner(const CellObstacles::Voxel& cell, unsigned i) {
  return {cell[0] + std::int32_t(i >> 2), cell[1] + std::int32_t(i >> 1 & 1), cell[2] + std::int32_t(i & 1)};
}

}  // namespace

SurfaceProbe::SurfaceProbe(const IndexSoup& soup, const TriangleBins& bins,
                           const std::vector<VoxelBits>& inside, bool thorough, const WindingNumber* winding)
    : inside_(inside),
      thorough_(thorough),
      winding_(winding),
      finder_(bins.blocks()),
      obstacles_(soup, bins, kKept) {}

Side SurfaceProbe::side(const Vector3d& q, const Vector3d& normal) {
  const Vector3d places[2] = {q + kOff * normal, q - kOff * normal};
  Side sides[2];
  for (int i = 0; i < 2; ++i) {
    sides[i] = seen_from(places[i]);
    if (sides[i] == Side::outer) return Side::outer;
  }
  for (int i = 0; i < 2; ++i) {
    if (sides[i] == Side::inner) continue;
    if (!thorough_) return Side::unknown;
    const Side found = follow(places[i], normal);
    if (found == Side::unknown && is_wound_about(places[i])) continue;
    if (found == Side::unknown && winding_) return Side::outer;
    if (found != Side::inner) return found;
  }
  return Side::inner;
}

/// 0 or 1, or 2 where there is no block.
int SurfaceProbe::inside_at(const Voxel& voxel) {
  const std::uint32_t block = finder_.find(tile_of(voxel));
  if (block == BlockTable::kNone) return 2;
  const unsigned place = place_in_tile(voxel);
  return int(inside_[block][place >> 6] >> (place & 63) & 1);
}

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

/// By straight ways to the corners of the cell that p is in.
Side SurfaceProbe::seen_from(const Vector3d& p) {
  const auto cell = [&](int axis) { return static_cast<std::int32_t>(std::floor(p[axis])); };
  enter({cell(0), cell(1), cell(2)});
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
Side SurfaceProbe::follow(Vector3d p, const Vector3d& normal) {
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

/// Outside of all that is closed the number is 0, whatever the orientation of each.
bool SurfaceProbe::is_wound_about(const Vector3d& p) const {
  return winding_ && std::abs(winding_->at(p)) > 0.5;
}

}  // namespace hermesh
