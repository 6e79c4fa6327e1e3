#include "algorithms/voxelization/triangle_bins.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

/// A triangle whose box is longer than this, in voxels, is large. Filing under every block costs memory for
/// each, so small ones are filed once; but then a block must look at all that are filed around it.
constexpr double kLargest = 4.0;
/// Bins with more triangles than this are ordered by cells, which is quicker and nearly as compact.
constexpr std::size_t kMany = 1024;

std::int32_t block_of(double voxel) { return std::int32_t(std::floor(voxel)) >> 3; }

BlockAt block_of_centre(const VoxelBox& box) {
  BlockAt block;
  for (std::size_t a = 0; a < 3; ++a) block[a] = block_of(0.5 * (box.low[a] + box.high[a]));
  return block;
}

double gap(double low, double high, double from, double to) { return std::max({0.0, low - to, from - high}); }

/// Calls f(block) for the blocks with a voxel nearer than `reach` to the box.
template <class F>
void for_each_block_near(const VoxelBox& box, double reach, F&& f) {
  BlockAt from, to;
  for (int a = 0; a < 3; ++a) {
    from[a] = block_of(std::ceil(box.low[a] - reach));
    to[a] = block_of(std::floor(box.high[a] + reach));
  }
  const auto gap2 = [&](int axis, std::int32_t b) {
    const double g = gap(box.low[axis], box.high[axis], 8.0 * b, 8.0 * b + 7.0);
    return g * g;
  };
  for (std::int32_t x = from[0]; x <= to[0]; ++x)
    for (std::int32_t y = from[1]; y <= to[1]; ++y) {
      const double gap_xy = gap2(0, x) + gap2(1, y);
      if (gap_xy > reach * reach) continue;
      for (std::int32_t z = from[2]; z <= to[2]; ++z)
        if (gap_xy + gap2(2, z) <= reach * reach) f(BlockAt{x, y, z});
    }
}

/// Whether a block can hold a voxel within reach of a triangle, by the triangle's plane and the planes
/// through its edges.
class TriangleSlab {
 public:
  explicit TriangleSlab(const TriangleCorners& c) {
    const Eigen::Map<const Eigen::Vector3d> p0(c.data()), p1(c.data() + 3), p2(c.data() + 6);
    const Eigen::Vector3d normal = (p1 - p0).cross(p2 - p0);
    if (!(normal.squaredNorm() > 0)) return;
    add(normal.normalized(), p0);
    for (const auto& [a, b] : {std::pair(p0, p1), std::pair(p1, p2), std::pair(p2, p0)}) {
      const Eigen::Vector3d outward = (b - a).cross(normal);
      if (outward.squaredNorm() > 0) add(outward.normalized(), a);
    }
  }
  bool near(const BlockAt& block, double reach) const {
    const Eigen::Vector3d centre(block[0] * 8.0 + 3.5, block[1] * 8.0 + 3.5, block[2] * 8.0 + 3.5);
    for (int i = 0; i < count_; ++i) {
      const double d = normal_[i].dot(centre) - offset_[i];
      if ((i == 0 ? std::abs(d) : d) > reach + radius_[i]) return false;
    }
    return true;
  }

 private:
  void add(const Eigen::Vector3d& normal, const Eigen::Vector3d& point) {
    normal_[count_] = normal;
    offset_[count_] = normal.dot(point);
    // Half the extent of a block's voxels along the normal, and some for rounding.
    radius_[count_] = 3.5 * normal.cwiseAbs().sum() + 1e-6;
    ++count_;
  }
  Eigen::Vector3d normal_[4];
  double offset_[4], radius_[4];
  int count_ = 0;
};

/// Pieces of the work whose number depends on its size alone, so that every thread count gives the same
/// result.
struct Chunks {
  std::size_t items, size, count;
  explicit Chunks(std::size_t n, std::size_t smallest = 8192)
      : items(n), size(std::max(smallest, (n + 63) / 64)), count((n + size - 1) / size) {}
  std::size_t begin(std::size_t chunk) const { return chunk * size; }
  std::size_t end(std::size_t chunk) const { return std::min(items, (chunk + 1) * size); }
};

template <class F>
void parallel_chunks(const Chunks& chunks, const RunContext& context, F&& f) {
  tbb::parallel_for(std::size_t(0), chunks.count, [&](std::size_t chunk) {
    context.check();
    f(chunk);
  });
}

struct Centre {
  Eigen::Vector3f at;
  std::uint32_t triangle;
};

