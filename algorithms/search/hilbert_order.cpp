#include "algorithms/search/hilbert_order.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "algorithms/core/bounds.h"

namespace hermesh {
namespace {

constexpr int kBits = 10;            ///< bits of a cell's coordinate, and of a digit of the radix sort
constexpr std::size_t kBatch = 256;  ///< triangles whose codes are computed together
constexpr std::size_t kKeysPerTask = 1 << 15;  ///< keys that one task sorts
constexpr std::size_t kCrowded = 32;  ///< triangles in a cell beyond which it gets a curve of its own

/// Code along the curve in the upper half, triangle number in the lower.
using SortKey = std::uint64_t;
// One array an axis, so that a loop over a batch reads and writes vectors.
using Cells = std::array<std::array<std::uint32_t, kBatch>, 3>;

/// Cell coordinates to place along the curve, in place and transposed: the code's bits are those of x, y and
/// z in turn (Skilling, Programming the Hilbert Curve, AIP Conf. Proc. 707, 2004). Without branches, over
/// many cells at a time.
void to_hilbert(Cells& cells) {
  // Skilling's undoing of turns and reflections, from the largest cubes to the smallest: where the bit is set
  // the lower bits of x are inverted, elsewhere they are exchanged with those of coordinate a.
  for (std::uint32_t bit = 1u << (kBits - 1); bit > 1; bit >>= 1)
    for (int a = 0; a < 3; ++a)
      // Skilling's Gray encoding; his loop over bits is an exclusive or of prefixes here.
      for (std::size_t i = 0; i < kBatch; ++i) {
        const std::uint32_t x = cells[0][i], y = cells[a][i];
        const std::uint32_t invert = (y & bit) ? bit - 1 : 0;
        const std::uint32_t exchange = (x ^ y) & (bit - 1) & ~invert;
        cells[a][i] = y ^ exchange;
        cells[0][i] = (a == 0 ? y : x) ^ exchange ^ invert;
      }
  for (std::size_t i = 0; i < kBatch; ++i) {
    cells[1][i] ^= cells[0][i];
    cells[2][i] ^= cells[1][i];
    std::uint32_t gray = cells[2][i];  // bit k becomes the exclusive or of the bits above k
    for (int shift = 1; shift < kBits; shift *= 2) gray ^= gray >> shift;
    gray >>= 1;
    for (int a = 0; a < 3; ++a) cells[a][i] ^= gray;
  }
}

/// Moves bit k of ten to bit 3k.
std::uint32_t spread(std::uint32_t v) {
  v = (v | (v << 16)) & 0x030000ffu;
  v = (v | (v << 8)) & 0x0300f00fu;
  v = (v | (v << 4)) & 0x030c30c3u;
  return (v | (v << 2)) & 0x09249249u;
}

template <class F>
void for_chunks(std::size_t n, std::size_t size, F&& f) {
  tbb::parallel_for(std::size_t{0}, (n + size - 1) / size,
                    [&](std::size_t chunk) { f(chunk * size, std::min(n, (chunk + 1) * size)); });
}

/// Stable radix sort by code, from the least significant digit on. Each chunk counts its digits, then writes
/// to places of its own, so the order does not depend on which thread does what.
void radix_sort(std::span<SortKey> keys) {
  constexpr std::size_t kDigits = std::size_t{1} << kBits;
  std::vector<SortKey> other(keys.size());
  std::span<SortKey> from = keys, to = other;
  std::vector<std::array<std::uint32_t, kDigits>> counts((keys.size() + kKeysPerTask - 1) / kKeysPerTask);
  for (int shift = 32; shift < 32 + 3 * kBits; shift += kBits) {
    const auto digit = [shift](SortKey key) { return (key >> shift) & (kDigits - 1); };
    for_chunks(keys.size(), kKeysPerTask, [&](std::size_t begin, std::size_t end) {
      auto& count = counts[begin / kKeysPerTask];
      count.fill(0);
      for (std::size_t i = begin; i < end; ++i) ++count[digit(from[i])];
    });
    // Places by digit and within a digit by chunk: equal digits stay in the order of the chunks.
    std::uint32_t total = 0;
    for (std::size_t d = 0; d < kDigits; ++d)
      for (auto& count : counts) total += std::exchange(count[d], total);
    for_chunks(keys.size(), kKeysPerTask, [&](std::size_t begin, std::size_t end) {
      auto& next = counts[begin / kKeysPerTask];
      for (std::size_t i = begin; i < end; ++i) to[next[digit(from[i])]++] = from[i];
    });
    std::swap(from, to);
  }
  // After three passes, an odd number, the sorted keys lie in `other`.
  for_chunks(keys.size(), kKeysPerTask, [&](std::size_t begin, std::size_t end) {
    std::copy(from.begin() + begin, from.begin() + end, keys.begin() + begin);
  });
}

class CurveSorter {
 public:
  CurveSorter(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles)
      : points_(points), triangles_(triangles) {}

