#include "algorithms/voxelization/cell_obstacles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "algorithms/core/rounding.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Calls f(cell) for the cells that the box around a way meets, while it returns true. Returns whether all did.
template <class F>
bool all_cells(const Vector3d& from, const Vector3d& to, F&& f) {
  const Vector3d low = from.cwiseMin(to), high = from.cwiseMax(to);
  for (std::int32_t x = floor_to_int(low[0]); x <= high[0]; ++x)
    for (std::int32_t y = floor_to_int(low[1]); y <= high[1]; ++y)
      for (std::int32_t z = floor_to_int(low[2]); z <= high[2]; ++z)
        if (!f(CellObstacles::Voxel{x, y, z})) return false;
  return true;
}

}  // namespace

struct CellObstacles::Block {
  std::vector<Obstacle> obstacles;
  std::vector<std::uint32_t> triangles;  ///< their numbers in the soup
  std::array<std::vector<std::uint32_t>, 512> cells;  ///< numbers of the obstacles, by place_in_tile()

  Block(const IndexSoup& soup, const TriangleBins& bins, const BlockAt& at) {
    bins.for_each_cluster(at, around(at, 1.1), [&](const TriangleBins::Cluster& cluster) {
      for (std::size_t a = 0; a < 3; ++a)
        if (cluster.box.low[a] > at[a] * 8.0 + 8.1 || cluster.box.high[a] < at[a] * 8.0 - 0.1) return;
      for (const std::uint32_t t : cluster.triangles) add(soup, t, at);
    });
    if (const std::uint32_t i = bins.blocks().find(at); i != BlockTable::kNone)
      for (const std::uint32_t t : bins.large(i)) add(soup, t, at);
  }

  /// One that is in the way, or null. What is in one way is often in the next one, so it comes first from now on.
  const Obstacle* find(unsigned cell, const Vector3d& from, const Vector3d& to) {
    std::vector<std::uint32_t>& numbers = cells[cell];
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (obstacles[numbers[i]].meeting(from, to) < 0) continue;
      std::rotate(numbers.begin(), numbers.begin() + std::ptrdiff_t(i), numbers.begin() + std::ptrdiff_t(i) + 1);
      return &obstacles[numbers.front()];
    }
    return nullptr;
  }

  /// Makes a triangle of the cell the first one met if it is; of several at one place that of the least number.
  void meet(unsigned cell, const Vector3d& from, const Vector3d& to, Met& first) const {
    for (const std::uint32_t i : cells[cell])
      if (const double along = obstacles[i].meeting(from, to);
          along >= 0 && (along < first.part || (along == first.part && triangles[i] < first.triangle)))
        first = {along, obstacles[i].faces(from), triangles[i]};
  }

 private:
  void add(const IndexSoup& soup, std::uint32_t triangle, const BlockAt& at) {
    const Facet facet(soup.corners(triangle));
    const Vector3d lowest = facet.low(), highest = facet.high();
    int from[3], to[3];
    for (int a = 0; a < 3; ++a) {
      const double origin = at[std::size_t(a)] * 8.0;
      from[a] = int(std::clamp(std::floor(lowest[a] - origin - 1e-6), 0.0, 8.0));
      to[a] = int(std::clamp(std::floor(highest[a] - origin + 1e-6), -1.0, 7.0));
      if (from[a] > to[a]) return;
    }
    const std::uint32_t number = std::uint32_t(obstacles.size());
    obstacles.emplace_back(facet);
    triangles.push_back(triangle);
    for (int x = from[0]; x <= to[0]; ++x)
      for (int y = from[1]; y <= to[1]; ++y)
        for (int z = from[2]; z <= to[2]; ++z) cells[std::size_t(x * 64 + y * 8 + z)].push_back(number);
  }
};

CellObstacles::CellObstacles(const IndexSoup& soup, const TriangleBins& bins, std::size_t kept)
    : soup_(soup), bins_(bins), kept_(kept) {}
CellObstacles::~CellObstacles() = default;
CellObstacles::CellObstacles(CellObstacles&&) noexcept = default;

CellObstacles::Block& CellObstacles::block_of(const Voxel& cell) {
  const BlockAt at = tile_of(cell);
  if (last_ && at == last_at_) return *last_;
  auto known = blocks_.find(at);
  if (known == blocks_.end()) {
    if (blocks_.size() >= kept_) blocks_.clear();
    known = blocks_.emplace(at, std::make_unique<Block>(soup_, bins_, at)).first;
  }
  last_at_ = at;
  last_ = known->second.get();
  return *last_;
}

bool CellObstacles::is_free_in(const Voxel& cell, const Vector3d& from, const Vector3d& to) {
  return !block_of(cell).find(place_in_tile(cell), from, to);
}

bool CellObstacles::is_free(const Vector3d& from, const Vector3d& to) {
  for (const Obstacle& obstacle : met_)
    if (obstacle.meeting(from, to) >= 0) return false;
  // In pieces of at most a voxel, for the box around a long way holds many cells that it does not meet.
  const int pieces = std::max(1, int(std::ceil((to - from).cwiseAbs().maxCoeff())));
  for (int i = 0; i < pieces; ++i) {
    const Vector3d begin = from + (to - from) * (double(i) / pieces),
                   end = from + (to - from) * (double(i + 1) / pieces);
    const bool free = all_cells(begin, end, [&](const Voxel& cell) {
      const Obstacle* met = block_of(cell).find(place_in_tile(cell), from, to);
      if (met) remember(*met);
      return !met;
    });
    if (!free) return false;
  }
  return true;
}

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
  all_cells(from, to, [&](const Voxel& cell) {
    block_of(cell).meet(place_in_tile(cell), from, to, first);
    return true;
  });
  return first;
}

std::vector<std::uint32_t> CellObstacles::triangles_in(const Voxel& cell) {
  const Block& block = block_of(cell);
  std::vector<std::uint32_t> numbers;
  for (const std::uint32_t i : block.cells[place_in_tile(cell)]) numbers.push_back(block.triangles[i]);
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

}  // namespace hermesh
