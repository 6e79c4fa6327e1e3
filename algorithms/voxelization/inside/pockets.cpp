#include "algorithms/voxelization/inside/pockets.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/lattice/sample_side.h"
#include "algorithms/voxelization/inside/box_bits.h"
#include "algorithms/voxelization/inside/cell_obstacles.h"
#include "algorithms/voxelization/inside/wall_walk.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
/// A region of more voxels than this is no pocket.
constexpr std::size_t kLargestPocket = 64;
/// How far it is looked in voxels, first by all, then by those that saw nothing: along a slit far narrower
/// than a voxel the next voxel in it may be some away.
constexpr std::int32_t kFar[] = {2, 6};
/// How many triangles may be looked at for ways along walls, for all pockets together: some tenths of a
/// second. Many thousands of pockets are no crevices, but what parts of a model enclose between them where
/// they intersect.
constexpr std::size_t kMostWork = 20'000'000;
/// A triangle in whose plane a way lies is met by no test, so ways are taken a little to one side, too.
const Vector3d kAside(1.1e-5, 1.7e-5, 2.3e-5);
/// Blocks whose triangles a thread keeps.
constexpr std::size_t kNeighboursKept = 27;

/// A region of few voxels that the flood from infinity did not reach.
struct Pocket {
  std::uint32_t region = 0;
  std::vector<Voxel> voxels;
  std::vector<std::uint32_t> blocks;  ///< numbers of those that hold them
};

/// Bits of the voxels of a block that are at most `far` from a voxel on each axis.
BlockMask cube_bits(const BlockAt& block, const Voxel& middle, std::int32_t far) {
  return box_bits(block, {middle[0] - far, middle[1] - far, middle[2] - far},
                  {middle[0] + far, middle[1] + far, middle[2] + far});
}

/// One run of open_pockets().
class PocketOpener {
 public:
  PocketOpener(const IndexSoup& soup, const TriangleBins& bins, const std::vector<BlockAt>& blocks,
               Regions& regions, const RunContext& context)
      : soup_(soup), bins_(bins), blocks_(blocks), regions_(regions), context_(context), obstacles_([&] {
          return CellObstacles(soup, bins, kNeighboursKept);
        }) {}

  void run() {
    find_pockets();
    std::vector<char> open(regions_.count, 0);
    open[Regions::kOutside] = 1;
    for (const std::int32_t far : kFar) {
      // A round opens all pockets that see a goal, and these are the goals of the next: what is opened does
      // not depend on the order in which threads ask.
      far_ = far;
      goals_ = open;
      std::vector<std::uint32_t> asked = closed_ones(open);
      // A crevice may hold several pockets, one behind the other.
      for (bool first = true; !asked.empty(); first = false) {
        mark_goals(first);
        const std::vector<char> sees = look(asked);
        // What was a goal in this round has been looked for by all; only what it opened is new.
        if (first) goals_.assign(regions_.count, 0);
        for (const std::uint32_t pocket : opened_) goals_[pockets_[pocket].region] = 0;
        opened_.clear();
        for (std::size_t i = 0; i < asked.size(); ++i) {
          if (!sees[i]) continue;
          opened_.push_back(asked[i]);
          open[pockets_[asked[i]].region] = goals_[pockets_[asked[i]].region] = 1;
        }
        asked = closed_ones_near_opened(open);
      }
      opened_.clear();
    }
    // The threads' blocks have served.
    obstacles_.clear();
    open_along_walls(open);
    for (BlockComponent& component : regions_.components)
      if (open[component.region]) component.region = Regions::kOutside;
  }

 private:
  /// The pockets that are still closed, by number.
  std::vector<std::uint32_t> closed_ones(const std::vector<char>& open) const {
    std::vector<std::uint32_t> closed;
    for (std::uint32_t i = 0; i < pockets_.size(); ++i)
      if (!open[pockets_[i].region]) closed.push_back(i);
    return closed;
  }

  /// Finds the closed pockets in the blocks around those just opened, for no others can see them. To ask all
  /// would take as many looks as a slit has voxels for each of the rounds that lead through it.
  std::vector<std::uint32_t> closed_ones_near_opened(const std::vector<char>& open) const {
    std::vector<std::uint32_t> near;
    for (const std::uint32_t pocket : opened_)
      for (const std::uint32_t block : pockets_[pocket].blocks)
        for (std::int32_t x = -1; x <= 1; ++x)
          for (std::int32_t y = -1; y <= 1; ++y)
            for (std::int32_t z = -1; z <= 1; ++z) {
              const BlockAt& at = blocks_[block];
              const std::uint32_t there = bins_.blocks().find({at[0] + x, at[1] + y, at[2] + z});
              if (there != BlockTable::kNone) near.push_back(there);
            }
    sort_and_unify(near);
    std::vector<std::uint32_t> closed;
    for (const std::uint32_t block : near)
      for (const std::uint32_t pocket : pockets_in_[block])
        if (!open[pockets_[pocket].region]) closed.push_back(pocket);
    sort_and_unify(closed);
    return closed;
  }
  static void sort_and_unify(std::vector<std::uint32_t>& numbers) {
    std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  }

