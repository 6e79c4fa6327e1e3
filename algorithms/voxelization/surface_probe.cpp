#include "algorithms/voxelization/surface_probe.h"

#include <array>
#include <cmath>
#include <numbers>

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// How far off a side the way to a voxel starts, in voxels: beyond rounding and beyond doubled faces.
constexpr double kOff = 1e-3;
constexpr std::size_t kKept = 8;  ///< neighbourhoods kept: those around a corner of a block
/// Steps of at most a voxel that a crevice is followed.
constexpr int kSteps = 8;
constexpr int kWays = 8;  ///< directions along a sheet

}  // namespace

/// The triangles of one block of cells, by cell.
struct SurfaceProbe::Neighbourhood {
  std::vector<Obstacle> obstacles;
  std::array<std::vector<std::uint32_t>, 512>
      cells;  ///< numbers of those that touch the cell up from each voxel

  Neighbourhood(const IndexSoup& soup, const TriangleBins& bins, const BlockAt& block) {
    bins.for_each_cluster(block, around(block, 1.1), [&](const TriangleBins::Cluster& cluster) {
      for (std::size_t a = 0; a < 3; ++a)
        if (cluster.box.low[a] > block[a] * 8.0 + 8.1 || cluster.box.high[a] < block[a] * 8.0 - 0.1) return;
      for (const std::uint32_t t : cluster.triangles) add(Facet(soup.corners(t)), block);
    });
    if (const std::uint32_t i = bins.blocks().find(block); i != BlockTable::kNone)
      for (const std::uint32_t t : bins.large(i)) add(Facet(soup.corners(t)), block);
  }

  /// Where a triangle of the cell is first in the way, 0 at `from` to 1 at `to`; 1 if none is. Any that is in
  /// the way gives 0 if it does not matter where.
  double free_part(const Vector3d& from, const Vector3d& to, unsigned cell, bool any) const {
    double part = 1.0;
    for (const std::uint32_t i : cells[cell]) {
      const double along = obstacles[i].meeting(from, to);
      if (along < 0) continue;
      if (any) return 0.0;
      part = std::min(part, along);
    }
    return part;
  }

 private:
  void add(const Facet& facet, const BlockAt& block) {
    const Vector3d lowest = facet.low(), highest = facet.high();
    int from[3], to[3];
    for (int a = 0; a < 3; ++a) {
      const double origin = block[std::size_t(a)] * 8.0;
      from[a] = int(std::clamp(std::floor(lowest[a] - origin - 1e-6), 0.0, 8.0));
      to[a] = int(std::clamp(std::floor(highest[a] - origin + 1e-6), -1.0, 7.0));
      if (from[a] > to[a]) return;
    }
    const std::uint32_t number = std::uint32_t(obstacles.size());
    obstacles.emplace_back(facet);
    for (int x = from[0]; x <= to[0]; ++x)
      for (int y = from[1]; y <= to[1]; ++y)
        for (int z = from[2]; z <= to[2]; ++z) cells[std::size_t(x * 64 + y * 8 + z)].push_back(number);
  }
};

SurfaceProbe::SurfaceProbe(const IndexSoup& soup, const TriangleBins& bins,
                           const std::vector<VoxelBits>& inside, bool thorough, const WindingNumber* winding)
    : soup_(soup),
      bins_(bins),
      inside_(inside),
      thorough_(thorough),
      winding_(winding),
      finder_(bins.blocks()) {}
SurfaceProbe::~SurfaceProbe() = default;
SurfaceProbe::SurfaceProbe(SurfaceProbe&&) noexcept = default;

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

/// A few blocks are kept, since places next to each other are asked for one after another.
const SurfaceProbe::Neighbourhood& SurfaceProbe::neighbourhood_of(const Voxel& cell) {
  const BlockAt block = tile_of(cell);
  if (last_ && block == last_block_) return *last_;
  auto known = blocks_.find(block);
  if (known == blocks_.end()) {
    if (blocks_.size() >= kKept) blocks_.clear();
    known = blocks_.emplace(block, std::make_unique<Neighbourhood>(soup_, bins_, block)).first;
  }
  last_block_ = block;
  last_ = known->second.get();
  return *last_;
}

/// 0 or 1, or 2 where there is no block.
int SurfaceProbe::inside_at(const Voxel& voxel) {
  const std::uint32_t block = finder_.find(tile_of(voxel));
  if (block == BlockTable::kNone) return 2;
  const unsigned place = place_in_tile(voxel);
  return int(inside_[block][place >> 6] >> (place & 63) & 1);
}

/// By straight ways to the corners of the cell that p is in.
Side SurfaceProbe::seen_from(const Vector3d& p) {
  Voxel lower;
  for (int a = 0; a < 3; ++a) lower[std::size_t(a)] = std::int32_t(std::floor(p[a]));
  const Neighbourhood& triangles = neighbourhood_of(lower);
  bool inside_seen = false;
  for (int i = 0; i < 8; ++i) {
    const Voxel voxel{lower[0] + (i >> 2), lower[1] + (i >> 1 & 1), lower[2] + (i & 1)};
    const int inside = inside_at(voxel);
    if (inside == 2 || (inside == 1 && inside_seen)) continue;
    const Vector3d to(voxel[0], voxel[1], voxel[2]);
    if (triangles.free_part(p, to, place_in_tile(lower), true) < 1.0) continue;
    if (inside == 0) return Side::outer;
    inside_seen = true;
  }
  return inside_seen ? Side::inner : Side::unknown;
}

/// How much of the way, of no more than some voxels, no triangle is in.
double SurfaceProbe::free_part(const Vector3d& from, const Vector3d& to) {
  const Vector3d low = from.cwiseMin(to), high = from.cwiseMax(to);
  double part = 1.0;
  for (std::int32_t x = std::int32_t(std::floor(low[0])); x <= high[0]; ++x)
    for (std::int32_t y = std::int32_t(std::floor(low[1])); y <= high[1]; ++y)
      for (std::int32_t z = std::int32_t(std::floor(low[2])); z <= high[2]; ++z) {
        const Voxel cell{x, y, z};
        part = std::min(part, neighbourhood_of(cell).free_part(from, to, place_in_tile(cell), false));
      }
  return part;
}

/// Moves p to the middle between what is in the way along the normal, and returns how wide the gap is there,
/// at most 2.
double SurfaceProbe::centre(Vector3d& p, const Vector3d& normal) {
  const double above = free_part(p, p + normal), below = free_part(p, p - normal);
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
      Vector3d at = p + 0.9 * free_part(p, p + way) * way;
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
