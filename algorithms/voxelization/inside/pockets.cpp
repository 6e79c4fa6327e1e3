#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/lattice/sample_side.h"
#include "algorithms/voxelization/inside/enclosed_regions.h"
#include "algorithms/voxelization/inside/wall_walk.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// A region of more voxels than this is not a pocket.
constexpr int kLargestPocket = 64;
/// Length of the segments, in voxels along each axis: in a slit far narrower than a voxel, the next voxel may
/// be some voxels away.
constexpr std::int32_t kFar = 6;
/// Most pockets open by segments of at most this length, which are searched first because they cost far less.
constexpr std::int32_t kNearFirst = 2;
/// The most triangles that are tested for the paths along walls of all pockets together: a few tenths of a
/// second. Many thousands of pockets are not crevices, but spaces between intersecting parts of a model.
constexpr std::size_t kMostWork = 20'000'000;
/// The test misses a triangle in whose plane a segment lies, so a second segment is moved by this.
const Vector3d kAside(1.1e-5, 1.7e-5, 2.3e-5);

/// A small region that the flood from infinity did not reach.
struct Pocket {
  std::uint32_t region = 0;
  std::vector<Voxel> voxels;
};

/// Returns the corners of the cube of voxels at most `far` away along each axis.
std::pair<Voxel, Voxel> cube_around(const Voxel& v, std::int32_t far) {
  return {{v[0] - far, v[1] - far, v[2] - far}, {v[0] + far, v[1] + far, v[2] + far}};
}

/// Returns true if no triangle is between two points.
bool is_free(const Vector3d& from, const Vector3d& to, CellObstacles& obstacles) {
  return obstacles.is_free(from, to) && obstacles.is_free(from, to + kAside);
}

/// One run of open_pockets().
class PocketOpener {
 public:
  PocketOpener(const IndexSoup& soup, const TriangleBins& bins, const std::vector<BlockAt>& blocks,
               Regions& regions, const RunContext& context)
      : soup_(soup), bins_(bins), blocks_(blocks), regions_(regions), context_(context) {}

  void run() {
    find_pockets();
    open_.assign(regions_.count, 0);
    open_[Regions::kOutside] = 1;
    open_in_sight(kNearFirst);
    open_in_sight(kFar);
    open_along_walls();
    for (BlockComponent& component : regions_.components)
      if (open_[component.region]) component.region = Regions::kOutside;
  }

 private:
  /// Lists the small regions in the order of their first components.
  void find_pockets() {
    std::vector<int> size(regions_.count, 0);
    for (const auto& [voxels, region] : regions_.components)
      if (size[region] <= kLargestPocket) size[region] += count(voxels);
    pocket_of_.assign(regions_.count, BlockTable::kNone);
    for (std::size_t i = 0; i < blocks_.size(); ++i)
      for (std::uint32_t c = regions_.first[i]; c < regions_.first[i + 1]; ++c) {
        const auto& [voxels, region] = regions_.components[c];
        if (region == Regions::kOutside || size[region] > kLargestPocket) continue;
        std::uint32_t& number = pocket_of_[region];
        if (number == BlockTable::kNone) {
          number = std::uint32_t(pockets_.size());
          pockets_.push_back({region, {}});
        }
        for_each_bit(voxels, [&](int v) { pockets_[number].voxels.push_back(voxel_in(blocks_[i], v)); });
      }
  }

  // ---- Segments.

  /// Opens the pockets from which a segment leads outside, round by round, for a crevice may hold several
  /// pockets one behind the other. A round opens all pockets that see a goal, and these are the goals of the
  /// next round: the result does not depend on the order of the threads.
  void open_in_sight(std::int32_t far) {
    tbb::enumerable_thread_specific<CellObstacles> obstacles([&] { return CellObstacles(soup_, bins_); });
    std::vector<char> goals = open_, asked(pockets_.size(), 1);
    for (bool some = !pockets_.empty(); some;) {
      const std::vector<BlockMask> goal_voxels =
          voxels_of(regions_, [&](std::uint32_t region) { return goals[region] != 0; });
      std::vector<char> sees(pockets_.size(), 0);
      tbb::parallel_for(std::size_t(0), pockets_.size(), [&](std::size_t i) {
        if (!asked[i] || open_[pockets_[i].region]) return;
        context_.check();
        sees[i] = std::ranges::any_of(pockets_[i].voxels, [&](const Voxel& voxel) {
          return sees_goal(voxel, far, goal_voxels, obstacles.local());
        });
      });
      // All have searched for the goals of this round. Only pockets near those just opened can see them.
      some = false;
      goals.assign(regions_.count, 0);
      asked.assign(pockets_.size(), 0);
      for (std::size_t i = 0; i < pockets_.size(); ++i) {
        if (!sees[i]) continue;
        some = true;
        open_[pockets_[i].region] = goals[pockets_[i].region] = 1;
        for (const Voxel& voxel : pockets_[i].voxels) ask_around(voxel, far, asked);
      }
    }
  }

  /// Sets `asked` for the pockets in the blocks at most `far` from a voxel along each axis.
  void ask_around(const Voxel& voxel, std::int32_t far, std::vector<char>& asked) const {
    const auto [from, to] = cube_around(voxel, far);
    for_each_block_in(from, to, [&](const BlockAt& at) {
      const std::uint32_t i = bins_.blocks().find(at);
      if (i == BlockTable::kNone) return;
      for (std::uint32_t c = regions_.first[i]; c < regions_.first[i + 1]; ++c)
        if (const std::uint32_t p = pocket_of_[regions_.components[c].region]; p != BlockTable::kNone)
          asked[p] = 1;
    });
  }