  /// Puts the voxels of all goals into `goal_bits_`, or those of the pockets that were opened in the last
  /// round.
  void mark_goals(bool all) {
    if (all) {
      goal_bits_.assign(blocks_.size(), BlockMask{});
      for (std::size_t i = 0; i < blocks_.size(); ++i)
        for (std::uint32_t c = regions_.first[i]; c < regions_.first[i + 1]; ++c)
          if (goals_[regions_.components[c].region])
            for (std::size_t x = 0; x < 8; ++x) goal_bits_[i][x] |= regions_.components[c].voxels[x];
      all_marked_ = true;
      return;
    }
    if (std::exchange(all_marked_, false)) goal_bits_.assign(blocks_.size(), BlockMask{});
    for (const std::uint32_t block : marked_blocks_) goal_bits_[block] = {};
    marked_blocks_.clear();
    for (const std::uint32_t pocket : opened_)
      for (const Voxel& voxel : pockets_[pocket].voxels) {
        const std::uint32_t block = bins_.blocks().find(tile_of(voxel));
        const unsigned place = place_in_tile(voxel);
        goal_bits_[block][place >> 6] |= std::uint64_t(1) << (place & 63);
        marked_blocks_.push_back(block);
      }
  }

  /// Tells which of these pockets see a goal. Threads read the goals and write an entry each.
  std::vector<char> look(const std::vector<std::uint32_t>& asked) const {
    std::vector<char> sees(asked.size(), 0);
    tbb::parallel_for(std::size_t(0), asked.size(), [&](std::size_t i) {
      context_.check();
      const std::vector<Voxel>& voxels = pockets_[asked[i]].voxels;
      CellObstacles& obstacles = obstacles_.local();
      sees[i] = std::any_of(voxels.begin(), voxels.end(),
                            [&](const Voxel& voxel) { return sees_goal(voxel, obstacles); });
    });
    return sees;
  }

  /// Opens the pockets that a way along their walls leads out of. It asks one after the other, with obstacles
  /// of their own: what these cost must not depend on what threads asked before.
  void open_along_walls(std::vector<char>& open) {
    CellObstacles obstacles(soup_, bins_, kNeighboursKept);
    goals_ = open;
    std::vector<char> known(pockets_.size(), 0);
    for (const std::uint32_t pocket : closed_ones(open)) {
      if (obstacles.work() >= kMostWork) return;
      context_.check();
      if (known[pocket] || !may_be_outside(pockets_[pocket], obstacles)) continue;
      const Ways ways = follow_walls(pockets_[pocket], obstacles);
      // What was found out for a pocket is taken to hold for all that its ways lead to.
      for (const std::uint32_t region : ways.regions) {
        known[pocket_of_[region]] = 1;
        if (ways.lead_out) open[region] = 1;
      }
    }
  }

  /// Whether the triangles around the first voxel face it at least as often as not. What is inside of a thin
  /// wall is many pockets, and to follow all ways within it would take longer than all the rest.
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

  /// Where the ways along a pocket's walls lead.
  struct Ways {
    bool lead_out = false;
    std::vector<std::uint32_t> regions;  ///< of the pockets that they lead to
  };