/// Orders triangles so that each sixteen in a row are close together: halves the longest side, again and
/// again.
void make_compact(std::span<Centre> centres) {
  while (centres.size() > kClusterSize) {
    Eigen::Vector3f low = centres[0].at, high = low;
    for (const Centre& c : centres) {
      low = low.cwiseMin(c.at);
      high = high.cwiseMax(c.at);
    }
    int axis = 0;
    (high - low).maxCoeff(&axis);
    // Whole clusters on the lower side.
    const std::size_t half = (centres.size() / 2 + kClusterSize - 1) / kClusterSize * kClusterSize;
    std::nth_element(centres.begin(), centres.begin() + std::ptrdiff_t(half), centres.end(),
                     [&](const Centre& a, const Centre& b) {
                       return a.at[axis] != b.at[axis] ? a.at[axis] < b.at[axis] : a.triangle < b.triangle;
                     });
    make_compact(centres.first(half));
    centres = centres.subspan(half);
  }
}

/// Orders many triangles along the Morton curve through cells of half a voxel, in linear time. Fills
/// `sorted`.
void sort_by_cell(const std::vector<Centre>& centres, const BlockAt& block, double scale,
                  std::vector<std::uint32_t>& cell, std::vector<Centre>& sorted) {
  constexpr int kBits = 4;
  std::vector<std::uint32_t> next((1 << 3 * kBits) + 1, 0);
  cell.resize(centres.size());
  for (std::size_t i = 0; i < centres.size(); ++i) {
    std::uint32_t key = 0;
    for (int a = 0; a < 3; ++a) {
      // A centre is stored as the sum of the ends of its box.
      const double place = 0.5 * double(centres[i].at[a]) * scale - 8.0 * block[std::size_t(a)];
      const std::uint32_t c = std::uint32_t(std::clamp(place * 2.0, 0.0, 15.0));
      for (int bit = 0; bit < kBits; ++bit) key |= (c >> bit & 1u) << (3 * bit + a);
    }
    cell[i] = key;
    ++next[key + 1];
  }
  for (std::size_t c = 1; c < next.size(); ++c) next[c] += next[c - 1];
  sorted.resize(centres.size());
  for (std::size_t i = 0; i < centres.size(); ++i) sorted[next[cell[i]]++] = centres[i];
}

}  // namespace

TriangleBins::FloatBox TriangleBins::box_of(std::size_t triangle) const {
  const Triangle t = soup_.triangle(triangle);
  const Eigen::Vector3f &a = soup_.point(t[0]), &b = soup_.point(t[1]), &c = soup_.point(t[2]);
  return {a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)};
}

VoxelBox TriangleBins::in_voxels(const FloatBox& box) const {
  VoxelBox result;
  for (int a = 0; a < 3; ++a) {
    result.low[a] = double(box.low[a]) * soup_.scale();
    result.high[a] = double(box.high[a]) * soup_.scale();
  }
  return result;
}

TriangleBins::TriangleBins(const IndexSoup& soup, double reach, RunContext& context)
    : soup_(soup), reach_(reach), rings_(int(std::ceil((reach + 0.5 * kLargest) / 8.0))) {
  file_small(context);
  make_clusters(context);
  choose_blocks(context);
}

bool TriangleBins::is_large(const VoxelBox& box) {
  double longest = 0;
  for (std::size_t a = 0; a < 3; ++a) longest = std::max(longest, box.high[a] - box.low[a]);
  return longest > kLargest;
}

void TriangleBins::file_small(RunContext& context) {
  const Chunks chunks(soup_.size());
  std::vector<BlockSet> sets(chunks.count);
  std::vector<std::vector<std::uint32_t>> found(
      chunks.count);  ///< triangles by the code of their block in the set
  all_large_.resize(chunks.count);
  parallel_chunks(chunks, context, [&](std::size_t chunk) {
    for (std::size_t t = chunks.begin(chunk); t < chunks.end(chunk); ++t) {
      const VoxelBox box = in_voxels(box_of(t));
      if (is_large(box)) {
        all_large_[chunk].push_back(std::uint32_t(t));
        continue;
      }
      const std::uint32_t code = sets[chunk].insert(block_of_centre(box));
      if (code >= found[chunk].size()) found[chunk].resize((code | 511) + 1, 0);
      ++found[chunk][code];
    }
  });
  bins_ = BlockTable(sets);
  // next[chunk · bins + bin]: first how many, then where the chunk's next triangle of the bin goes.
  std::vector<std::uint32_t> next(chunks.count * bins_.size(), 0);
  parallel_chunks(chunks, context, [&](std::size_t chunk) {
    const std::vector<std::uint32_t> translation = bins_.translation(sets[chunk]);
    for (std::uint32_t code = 0; code < found[chunk].size(); ++code)
      if (found[chunk][code] > 0)
        next[chunk * bins_.size() + bins_.number(translation, code)] = found[chunk][code];
    found[chunk] = {};
  });
  first_.resize(bins_.size() + 1);
  std::uint32_t total = 0;
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
    first_[bin] = total;
    for (std::size_t chunk = 0; chunk < chunks.count; ++chunk)
      total += std::exchange(next[chunk * bins_.size() + bin], total);
  }
  first_.back() = total;
  order_.resize(total);
  // The blocks are found again rather than remembered, which for ten million triangles would take more memory
  // than the volume.
  parallel_chunks(chunks, context, [&](std::size_t chunk) {
    BlockFinder finder(bins_);
    for (std::size_t t = chunks.begin(chunk); t < chunks.end(chunk); ++t) {
      const VoxelBox box = in_voxels(box_of(t));
      if (!is_large(box))
        order_[next[chunk * bins_.size() + finder.find(block_of_centre(box))]++] = std::uint32_t(t);
    }
  });
}