  /// Returns true if a segment to a goal's voxel, at most `most` away along each axis, is free.
  bool sees_goal(const Voxel& voxel, std::int32_t most, const std::vector<BlockMask>& goal_voxels,
                 CellObstacles& obstacles) const {
    std::vector<std::pair<BlockAt, BlockMask>> near;
    const auto [low, high] = cube_around(voxel, most);
    for_each_block_in(low, high, [&, &from = low, &to = high](const BlockAt& at) {
      const std::uint32_t i = bins_.blocks().find(at);
      const BlockMask bits = i == BlockTable::kNone ? kAllOutside : goal_voxels[i] & box_bits(at, from, to);
      if (any(bits)) near.emplace_back(at, bits);
    });
    // The nearest first, which are the likeliest to be seen.
    for (std::int32_t far = 1; far <= most; ++far)
      for (auto& [at, bits] : near) {
        const auto [from, to] = cube_around(voxel, far);
        const BlockMask within = bits & box_bits(at, from, to);
        bits = bits & ~within;
        bool sees = false;
        for_each_bit(within, [&](int v) {
          sees = sees || is_free(side_place(voxel), side_place(voxel_in(at, v)), obstacles);
        });
        if (sees) return true;
      }
    return false;
  }

  // ---- Paths along walls.

  /// Opens the pockets that a path along their walls leads out of. One thread searches, with obstacles of its
  /// own: their cost must not depend on earlier queries of other threads.
  void open_along_walls() {
    CellObstacles obstacles(soup_, bins_);
    const std::vector<char> goals = open_;
    std::vector<char> known(pockets_.size(), 0);
    for (std::size_t i = 0; i < pockets_.size() && obstacles.work() < kMostWork; ++i) {
      context_.check();
      if (open_[pockets_[i].region] || known[i] || !may_be_outside(pockets_[i], obstacles)) continue;
      const Paths paths = follow_walls(pockets_[i], goals, obstacles);
      // The result for a pocket holds for all pockets that its paths lead to.
      for (const std::uint32_t region : paths.regions) {
        known[pocket_of_[region]] = 1;
        if (paths.lead_out) open_[region] = 1;
      }
    }
  }

  /// Returns true if the triangles around the first voxel face it at least as often as not. The inside of a
  /// thin wall consists of many pockets, and following all paths in it would take longer than all the rest.
  bool may_be_outside(const Pocket& pocket, CellObstacles& obstacles) const {
    const Vector3d from = side_place(pocket.voxels.front());
    int facing = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (const double step : {-1.0, 1.0}) {
        const CellObstacles::Met met = obstacles.first_met(from, from + step * Vector3d::Unit(axis));
        if (met.part < 1.0) facing += met.faces_from ? 1 : -1;
      }
    return facing >= 0;
  }

  struct Paths {
    bool lead_out = false;
    std::vector<std::uint32_t> regions;  ///< of the pockets that they lead to
  };

  /// Follows the paths along a pocket's walls, and those of the pockets that are seen from them. They lead
  /// out if a goal is seen before any other large region. If that comes first, the solid has a hole, and must
  /// not be emptied.
  Paths follow_walls(const Pocket& pocket, const std::vector<char>& goals, CellObstacles& obstacles) const {
    Paths paths{.lead_out = false, .regions = {pocket.region}};
    WallWalk walk(soup_, obstacles);
    const auto begin_at_walls = [&](const Pocket& of) {
      for (const Voxel& voxel : of.voxels)
        for (int axis = 0; axis < 3; ++axis)
          for (const double step : {-1.0, 1.0}) walk.begin(side_place(voxel), step * Vector3d::Unit(axis));
    };
    begin_at_walls(pocket);
    while (obstacles.work() < kMostWork) {
      context_.check();
      const std::optional<Vector3d> at = walk.next();
      if (!at) break;
      const Voxel cell = cell_of(*at);
      for (int corner = 0; corner < 8; ++corner) {
        const Voxel voxel{cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1), cell[2] + (corner >> 2)};
        const std::uint32_t region = region_of(voxel);
        if (region == BlockTable::kNone || std::ranges::count(paths.regions, region) > 0) continue;
        if (!is_free(*at, side_place(voxel), obstacles)) continue;
        if (goals[region] || pocket_of_[region] == BlockTable::kNone) {
          paths.lead_out = goals[region];
          return paths;
        }
        paths.regions.push_back(region);
        begin_at_walls(pockets_[pocket_of_[region]]);
      }
    }
    return paths;
  }

  /// Returns the region of a voxel; kNone in a space without blocks, deep in a solid or far outside.
  std::uint32_t region_of(const Voxel& voxel) const {
    const std::uint32_t i = bins_.blocks().find(tile_of(voxel));
    if (i == BlockTable::kNone) return BlockTable::kNone;
    std::uint32_t c = regions_.first[i];
    while (!test(regions_.components[c].voxels, int(place_in_tile(voxel)))) ++c;  // each voxel is in one
    return regions_.components[c].region;
  }

  const IndexSoup& soup_;
  const TriangleBins& bins_;
  const std::vector<BlockAt>& blocks_;
  Regions& regions_;
  const RunContext& context_;
  std::vector<Pocket> pockets_;
  std::vector<std::uint32_t> pocket_of_;  ///< the pocket of each region, kNone for large ones
  std::vector<char> open_;                ///< 1 for the regions that are joined to the outside
};

}  // namespace

void open_pockets(const IndexSoup& soup, const TriangleBins& bins, const std::vector<BlockAt>& blocks,
                  Regions& regions, const RunContext& context) {
  PocketOpener(soup, bins, blocks, regions, context).run();
}

}  // namespace hermesh
