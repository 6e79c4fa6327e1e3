#include "algorithms/thesis/adaptive_dual_contouring/qef_sum.h"

#include <algorithm>
#include <cmath>

namespace hermesh {
namespace {

/// Sums that are solved at a time: as many as keep the vector units busy. A lane's result does not depend on the
/// others.
constexpr int kLanes = 16;
using Lanes = float[kLanes];

/// Symmetric 3×3 matrices with their eigenvectors, one a lane. Normals of unit length make entries of single precision
/// good enough: what is truncated is a thousand times as large as their error.
struct EigenLanes {
  alignas(64) Lanes diagonal[3], off[3];  ///< off[i] is the entry of the two axes other than i
  alignas(64) Lanes vectors[3][3];        ///< by eigenvalue, by coordinate
};

/// Jacobi's rotation in the plane of the axes p and q, which makes their common entry 0; r is the third axis.
[[gnu::always_inline]] inline void rotate(EigenLanes& m, int p, int q, int r) {
  constexpr float kTiny = 1e-30f;
  for (int i = 0; i < kLanes; ++i) {
    const float d = m.diagonal[q][i] - m.diagonal[p][i], e = 2.0f * m.off[r][i];
    // The tangent of the smaller of the two angles that do it; with kTiny a matrix that is 0 stays as it is.
    const float t = std::copysign(1.0f, d) * e / (std::fabs(d) + std::sqrt(d * d + e * e) + kTiny);
    const float c = 1.0f / std::sqrt(1.0f + t * t), s = t * c;
    m.diagonal[p][i] -= t * m.off[r][i];
    m.diagonal[q][i] += t * m.off[r][i];
    m.off[r][i] = 0.0f;
    const float rp = m.off[q][i], rq = m.off[p][i];
    m.off[q][i] = c * rp - s * rq;
    m.off[p][i] = s * rp + c * rq;
    for (int a = 0; a < 3; ++a) {
      const float vp = m.vectors[p][a][i], vq = m.vectors[q][a][i];
      m.vectors[p][a][i] = c * vp - s * vq;
      m.vectors[q][a][i] = s * vp + c * vq;
    }
  }
}

/// Eigenvalues of AᵀA, which are the squares of A's singular values, and their eigenvectors: for a symmetric matrix
/// of three rows this takes the place of the singular value decomposition of A (eq. 6.4).
[[gnu::always_inline]] inline void decompose(EigenLanes& m) {
  for (int k = 0; k < 3; ++k)
    for (int a = 0; a < 3; ++a) std::fill_n(m.vectors[k][a], kLanes, k == a ? 1.0f : 0.0f);
  constexpr int kSweeps = 3;  // a test holds what they leave against a solver in double precision
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    rotate(m, 0, 1, 2);
    rotate(m, 0, 2, 1);
    rotate(m, 1, 2, 0);
  }
}

/// Puts AᵀA of one sum into its lane.
void load(EigenLanes& m, int lane, const QefSum& sum) {
  constexpr int kDiagonal[3] = {0, 3, 5}, kOff[3] = {4, 2, 1};
  for (int i = 0; i < 3; ++i) {
    m.diagonal[i][lane] = static_cast<float>(sum.value(kDiagonal[i]));
    m.off[i][lane] = static_cast<float>(sum.value(kOff[i]));
  }
}

/// The vector Aᵀ(b − A x): half of how steeply E falls at x.
Eigen::Vector3d slope(const QefSum& sum, const Eigen::Vector3d& x) {
  const auto v = [&](int i) { return sum.value(i); };
  return {v(6) - (v(0) * x[0] + v(1) * x[1] + v(2) * x[2]), v(7) - (v(1) * x[0] + v(3) * x[1] + v(4) * x[2]),
          v(8) - (v(2) * x[0] + v(4) * x[1] + v(5) * x[2])};
}

/// The steps from the mass points, by the singular values that are kept. Compiled for wider vectors, too, and chosen
/// when the program starts; every lane's operations are the same, and so are its bytes.
[[gnu::target_clones("avx512f", "avx2", "default")]] void solve(EigenLanes& m, float truncation, const Lanes (&slopes)[3],
                                                     Lanes (&step)[3]) {
  decompose(m);
  // Squares of singular values are compared, so the share is squared, too.
  const float share = truncation * truncation;
  for (int i = 0; i < kLanes; ++i) {
    const float largest = std::max(m.diagonal[0][i], std::max(m.diagonal[1][i], m.diagonal[2][i]));
    step[0][i] = step[1][i] = step[2][i] = 0.0f;
    for (int k = 0; k < 3; ++k) {
      const float value = m.diagonal[k][i];
      const auto& v = m.vectors[k];
      const float along = v[0][i] * slopes[0][i] + v[1][i] * slopes[1][i] + v[2][i] * slopes[2][i];
      const float scale = value > share * largest ? along / value : 0.0f;  // false if all are 0
      for (int a = 0; a < 3; ++a) step[a][i] += scale * v[a][i];
    }
  }
}

}  // namespace

double QefSum::error(const Eigen::Vector3d& x) const {
  // xᵀAᵀAx − 2xᵀAᵀb + bᵀb = bᵀb − x·(Aᵀb) − x·Aᵀ(b − Ax)
  const Eigen::Vector3d atb(value(6), value(7), value(8));
  return std::max(0.0, value(9) - x.dot(atb) - x.dot(slope(*this, x)));
}

void minimisers(std::span<const QefSum* const> sums, double truncation, Eigen::Vector3d* out) {
  EigenLanes m;
  alignas(64) Lanes slopes[3], step[3];
  for (std::size_t first = 0; first < sums.size(); first += kLanes) {
    const int n = static_cast<int>(std::min<std::size_t>(kLanes, sums.size() - first));
    for (int i = 0; i < kLanes; ++i) {
      // Lanes without a sum repeat the last one.
      const QefSum& sum = *sums[first + static_cast<std::size_t>(std::min(i, n - 1))];
      load(m, i, sum);
      // From the mass point, in double precision, so that only the step is a single one, and a direction without a
      // singular value stays at the mass point: the pseudo-inverse of §6.2.1 about another origin.
      const Eigen::Vector3d fall = slope(sum, sum.mass_point());
      for (int a = 0; a < 3; ++a) slopes[a][i] = static_cast<float>(fall[a]);
    }
    solve(m, static_cast<float>(truncation), slopes, step);
    for (int i = 0; i < n; ++i)
      out[first + i] = sums[first + i]->mass_point() + Eigen::Vector3d(step[0][i], step[1][i], step[2][i]);
  }
}

}  // namespace hermesh
