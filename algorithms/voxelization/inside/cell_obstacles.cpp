#include "algorithms/voxelization/inside/cell_obstacles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <vector>

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// The most that is kept. Some hundred kilobytes of blocks, some megabytes of triangles: where sheets cross a
/// block may hold thousands, and to file them again costs more than what is asked of them.
constexpr std::size_t kMostBlocks = 256, kMostObstacles = 20000;

/// Calls f(cell) for the cells that the box around a way meets, while it returns true. Returns whether all
/// did.
template <class F>
bool all_cells(const Vector3d& from, const Vector3d& to, F&& f) {
  const Vector3d low = from.cwiseMin(to), high = from.cwiseMax(to);
  const auto first = [&](int axis) { return static_cast<std::int32_t>(std::floor(low[axis])); };
  for (std::int32_t x = first(0); x <= high[0]; ++x)
    for (std::int32_t y = first(1); y <= high[1]; ++y)
      for (std::int32_t z = first(2); z <= high[2]; ++z)
        if (!f(CellObstacles::Voxel{x, y, z})) return false;
  return true;
}

}  // namespace

/// The triangles of one block by cell, in one array (count, scan, fill): some hundred little lists would cost
/// more than what is asked of them.
struct CellObstacles::Block {
  std::vector<Obstacle> obstacles;
  std::vector<std::uint32_t> triangles;  ///< their numbers in the soup
  /// Numbers of the obstacles of cell c by place_in_tile(): numbers[first[c]] …
  std::array<std::uint32_t, 513> first{};
  std::vector<std::uint32_t> numbers;

  Block(const IndexSoup& soup, const TriangleBins& bins, const BlockAt& at) {
    // First how many triangles each cell has. A triangle whose plane passes all cells of the block by is not
    // kept.
    const auto add = [&](std::uint32_t triangle) {
      obstacles.emplace_back(Facet(soup.corners(triangle)));
      bool touches = false;
      for_each_cell(obstacles.back(), at, [&](unsigned cell) {
        ++first[cell + 1];
        touches = true;
      });
      if (touches)
        triangles.push_back(triangle);
      else
        obstacles.pop_back();
    };
    bins.for_each_cluster(at, around(at, 1.1), [&](const TriangleBins::Cluster& cluster) {
      for (std::size_t a = 0; a < 3; ++a)
        // The cells of a block reach from its first voxel to the next block's; the rest is more than the
        // margin.
        if (cluster.box.lower[a] > at[a] * 8.0 + 8.1 || cluster.box.upper[a] < at[a] * 8.0 - 0.1) return;
      for (const std::uint32_t t : cluster.triangles) add(t);
    });
    if (const std::uint32_t i = bins.blocks().find(at); i != BlockTable::kNone)
      for (const std::uint32_t t : bins.large(i)) add(t);
    // Then where each cell's list begins, and last the lists.
    std::partial_sum(first.begin(), first.end(), first.begin());
    numbers.resize(first.back());
    std::array<std::uint32_t, 513> next = first;
    for (std::uint32_t i = 0; i < obstacles.size(); ++i)
      for_each_cell(obstacles[i], at, [&](unsigned cell) { numbers[next[cell]++] = i; });
  }

  std::span<std::uint32_t> in_cell(unsigned cell) {
    return {numbers.data() + first[cell], numbers.data() + first[cell + 1]};
  }

  /// Finds an obstacle of the cell that is in the way, or null. What is in one way is often in the next one,
  /// so it comes first from now on; whether one is found does not depend on the order.
  const Obstacle* find(unsigned cell, const Vector3d& from, const Vector3d& to, std::size_t& work) {
    const std::span<std::uint32_t> there = in_cell(cell);
    for (auto i = there.begin(); i != there.end(); ++i) {
      ++work;
      if (obstacles[*i].meeting(from, to) < 0) continue;
      std::rotate(there.begin(), i, i + 1);
      return &obstacles[there.front()];
    }
    return nullptr;
  }

  /// Makes a triangle of the cell the first one met if it is; of several at one place the one with the least
  /// number, for the order of the list depends on what was asked before.
  void meet(unsigned cell, const Vector3d& from, const Vector3d& to, Met& met) {
    for (const std::uint32_t i : in_cell(cell))
      if (const double along = obstacles[i].meeting(from, to);
          along >= 0 && (along < met.part || (along == met.part && triangles[i] < met.triangle)))
        met = {along, obstacles[i].faces(from), triangles[i]};
  }

