#include "algorithms/voxelization/pockets.h"

#include <algorithm>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/voxelization/segment.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using Voxel = std::array<std::int32_t, 3>;

/// More voxels than this are no pocket.
constexpr std::size_t kMost = 64;
/// How far it is looked in voxels, first by all, then by those that saw nothing: along a slit far narrower
/// than a voxel the next voxel in it may be some away. What is filed around a block holds all that is as
/// near: a bin farther on begins nine voxels away, and a small triangle reaches two beyond its bin (BinBox).
constexpr std::int32_t kFar[] = {2, 6};

struct Pocket {
  std::uint32_t region = 0;
  std::vector<Voxel> voxels;
  std::vector<std::uint32_t> blocks;  ///< numbers of those that hold them
};

Vector3d position(const Voxel& v) { return {double(v[0]), double(v[1]), double(v[2])}; }

class PocketOpener {
 public:
  PocketOpener(const IndexSoup& soup, const TriangleBins& bins, const std::vector<BlockAt>& blocks,
               Regions& regions, const RunContext& context)
      : soup_(soup), bins_(bins), blocks_(blocks), regions_(regions), context_(context) {}

  void run() {
    find_pockets();
    std::vector<char> open(regions_.count, 0);
    open[Regions::kOutside] = 1;
    for (const std::int32_t far : kFar) {
      far_ = far;
      goals_ = open;
      std::vector<std::uint32_t> asked = closed_ones(open);
      // A crevice may hold several pockets, one behind the other.
      for (bool first = true; !asked.empty(); first = false) {
        const std::vector<char> sees = look(asked);
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
    for (BlockComponent& component : regions_.components)
      if (open[component.region]) component.region = Regions::kOutside;
  }

 private:
  std::vector<std::uint32_t> closed_ones(const std::vector<char>& open) const {
    std::vector<std::uint32_t> closed;
    for (std::uint32_t i = 0; i < pockets_.size(); ++i)
      if (!open[pockets_[i].region]) closed.push_back(i);
    return closed;
  }

  /// Only these can see what has just been opened. To ask all would take as many looks as a slit has voxels for each
  /// of the rounds that lead through it.
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

  /// Which of these pockets see a goal.
  std::vector<char> look(const std::vector<std::uint32_t>& asked) const {
    std::vector<char> sees(asked.size(), 0);
    tbb::parallel_for(std::size_t(0), asked.size(), [&](std::size_t i) {
      context_.check();
      const std::vector<Voxel>& voxels = pockets_[asked[i]].voxels;
      sees[i] = std::any_of(voxels.begin(), voxels.end(), [&](const Voxel& voxel) { return sees_goal(voxel); });
    });
    return sees;
  }

  void find_pockets() {
    std::vector<std::size_t> size(regions_.count, 0);
    for (const BlockComponent& component : regions_.components)
      for (const std::uint64_t word : component.voxels)
        size[component.region] += std::size_t(__builtin_popcountll(word));
    std::vector<std::uint32_t> number(regions_.count, BlockTable::kNone);
    pockets_in_.resize(blocks_.size());
    for (std::size_t i = 0; i < blocks_.size(); ++i)
      for (std::uint32_t c = regions_.first[i]; c < regions_.first[i + 1]; ++c) {
        const BlockComponent& component = regions_.components[c];
        if (component.region == Regions::kOutside || size[component.region] > kMost) continue;
        if (number[component.region] == BlockTable::kNone) {
          number[component.region] = std::uint32_t(pockets_.size());
          pockets_.push_back({component.region, {}, {}});
        }
        Pocket& pocket = pockets_[number[component.region]];
        pocket.blocks.push_back(std::uint32_t(i));
        pockets_in_[i].push_back(number[component.region]);
        add_voxels(blocks_[i], component.voxels, pocket.voxels);
      }
  }

  static void add_voxels(const BlockAt& block, const VoxelBits& bits, std::vector<Voxel>& voxels) {
    for (std::int32_t x = 0; x < 8; ++x)
      for (std::uint64_t word = bits[std::size_t(x)]; word; word &= word - 1) {
        const int place = __builtin_ctzll(word);
        voxels.push_back({block[0] * 8 + x, block[1] * 8 + place / 8, block[2] * 8 + place % 8});
      }
  }

  bool is_goal(const Voxel& voxel) const {
    const std::uint32_t i = bins_.blocks().find(tile_of(voxel));
    if (i == BlockTable::kNone) return false;
    const unsigned place = place_in_tile(voxel);
    for (std::uint32_t c = regions_.first[i]; c < regions_.first[i + 1]; ++c)
      if (regions_.components[c].voxels[place >> 6] >> (place & 63) & 1)
        return goals_[regions_.components[c].region];
    return false;
  }

  bool sees_goal(const Voxel& voxel) const {
    std::vector<Obstacle> obstacles;
    bool looked = false;
    const Vector3d from = position(voxel);
    // Near ones first.
    for (std::int32_t far = 1; far <= far_; ++far)
      for (std::int32_t x = -far; x <= far; ++x)
        for (std::int32_t y = -far; y <= far; ++y)
          for (std::int32_t z = -far; z <= far; ++z) {
            if (std::max({std::abs(x), std::abs(y), std::abs(z)}) != far) continue;
            const Voxel other{voxel[0] + x, voxel[1] + y, voxel[2] + z};
            if (!is_goal(other)) continue;
            if (!std::exchange(looked, true)) obstacles = obstacles_near(voxel);
            if (free(from, position(other), obstacles)) return true;
          }
    return false;
  }

  /// Leaves what is in the way in front, since it is often in the way to the next voxel, too.
  static bool free(const Vector3d& from, const Vector3d& to, std::vector<Obstacle>& obstacles) {
    // A triangle in whose plane the way lies is met by no test, so the way is taken a little to one side.
    const Vector3d aside = to + Vector3d(1.1e-5, 1.7e-5, 2.3e-5);
    const auto met = std::find_if(obstacles.begin(), obstacles.end(), [&](const Obstacle& o) {
      return o.meeting(from, to) >= 0 || o.meeting(from, aside) >= 0;
    });
    if (met == obstacles.end()) return true;
    std::iter_swap(obstacles.begin(), met);
    return false;
  }

  std::vector<Obstacle> obstacles_near(const Voxel& voxel) const {
    const Vector3d at = position(voxel), reach = Vector3d::Constant(far_ + 0.01);
    std::vector<Obstacle> obstacles;
    const auto add = [&](std::uint32_t t) {
      const Facet facet(soup_.corners(t));
      if ((facet.low().array() <= (at + reach).array()).all() &&
          (facet.high().array() >= (at - reach).array()).all())
        obstacles.emplace_back(facet);
    };
    const BlockAt block = tile_of(voxel);
    VoxelBox near;
    for (std::size_t a = 0; a < 3; ++a) {
      near.low[a] = voxel[a] - reach[0];
      near.high[a] = voxel[a] + reach[0];
    }
    bins_.for_each_cluster(block, near, [&](const TriangleBins::Cluster& cluster) {
      for (const std::uint32_t t : cluster.triangles) add(t);
    });
    // A large triangle some voxels away may be filed under the blocks around only.
    for (std::int32_t x = -1; x <= 1; ++x)
      for (std::int32_t y = -1; y <= 1; ++y)
        for (std::int32_t z = -1; z <= 1; ++z)
          if (const std::uint32_t i = bins_.blocks().find({block[0] + x, block[1] + y, block[2] + z});
              i != BlockTable::kNone)
            for (const std::uint32_t t : bins_.large(i)) add(t);
    return obstacles;
  }

  const IndexSoup& soup_;
  const TriangleBins& bins_;
  const std::vector<BlockAt>& blocks_;
  Regions& regions_;
  const RunContext& context_;
  std::vector<Pocket> pockets_;
  std::vector<std::vector<std::uint32_t>> pockets_in_;  ///< by block
  std::vector<std::uint32_t> opened_;                   ///< in the last round
  std::int32_t far_ = 0;
  std::vector<char> goals_;  ///< regions from which a way leads outside that pockets have not looked for yet
};

}  // namespace

void open_pockets(const IndexSoup& soup, const TriangleBins& bins, const std::vector<BlockAt>& blocks,
                  Regions& regions, const RunContext& context) {
  PocketOpener(soup, bins, blocks, regions, context).run();
}

}  // namespace hermesh
