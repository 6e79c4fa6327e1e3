// Sums of quadratic error functions (Aldén 2011, §6.2), and the minimisers of many at a time.
#pragma once

#include <Eigen/Core>
#include <span>

namespace hermesh {

/// E(x) = Σ (nᵢ·(x − pᵢ))² as the sums of eq. 6.3, so that the function of a region is the sum of those of
/// its cells. All summands must share one frame, with its origin nearby: a block's middle, in voxels. (No
/// initialiser: a block has room for 512 and uses few. The sums are stored in pairs because the vector units
/// of every machine add two numbers at once; Eigen's types would go through memory.)
struct QefSum {
  using Pair = double __attribute__((vector_size(16)));
  /// The entries AᵀA (xx, xy, xz, yy, yz, zz), Aᵀb (x, y, z), bᵀb, Σp (x, y, z), number of planes.
  Pair pairs[7];

  /// Returns the function of one crossing: its point in the shared frame, its normal of unit length.
  static QefSum of_plane(const float (&point)[3], const float (&normal)[3]) {
    const double x = normal[0], y = normal[1], z = normal[2];
    const double d = x * point[0] + y * point[1] + z * point[2];
    const Pair xy{x, y};
    return {{xy * x, xy * Pair{z, y}, Pair{y, z} * z, xy * d, Pair{z, d} * d, Pair{point[0], point[1]},
             Pair{point[2], 1.0}}};
  }
  void clear() {
    for (Pair& pair : pairs) pair = Pair{0.0, 0.0};
  }
  QefSum& operator+=(const QefSum& other) {
    for (int i = 0; i < 7; ++i) pairs[i] += other.pairs[i];
    return *this;
  }

  /// Returns entry i of the fourteen, in the order of `pairs`.
  double value(int i) const { return pairs[i / 2][i % 2]; }
  double planes() const { return value(13); }
  /// Returns the mean of the crossings: the start of minimisers, and the `average` placement.
  Eigen::Vector3d mass_point() const {
    return Eigen::Vector3d(value(10), value(11), value(12)) * (1.0 / planes());
  }
  /// Returns E(x) in square voxels, never negative.
  double error(const Eigen::Vector3d& x) const;
};

/// Least share of the largest singular value that minimisers() distinguishes from zero, which replaces a
/// smaller `truncation`: the precision of sums of squares in double precision.
inline constexpr double kLeastTruncation = 1e-6;

/// Writes for each sum the minimiser nearest to its start by truncated singular value decomposition (§6.2.1):
/// singular values of A below `truncation` times the largest are set to zero. It may lie anywhere. `starts`
/// holds as many points as there are sums, or none for the mass points; they and `out`, which has room for as
/// many, are in the sums' frame. Below a truncation of 0.001 single precision would not suffice, and each sum
/// is solved by itself in double precision.
void minimisers(std::span<const QefSum* const> sums, std::span<const Eigen::Vector3d> starts,
                double truncation, Eigen::Vector3d* out);

}  // namespace hermesh
