#include "algorithms/voxelization/inside/cell_obstacles.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <tuple>

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Largest numbers of stored blocks and triangles: a few megabytes. Where sheets intersect, a block may hold
/// thousands of triangles, and filing them again costs more than the queries.
constexpr std::size_t kMostBlocks = 256, kMostObstacles = 20000;

/// A triangle that is prepared for tests against many segments, most of which miss it.
class Obstacle {
 public:
  explicit Obstacle(const Facet& facet)
      : facet_(facet),
        low_(facet.low().array() - kMargin),
        high_(facet.high().array() + kMargin),
        normal_(facet.normal()),
        offset_(normal_.dot(facet.corner[0])),
        slack_(kMargin * normal_.norm()) {}

  /// Returns the result of hermesh::meeting(), after tests against the box and the plane that reject most
  /// segments.
  double meeting(const Vector3d& from, const Vector3d& to) const {
    if ((from.cwiseMin(to).array() > high_.array()).any() || (from.cwiseMax(to).array() < low_.array()).any())
      return -1.0;
    const double a = normal_.dot(from) - offset_, b = normal_.dot(to) - offset_;
    if (std::min(a, b) > slack_ || std::max(a, b) < -slack_) return -1.0;
    return hermesh::meeting(from, to, facet_);
  }
  const Facet& facet() const { return facet_; }
  /// Calls f(index) for the cells of a block that the triangle may touch, by its box and its plane.
  template <class F>
  void for_each_cell(const BlockAt& block, F&& f) const {
    const Vector3d origin(block[0] * 8.0, block[1] * 8.0, block[2] * 8.0);
    int from[3], to[3];
    for (int a = 0; a < 3; ++a) {
      // The range is empty where the box is outside of the block: 8 to 7 above it, 0 to −1 below.
      from[a] = int(std::clamp(std::floor(low_[a] - origin[a]), 0.0, 8.0));
      to[a] = int(std::clamp(std::floor(high_[a] - origin[a]), -1.0, 7.0));
    }
    for (int x = from[0]; x <= to[0]; ++x)
      for (int y = from[1]; y <= to[1]; ++y)
        for (int z = from[2]; z <= to[2]; ++z)
          if (plane_meets_cell(origin + Vector3d(x, y, z))) f(std::uint32_t(sample_index(x, y, z)));
  }
  /// Returns true if the corners run counter-clockwise seen from p.
  bool faces(const Vector3d& p) const { return normal_.dot(p) > offset_; }

 private:
  bool plane_meets_cell(const Vector3d& voxel) const {
    const double from_middle = normal_.dot(voxel + Vector3d::Constant(0.5)) - offset_;
    return std::abs(from_middle) <= 0.5 * normal_.lpNorm<1>() + slack_;
  }

  static constexpr double kMargin = 5e-6;  ///< voxels; above kSideShift, by which segments leave their cells
  Facet facet_;
  Vector3d low_, high_;  ///< bounding box, grown by the margin
  Vector3d normal_;      ///< not of unit length
  double offset_, slack_;
};

/// Calls f(cell) for the cells that the box of a segment overlaps, while it returns true. Returns true if all
/// calls did.
template <class F>
bool all_cells(const Vector3d& from, const Vector3d& to, F&& f) {
  const Voxel low = cell_of(from.cwiseMin(to)), high = cell_of(from.cwiseMax(to));
  for (std::int32_t x = low[0]; x <= high[0]; ++x)
    for (std::int32_t y = low[1]; y <= high[1]; ++y)
      for (std::int32_t z = low[2]; z <= high[2]; ++z)
        if (!f(Voxel{x, y, z})) return false;
  return true;
}

}  // namespace

Voxel cell_of(const Vector3d& point) {
  const auto cell = [&](int axis) { return static_cast<std::int32_t>(std::floor(point[axis])); };
  return {cell(0), cell(1), cell(2)};
}

/// The triangles of one block, sorted by cell.
struct CellObstacles::Block {
  struct Entry {
    std::uint32_t cell;   ///< index in the block
    std::uint32_t index;  ///< in `obstacles`
  };
  std::vector<Obstacle> obstacles;
  std::vector<std::uint32_t> triangles;  ///< numbers of the obstacles in the soup
  std::vector<Entry> entries;
  std::array<std::uint32_t, 513> first{};  ///< entries of cell c: entries[first[c]] …