void TriangleBins::make_clusters(RunContext& context) {
  first_cluster_.resize(bins_.size() + 1);
  std::uint32_t total = 0;
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
    first_cluster_[bin] = total;
    total += std::uint32_t((first_[bin + 1] - first_[bin] + kClusterSize - 1) / kClusterSize);
  }
  first_cluster_.back() = total;
  clusters_.resize(total);
  const std::vector<BlockAt> blocks = bins_.blocks();
  const Chunks chunks(bins_.size(), 64);
  parallel_chunks(chunks, context, [&](std::size_t chunk) {
    std::vector<Centre> centres, sorted;
    std::vector<std::uint32_t> cells;
    for (std::size_t bin = chunks.begin(chunk); bin < chunks.end(chunk); ++bin) {
      context.check();
      const std::span<std::uint32_t> triangles(order_.data() + first_[bin], first_[bin + 1] - first_[bin]);
      if (triangles.size() > kClusterSize) {
        centres.clear();
        for (const std::uint32_t t : triangles) {
          const FloatBox box = box_of(t);
          centres.push_back({box.low + box.high, t});
        }
        if (centres.size() > kMany) {
          sort_by_cell(centres, blocks[bin], soup_.scale(), cells, sorted);
          centres.swap(sorted);
        } else {
          make_compact(centres);
        }
        std::transform(centres.begin(), centres.end(), triangles.begin(),
                       [](const Centre& c) { return c.triangle; });
      }
      FloatBox* cluster = clusters_.data() + first_cluster_[bin];
      for (std::size_t first = 0; first < triangles.size(); first += kClusterSize, ++cluster) {
        *cluster = box_of(triangles[first]);
        for (std::size_t i = first + 1; i < std::min(first + kClusterSize, triangles.size()); ++i) {
          const FloatBox box = box_of(triangles[i]);
          cluster->low = cluster->low.cwiseMin(box.low);
          cluster->high = cluster->high.cwiseMax(box.high);
        }
      }
    }
  });
}

void TriangleBins::choose_blocks(RunContext& context) {
  const Chunks bins(bins_.size(), 64);
  std::vector<BlockSet> sets(bins.count + all_large_.size());
  parallel_chunks(bins, context, [&](std::size_t chunk) {
    const std::size_t end = first_cluster_[bins.end(chunk)];
    for (std::size_t c = first_cluster_[bins.begin(chunk)]; c < end; ++c)
      for_each_block_near(in_voxels(clusters_[c]), reach_,
                          [&](const BlockAt& block) { sets[chunk].insert(block); });
  });
  // Pairs of a block and a large triangle near it.
  using Pair = std::pair<std::uint32_t, std::uint32_t>;
  std::vector<std::vector<Pair>> pairs(all_large_.size());
  tbb::parallel_for(std::size_t(0), all_large_.size(), [&](std::size_t chunk) {
    BlockSet& set = sets[bins.count + chunk];
    for (const std::uint32_t t : all_large_[chunk]) {
      const VoxelBox box = in_voxels(box_of(t));
      context.check();
      const TriangleSlab slab(soup_.corners(t));
      for_each_block_near(box, reach_, [&](const BlockAt& block) {
        if (slab.near(block, reach_)) pairs[chunk].emplace_back(set.insert(block), t);
      });
    }
  });
  blocks_ = BlockTable(sets);
  first_large_.assign(blocks_.size() + 1, 0);
  for (std::size_t chunk = 0; chunk < pairs.size(); ++chunk) {
    const std::vector<std::uint32_t> translation = blocks_.translation(sets[bins.count + chunk]);
    for (Pair& pair : pairs[chunk]) ++first_large_[pair.first = blocks_.number(translation, pair.first)];
  }
  std::uint64_t total = 0;
  for (std::uint64_t& count : first_large_) total += std::exchange(count, total);
  large_.resize(total);
  std::vector<std::uint64_t> next(first_large_.begin(), first_large_.end() - 1);
  for (std::vector<Pair>& chunk : pairs) {
    for (const Pair& pair : chunk) large_[next[pair.first]++] = pair.second;
    chunk = {};
  }
}

}  // namespace hermesh
