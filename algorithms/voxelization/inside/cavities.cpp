#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <set>
#include <sstream>

#include "algorithms/lattice/sample_side.h"
#include "algorithms/voxelization/inside/cell_obstacles.h"
#include "algorithms/voxelization/inside/enclosed_regions.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using Neighbours = std::vector<std::set<std::uint32_t>>;  // by region

/// Largest deviation of a winding number from an integer: far above its error, which is below 0.01.
constexpr double kWhole = 0.1;
/// The largest region, in voxels, that is taken for a fold of the surface if it touches the outside.
constexpr int kLargestFold = 64;

/// A voxel of a region with a triangle between it and its upper neighbour along an axis.
struct Wall {
  Voxel voxel;
  int axis;
};

/// Returns a voxel at a wall for each region except the outside.
std::vector<std::optional<Wall>> find_walls(const Band& band, const Regions& regions) {
  std::vector<std::optional<Wall>> walls(regions.count);
  for (std::size_t i = 0; i < band.blocks.size(); ++i)
    for (std::uint32_t c = regions.first[i]; c < regions.first[i + 1]; ++c) {
      const auto& [voxels, region] = regions.components[c];
      if (region == Regions::kOutside) continue;
      for (int axis = 0; axis < 3 && !walls[region]; ++axis)
        for (int x = 0; x < 8 && !walls[region]; ++x)
          if (const std::uint64_t at = voxels[std::size_t(x)] & band.crossed[i].word[axis][x])
            walls[region] = {voxel_in(band.blocks[i], 64 * x + std::countr_zero(at)), axis};
    }
  return walls;
}

/// Returns the regions next to each requested one.
Neighbours find_neighbours(const BlockTable& table, const Band& band, const Regions& regions,
                           const std::vector<char>& asked) {
  Neighbours neighbours(regions.count);
  BlockFinder finder(table);
  for (std::size_t i = 0; i < band.blocks.size(); ++i)
    for (int axis = 0; axis < 3; ++axis) {
      BlockAt at = band.blocks[i];
      ++at[std::size_t(axis)];
      // Within the block, and across the face to the next one.
      for (const std::uint32_t other : {std::uint32_t(i), finder.find(at)}) {
        if (other == BlockTable::kNone) continue;
        for (std::uint32_t c = regions.first[i]; c < regions.first[i + 1]; ++c)
          for (std::uint32_t d = regions.first[other]; d < regions.first[other + 1]; ++d) {
            const auto& [own, a] = regions.components[c];
            const auto& [voxels, b] = regions.components[d];
            if (a == b || !(asked[a] || asked[b])) continue;
            if (other == i ? !any(own & upper_neighbours(voxels, kAllOutside, axis))
                           : !(face(own, axis, 1) & face(voxels, axis, 0)))
              continue;
            if (asked[a]) neighbours[a].insert(b);
            if (asked[b]) neighbours[b].insert(a);
          }
      }
    }
  return neighbours;
}

}  // namespace

void open_cavities(const IndexSoup& soup, const TriangleBins& bins, const Band& band,
                   const std::function<const OrientedWinding&()>& winding, Regions& regions,
                   RunContext& context) {
  const std::vector<std::optional<Wall>> walls = find_walls(band, regions);
  const auto none = [](const std::vector<char>& of) { return std::ranges::find(of, 1) == of.end(); };
  // From within a solid the first wall is seen from behind. If that is so in all regions, as nearly always,
  // none is a void; nor are folds of the surface, which are small and open to the outside.
  std::vector<char> faced(regions.count);
  CellObstacles obstacles(soup, bins);
  for (std::uint32_t region = 0; region < regions.count; ++region) {
    if (!walls[region]) continue;
    const Vector3d from = side_place(walls[region]->voxel);
    faced[region] = obstacles.first_met(from, from + Vector3d::Unit(walls[region]->axis)).faces_from;
  }
  if (none(faced)) return;
  const Neighbours around_faced = find_neighbours(bins.blocks(), band, regions, faced);
  std::vector<int> size(regions.count);
  for (const auto& [voxels, region] : regions.components)
    if (size[region] <= kLargestFold) size[region] += count(voxels);
  for (std::uint32_t region = 0; region < regions.count; ++region)
    if (size[region] <= kLargestFold && around_faced[region].contains(Regions::kOutside)) faced[region] = 0;
  if (none(faced) || !winding().usable()) return;
  const std::optional<WindingNumber> inward = winding().inward();
  if (!inward) return;
  const auto place = [&](std::uint32_t region) { return side_place(walls[region]->voxel); };
  const auto winds = [&](std::uint32_t region, double times) {
    return walls[region] && std::abs(winding().number().at(place(region)) - times) < kWhole;
  };
  std::vector<char> is_void(regions.count);
  for (std::uint32_t region = 0; region < regions.count; ++region)
    is_void[region] = winds(region, 0.0) && inward->at(place(region)) < kWhole - 1.0;
  if (none(is_void)) return;
  const Neighbours neighbours = find_neighbours(bins.blocks(), band, regions, is_void);
  std::vector<char> opens(regions.count);
  std::vector<std::uint32_t> filled;
  for (std::uint32_t region = 0; region < regions.count; ++region) {
    if (!is_void[region]) continue;
    opens[region] = std::ranges::all_of(neighbours[region], [&](std::uint32_t next) {
      return next != Regions::kOutside && winds(next, 1.0);
    });
    if (!opens[region]) filled.push_back(region);
  }
  for (BlockComponent& component : regions.components)
    if (opens[component.region]) component.region = Regions::kOutside;
  if (filled.empty()) return;
  const Voxel& at = walls[filled[0]]->voxel;
  const Vector3d where = soup.mesh().origin + Vector3d(at[0], at[1], at[2]) / soup.scale();
  std::ostringstream note;
  note << (filled.size() == 1 ? "A cavity is filled near ("
                              : std::to_string(filled.size()) + " cavities are filled, the first near (")
       << where.x() << ", " << where.y() << ", " << where.z()
       << "): in places the wall is thinner than a voxel, or cut by another part. Use smaller voxels, or "
          "--signs "
          "winding-number.";
  context.note(note.str());
}

}  // namespace hermesh