  /// Follows the ways along a pocket's walls, and those of the pockets that are seen from them. They lead out
  /// if a goal is seen before any other large region. Where that comes first, there is a hole in the solid,
  /// which must not be emptied.
  Ways follow_walls(const Pocket& pocket, CellObstacles& obstacles) const {
    Ways ways{.lead_out = false, .regions = {pocket.region}};
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
        if (region == BlockTable::kNone || std::ranges::count(ways.regions, region) > 0) continue;
        if (!is_free(*at, side_place(voxel), obstacles)) continue;
        if (goals_[region] || pocket_of_[region] == BlockTable::kNone) {
          ways.lead_out = goals_[region];
          return ways;
        }
        ways.regions.push_back(region);
        begin_at_walls(pockets_[pocket_of_[region]]);
      }
    }
    return ways;
  }

  /// Lists the small regions in the order of their first components.
  void find_pockets() {
    std::vector<std::size_t> size(regions_.count, 0);
    for (const BlockComponent& component : regions_.components)
      for (const std::uint64_t word : component.voxels)
        size[component.region] += std::size_t(__builtin_popcountll(word));
    pocket_of_.assign(regions_.count, BlockTable::kNone);
    pockets_in_.resize(blocks_.size());
    for (std::size_t i = 0; i < blocks_.size(); ++i)
      for (std::uint32_t c = regions_.first[i]; c < regions_.first[i + 1]; ++c) {
        const BlockComponent& component = regions_.components[c];
        if (component.region == Regions::kOutside || size[component.region] > kLargestPocket) continue;
        if (pocket_of_[component.region] == BlockTable::kNone) {
          pocket_of_[component.region] = std::uint32_t(pockets_.size());
          pockets_.push_back({component.region, {}, {}});
        }
        Pocket& pocket = pockets_[pocket_of_[component.region]];
        pocket.blocks.push_back(std::uint32_t(i));
        pockets_in_[i].push_back(pocket_of_[component.region]);
        add_voxels(blocks_[i], component.voxels, pocket.voxels);
      }
  }

  static void add_voxels(const BlockAt& block, const BlockMask& bits, std::vector<Voxel>& voxels) {
    for (std::int32_t x = 0; x < 8; ++x)
      for (std::uint64_t word = bits[std::size_t(x)]; word; word &= word - 1) {
        const int place = __builtin_ctzll(word);
        voxels.push_back({block[0] * 8 + x, block[1] * 8 + place / 8, block[2] * 8 + place % 8});
      }
  }

  /// The region of a voxel; kNone where there is no block, as in the depth of a solid or far outside.
  std::uint32_t region_of(const Voxel& voxel) const {
    const std::uint32_t i = bins_.blocks().find(tile_of(voxel));
    if (i == BlockTable::kNone) return BlockTable::kNone;
    const unsigned place = place_in_tile(voxel);
    std::uint32_t c = regions_.first[i];
    while (!(regions_.components[c].voxels[place >> 6] >> (place & 63) & 1)) ++c;  // each voxel is in one
    return regions_.components[c].region;
  }

  /// Whether a straight way to a goal's voxel, at most `far_` off on each axis, is free.
  bool sees_goal(const Voxel& voxel, CellObstacles& obstacles) const {
    std::vector<std::uint32_t> near;  // blocks with goals
    BlockAt low, high;
    for (std::size_t a = 0; a < 3; ++a) low[a] = (voxel[a] - far_) >> 3, high[a] = (voxel[a] + far_) >> 3;
    for (std::int32_t x = low[0]; x <= high[0]; ++x)
      for (std::int32_t y = low[1]; y <= high[1]; ++y)
        for (std::int32_t z = low[2]; z <= high[2]; ++z)
          if (const std::uint32_t block = bins_.blocks().find({x, y, z});
              block != BlockTable::kNone && goal_bits_[block] != BlockMask{})
            near.push_back(block);
    // Near ones first, which are the likeliest to be seen.
    for (std::int32_t far = 1; far <= far_; ++far)
      for (const std::uint32_t block : near)
        if (sees_goal_in(block, voxel, far, obstacles)) return true;
    return false;
  }

  /// Whether a goal's voxel in the block is seen whose distance, the largest of the three axes', is `far`.
  bool sees_goal_in(std::uint32_t block, const Voxel& voxel, std::int32_t far,
                    CellObstacles& obstacles) const {
    const BlockAt& at = blocks_[block];
    const BlockMask within = cube_bits(at, voxel, far), nearer = cube_bits(at, voxel, far - 1);
    for (std::int32_t x = 0; x < 8; ++x)
      for (std::uint64_t bits =
               goal_bits_[block][std::size_t(x)] & within[std::size_t(x)] & ~nearer[std::size_t(x)];
           bits; bits &= bits - 1) {
        const int place = __builtin_ctzll(bits);
        const Voxel other{at[0] * 8 + x, at[1] * 8 + place / 8, at[2] * 8 + place % 8};
        if (is_free(side_place(voxel), side_place(other), obstacles)) return true;
      }
    return false;
  }

  /// Whether a segment is free, and one beside it: a triangle in whose plane the first lies would not be met.
  static bool is_free(const Vector3d& from, const Vector3d& to, CellObstacles& obstacles) {
    return obstacles.is_free(from, to) && obstacles.is_free(from, to + kAside);
  }

  const IndexSoup& soup_;
  const TriangleBins& bins_;
  const std::vector<BlockAt>& blocks_;
  Regions& regions_;
  const RunContext& context_;
  mutable tbb::enumerable_thread_specific<CellObstacles> obstacles_;
  std::vector<Pocket> pockets_;
  std::vector<std::uint32_t> pocket_of_;                ///< the pocket of each region, kNone for large ones
  std::vector<std::vector<std::uint32_t>> pockets_in_;  ///< the pockets of each block
  std::vector<std::uint32_t> opened_;                   ///< pockets opened in the last round
  std::int32_t far_ = 0;
  std::vector<BlockMask> goal_bits_;          ///< voxels of the goals, by block
  bool all_marked_ = false;                   ///< whether `goal_bits_` has all goals, or those opened last
  std::vector<std::uint32_t> marked_blocks_;  ///< blocks with bits of the latter
  std::vector<char> goals_;  ///< regions from which a way leads outside that pockets have not looked for yet
};

}  // namespace

void open_pockets(const IndexSoup& soup, const TriangleBins& bins, const std::vector<BlockAt>& blocks,
                  Regions& regions, const RunContext& context) {
  PocketOpener(soup, bins, blocks, regions, context).run();
}

}  // namespace hermesh
