#include "algorithms/voxelization/inside/cavities.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "algorithms/lattice/sample_side.h"
#include "algorithms/voxelization/inside/cell_obstacles.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// How far a winding number may be from a whole number: far above its error, which is below 0.01.
constexpr double kWhole = 0.1;

/// A voxel of a region with a triangle between it and its upper neighbour along an axis.
struct Wall {
  std::array<std::int32_t, 3> voxel;
  int axis;
};

/// Returns a voxel at a wall for each region except the outside.
std::vector<std::optional<Wall>> find_walls(const Band& band, const Regions& regions) {
  std::vector<std::optional<Wall>> walls(regions.count);
  std::size_t missing = regions.count;
  for (std::size_t i = 0; i < band.blocks.size() && missing > 0; ++i)
    for (std::uint32_t c = regions.first[i]; c < regions.first[i + 1]; ++c) {
      const auto& [voxels, region] = regions.components[c];
      if (region == Regions::kOutside || walls[region]) continue;
      for (int axis = 0; axis < 3 && !walls[region]; ++axis)
        for (int x = 0; x < 8 && !walls[region]; ++x) {
          const std::uint64_t at = voxels[std::size_t(x)] & band.crossed[i].word[axis][x];
          if (at == 0) continue;
          const int place = std::countr_zero(at);
          const BlockAt& block = band.blocks[i];
          walls[region] = {{block[0] * 8 + x, block[1] * 8 + place / 8, block[2] * 8 + place % 8}, axis};
          --missing;
        }
    }
  return walls;
}

/// Returns the regions next to each of those asked for, by region.
std::vector<std::set<std::uint32_t>> find_neighbours(const BlockTable& table, const Band& band,
                                                     const Regions& regions, const std::vector<char>& asked) {
  std::vector<std::set<std::uint32_t>> neighbours(regions.count);
  const auto add = [&](std::uint32_t a, std::uint32_t b) {
    if (a == b) return;
    if (asked[a]) neighbours[a].insert(b);
    if (asked[b]) neighbours[b].insert(a);
  };
  BlockFinder finder(table);
  for (std::size_t i = 0; i < band.blocks.size(); ++i)
    for (int axis = 0; axis < 3; ++axis) {
      BlockAt at = band.blocks[i];
      ++at[std::size_t(axis)];
      const std::uint32_t next = finder.find(at);
      for (std::uint32_t c = regions.first[i]; c < regions.first[i + 1]; ++c) {
        const BlockComponent& own = regions.components[c];
        for (std::uint32_t d = regions.first[i]; d < regions.first[i + 1]; ++d) {
          const BlockComponent& other = regions.components[d];
          if (own.region == other.region || !(asked[own.region] || asked[other.region])) continue;
          bool touch = false;
          for (std::size_t x = 0; x < 8; ++x) {
            const std::uint64_t upper = axis == 0   ? (x < 7 ? other.voxels[x + 1] : 0)
                                        : axis == 1 ? other.voxels[x] >> 8 & kBelowTopY
                                                    : other.voxels[x] >> 1 & kBelowTopZ;
            touch |= (own.voxels[x] & upper) != 0;
          }
          if (touch) add(own.region, other.region);
        }
        if (next == BlockTable::kNone) continue;
        for (std::uint32_t d = regions.first[next]; d < regions.first[next + 1]; ++d)
          if (face(own.voxels, axis, 1) & face(regions.components[d].voxels, axis, 0))
            add(own.region, regions.components[d].region);
      }
    }
  return neighbours;
}

/// Takes out of `regions_left` those that are as small as a pocket and touch the outside.
void leave_out_folds(const std::vector<std::set<std::uint32_t>>& neighbours, const Regions& regions,
                     std::vector<char>& regions_left) {
  constexpr int kLargestFold = 64;  // voxels
  std::vector<int> size(regions.count);
  for (const auto& [voxels, region] : regions.components)
    if (size[region] <= kLargestFold) size[region] += count(voxels);
  for (std::uint32_t region = 0; region < regions.count; ++region)
    if (size[region] <= kLargestFold && neighbours[region].contains(Regions::kOutside))
      regions_left[region] = 0;
}

}  // namespace

void open_cavities(const IndexSoup& soup, const TriangleBins& bins, const Band& band,
                   const std::function<const OrientedWinding&()>& winding, Regions& regions,
                   RunContext& context) {
  const std::vector<std::optional<Wall>> walls = find_walls(band, regions);
  // From within a solid the first wall is seen from behind. Where that is so in all regions, as nearly
  // always, none is a void; nor are folds of the surface, which are small and open to the outside.
  std::vector<char> faced(regions.count);
  CellObstacles obstacles(soup, bins, 1);
  for (std::uint32_t region = 0; region < regions.count; ++region) {
    if (!walls[region]) continue;
    const Vector3d from = side_place(walls[region]->voxel);
    faced[region] = obstacles.first_met(from, from + Vector3d::Unit(walls[region]->axis)).faces_from;
  }
  if (std::ranges::find(faced, 1) == faced.end()) return;
  leave_out_folds(find_neighbours(bins.blocks(), band, regions, faced), regions, faced);
  if (std::ranges::find(faced, 1) == faced.end() || !winding().usable()) return;
  const std::optional<WindingNumber> inward = winding().inward();
  if (!inward) return;
  const auto place = [&](std::uint32_t region) { return side_place(walls[region]->voxel); };
  const auto winds = [&](std::uint32_t region, double times) {
    return walls[region] && std::abs(winding().number().at(place(region)) - times) < kWhole;
  };
  std::vector<char> is_void(regions.count);
  for (std::uint32_t region = 0; region < regions.count; ++region)
    is_void[region] = winds(region, 0.0) && inward->at(place(region)) < kWhole - 1.0;
  if (std::ranges::find(is_void, 1) == is_void.end()) return;
  const std::vector<std::set<std::uint32_t>> neighbours =
      find_neighbours(bins.blocks(), band, regions, is_void);
  std::vector<char> opens(regions.count);
  std::size_t filled = 0;
  std::uint32_t first_filled = 0;
  for (std::uint32_t region = 0; region < regions.count; ++region) {
    if (!is_void[region]) continue;
    opens[region] = std::ranges::all_of(neighbours[region], [&](std::uint32_t next) {
      return next != Regions::kOutside && winds(next, 1.0);
    });
    if (!opens[region] && filled++ == 0) first_filled = region;
  }
  for (BlockComponent& component : regions.components)
    if (opens[component.region]) component.region = Regions::kOutside;
  if (filled == 0) return;
  const auto& at = walls[first_filled]->voxel;
  const Vector3d where = soup.mesh().origin + Vector3d(at[0], at[1], at[2]) / soup.scale();
  const auto number = [](double value) {
    std::ostringstream text;
    text << value;
    return text.str();
  };
  context.note((filled == 1 ? "A cavity is" : std::to_string(filled) + " cavities are") + " filled" +
               (filled == 1 ? " near (" : ", the first near (") + number(where.x()) + ", " +
               number(where.y()) + ", " + number(where.z()) +
               "): in places the wall is thinner than a voxel, or cut by another part. Use smaller "
               "voxels, or --signs winding-number.");
}

}  // namespace hermesh