 private:
  /// Calls f(place_in_tile()) for the cells that an obstacle may touch, by its box and its plane.
  template <class F>
  static void for_each_cell(const Obstacle& obstacle, const BlockAt& at, F&& f) {
    const Vector3d origin(at[0] * 8.0, at[1] * 8.0, at[2] * 8.0);
    int from[3], to[3];
    for (int a = 0; a < 3; ++a) {
      // The clamps leave nothing of a box beside the block: 8 to 7 above it, 0 to −1 below.
      from[a] = int(std::clamp(std::floor(obstacle.low()[a] - origin[a]), 0.0, 8.0));
      to[a] = int(std::clamp(std::floor(obstacle.high()[a] - origin[a]), -1.0, 7.0));
    }
    for (int x = from[0]; x <= to[0]; ++x)
      for (int y = from[1]; y <= to[1]; ++y)
        for (int z = from[2]; z <= to[2]; ++z)
          if (obstacle.plane_meets_cell(origin + Vector3d(x, y, z))) f(unsigned(x * 64 + y * 8 + z));
  }
};

CellObstacles::CellObstacles(const IndexSoup& soup, const TriangleBins& bins, std::size_t kept)
    : soup_(soup), bins_(bins), kept_(kept) {}
CellObstacles::~CellObstacles() = default;
CellObstacles::CellObstacles(CellObstacles&&) noexcept = default;

/// The block that a cell is in, made if it is not kept.
CellObstacles::Block& CellObstacles::block_of(const Voxel& cell) {
  const BlockAt at = tile_of(cell);
  if (last_ && at == last_at_) return *last_;
  auto known = blocks_.find(at);
  if (known == blocks_.end()) {
    // All at once rather than the oldest: questions go from block to block, and what is near is made again
    // soon.
    if (blocks_.size() >= kMostBlocks || (blocks_.size() >= kept_ && obstacles_ > kMostObstacles)) {
      blocks_.clear();
      obstacles_ = 0;
    }
    known = blocks_.emplace(at, std::make_unique<Block>(soup_, bins_, at)).first;
    obstacles_ += known->second->obstacles.size();
    work_ += known->second->numbers.size();
  }
  last_at_ = at;
  last_ = known->second.get();
  return *last_;
}

bool CellObstacles::is_free_in(const Voxel& cell, const Vector3d& from, const Vector3d& to) {
  return !block_of(cell).find(place_in_tile(cell), from, to, work_);
}

/// What met a way lately is tried first, then the cells that the way leads through.
bool CellObstacles::is_free(const Vector3d& from, const Vector3d& to) {
  for (const Obstacle& obstacle : met_)
    if (obstacle.meeting(from, to) >= 0) return false;
  // In pieces of at most a voxel, for the box around a long way holds many cells that it does not meet.
  const int pieces = std::max(1, int(std::ceil((to - from).cwiseAbs().maxCoeff())));
  for (int i = 0; i < pieces; ++i) {
    const Vector3d begin = from + (to - from) * (double(i) / pieces),
                   end = from + (to - from) * (double(i + 1) / pieces);
    const bool free = all_cells(begin, end, [&](const Voxel& cell) {
      const Obstacle* met = block_of(cell).find(place_in_tile(cell), from, to, work_);
      if (met) remember(*met);
      return !met;
    });
    if (!free) return false;
  }
  return true;
}

/// Puts a copy in the place of the oldest of the few that are remembered, so that it outlives its block.
void CellObstacles::remember(const Obstacle& met) {
  constexpr std::size_t kMost = 4;
  if (met_.size() < kMost) {
    met_.push_back(met);
  } else {
    met_[oldest_] = met;
    oldest_ = (oldest_ + 1) % kMost;
  }
}

CellObstacles::Met CellObstacles::first_met(const Vector3d& from, const Vector3d& to) {
  Met first;
  // All cells of the box, in any order: the least parameter wins.
  all_cells(from, to, [&](const Voxel& cell) {
    Block& block = block_of(cell);
    work_ += 1 + block.in_cell(place_in_tile(cell)).size();
    block.meet(place_in_tile(cell), from, to, first);
    return true;
  });
  return first;
}

const std::vector<std::uint32_t>& CellObstacles::triangles_in(const Voxel& cell) {
  Block& block = block_of(cell);
  found_.clear();
  for (const std::uint32_t i : block.in_cell(place_in_tile(cell))) found_.push_back(block.triangles[i]);
  work_ += found_.size();
  return found_;
}

}  // namespace hermesh