  /// Sorts keys along a curve through the cube that holds the centers of their triangles. They come in order
  /// of triangle number, and of equal codes the lower number stays first.
  void sort(std::span<SortKey> keys) const {
    const BoundsOf<float> box = bounds_of_centres(keys);
    const double side = (box.upper.cast<double>() - box.lower.cast<double>()).maxCoeff();
    if (!(side > 0)) return;  // keys of equal code are in order of number already
    // Half a cell less than the cube holds, so that the farthest center lies in the last cell however the
    // product is rounded.
    const double cells_per_unit = ((1 << kBits) - 0.5) / side;
    for_chunks(keys.size(), kBatch, [&](std::size_t begin, std::size_t end) {
      compute_codes(keys.subspan(begin, end - begin), box.lower.cast<double>(), cells_per_unit);
    });
    // Both sorts give the same order, by code and then by number; for few keys the counts of a radix sort
    // would be most of its work.
    if (keys.size() < kKeysPerTask)
      std::sort(keys.begin(), keys.end());
    else
      radix_sort(keys);
    sort_crowded_cells(keys);
  }

 private:
  /// Center of the triangle's box. Its halves are added, for the sum of two finite floats may be infinite.
  Eigen::Vector3f centre(SortKey key) const {
    const Triangle& t = triangles_[static_cast<std::uint32_t>(key)];
    const Eigen::Vector3f &a = points_[t[0]], &b = points_[t[1]], &c = points_[t[2]];
    return 0.5f * a.cwiseMin(b).cwiseMin(c) + 0.5f * a.cwiseMax(b).cwiseMax(c);
  }

  BoundsOf<float> bounds_of_centres(std::span<const SortKey> keys) const {
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, keys.size(), kKeysPerTask), BoundsOf<float>(),
        [&](const tbb::blocked_range<std::size_t>& range, BoundsOf<float> box) {
          for (std::size_t i = range.begin(); i < range.end(); ++i) box.add(centre(keys[i]));
          return box;
        },
        [](BoundsOf<float> a, const BoundsOf<float>& b) {
          a.add(b);
          return a;
        });
  }

  void compute_codes(std::span<SortKey> keys, const Eigen::Vector3d& lower, double cells_per_unit) const {
    Cells cells{};
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const Eigen::Vector3d place = (centre(keys[i]).cast<double>() - lower) * cells_per_unit;
      for (int a = 0; a < 3; ++a)
        cells[a][i] = static_cast<std::uint32_t>(static_cast<std::int32_t>(place[a]));
    }
    to_hilbert(cells);
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const std::uint32_t code = spread(cells[0][i]) << 2 | spread(cells[1][i]) << 1 | spread(cells[2][i]);
      keys[i] = SortKey{code} << 32 | static_cast<std::uint32_t>(keys[i]);
    }
  }

  // The side of a cell is a thousandth of the cube's, so a few levels tell all centers apart that differ;
  // equal ones end in sort(), which finds a cube of no size. Tasks sort spans that do not overlap.
  void sort_crowded_cells(std::span<SortKey> keys) const {
    std::vector<std::span<SortKey>> crowded;
    for (std::size_t begin = 0, end; begin < keys.size(); begin = end) {
      for (end = begin + 1; end < keys.size() && (keys[end] ^ keys[begin]) >> 32 == 0;) ++end;
      if (end - begin > kCrowded) crowded.push_back(keys.subspan(begin, end - begin));
    }
    tbb::parallel_for(std::size_t{0}, crowded.size(), [&](std::size_t i) { sort(crowded[i]); });
  }

  std::span<const Eigen::Vector3f> points_;
  std::span<const Triangle> triangles_;
};

}  // namespace

std::vector<std::uint32_t> hilbert_order(std::span<const Eigen::Vector3f> points,
                                         std::span<const Triangle> triangles) {
  std::vector<SortKey> keys(triangles.size());
  for (std::size_t i = 0; i < keys.size(); ++i) keys[i] = i;
  CurveSorter(points, triangles).sort(keys);
  std::vector<std::uint32_t> order(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) order[i] = static_cast<std::uint32_t>(keys[i]);
  return order;
}

}  // namespace hermesh