  Block(const IndexSoup& soup, const TriangleBins& bins, const BlockAt& at) {
    const auto add = [&](std::uint32_t triangle) {
      const Obstacle obstacle{Facet(soup.corners(triangle))};
      const std::size_t before = entries.size();
      obstacle.for_each_cell(at, [&](std::uint32_t cell) {
        entries.push_back({cell, std::uint32_t(obstacles.size())});
      });
      if (entries.size() == before) return;
      obstacles.push_back(obstacle);
      triangles.push_back(triangle);
    };
    bins.for_each_cluster(at, around(at, 1.1), [&](const TriangleBins::Cluster& cluster) {
      if (cluster.box.overlaps(cells_around(at, 0.1))) std::ranges::for_each(cluster.triangles, add);
    });
    if (const std::uint32_t i = bins.blocks().find(at); i != BlockTable::kNone)
      std::ranges::for_each(bins.large(i), add);
    std::ranges::stable_sort(entries, {}, &Entry::cell);
    for (const Entry& entry : entries) ++first[entry.cell + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
  }

  std::span<Entry> in_cell(const Voxel& cell) {
    const unsigned c = place_in_tile(cell);
    return {entries.data() + first[c], entries.data() + first[c + 1]};
  }
};

CellObstacles::CellObstacles(const IndexSoup& soup, const TriangleBins& bins) : soup_(soup), bins_(bins) {}
CellObstacles::~CellObstacles() = default;
CellObstacles::CellObstacles(CellObstacles&&) noexcept = default;

/// Returns the block that contains a cell, and collects its triangles if they are not stored.
CellObstacles::Block& CellObstacles::block_of(const Voxel& cell) {
  const BlockAt at = tile_of(cell);
  if (last_ && at == last_at_) return *last_;
  if (!blocks_.contains(at)) {
    // All at once rather than the oldest: queries go from block to block, and neighbours are filed again
    // soon.
    if (blocks_.size() >= kMostBlocks || obstacles_ > kMostObstacles) {
      blocks_.clear();
      obstacles_ = 0;
    }
    const auto& made = blocks_[at] = std::make_unique<Block>(soup_, bins_, at);
    obstacles_ += made->obstacles.size();
    work_ += made->entries.size();
  }
  last_at_ = at;
  last_ = blocks_.at(at).get();
  return *last_;
}

bool CellObstacles::is_free_in(const Voxel& cell, const Vector3d& from, const Vector3d& to) {
  Block& block = block_of(cell);
  const std::span<Block::Entry> entries = block.in_cell(cell);
  for (auto i = entries.begin(); i != entries.end(); ++i) {
    ++work_;
    const Obstacle& obstacle = block.obstacles[i->index];
    if (obstacle.meeting(from, to) < 0) continue;
    last_met_ = obstacle.facet();
    // The next segment often intersects the same obstacle, so it is moved to the front.
    std::rotate(entries.begin(), i, i + 1);
    return false;
  }
  return true;
}

bool CellObstacles::is_free(const Vector3d& from, const Vector3d& to) {
  if (meeting(from, to, last_met_) >= 0) return false;
  // In pieces of at most a voxel, for the box of a long segment has many cells that the segment does not
  // meet.
  const int pieces = std::max(1, int(std::ceil((to - from).cwiseAbs().maxCoeff())));
  for (int i = 0; i < pieces; ++i) {
    const Vector3d begin = from + (to - from) * (double(i) / pieces),
                   end = from + (to - from) * (double(i + 1) / pieces);
    if (!all_cells(begin, end, [&](const Voxel& cell) { return is_free_in(cell, from, to); })) return false;
  }
  return true;
}

CellObstacles::Met CellObstacles::first_met(const Vector3d& from, const Vector3d& to) {
  Met first;
  all_cells(from, to, [&](const Voxel& cell) {
    Block& block = block_of(cell);
    ++work_;
    for (const auto& [in, i] : block.in_cell(cell)) {
      ++work_;
      const double part = block.obstacles[i].meeting(from, to);
      if (part >= 0.0 && std::tie(part, block.triangles[i]) < std::tie(first.part, first.triangle))
        first = {part, block.obstacles[i].faces(from), block.triangles[i]};
    }
    return true;
  });
  return first;
}

std::vector<std::uint32_t> CellObstacles::triangles_in(const Voxel& cell) {
  Block& block = block_of(cell);
  std::vector<std::uint32_t> found;
  for (const auto& [in, i] : block.in_cell(cell)) found.push_back(block.triangles[i]);
  work_ += found.size();
  return found;
}

}  // namespace hermesh
