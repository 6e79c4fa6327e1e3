#include "algorithms/thesis/adaptive_dual_contouring/qef_sum.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "algorithms/thesis/adaptive_dual_contouring/qef_kernels.h"

namespace hermesh {

using qef_kernels::EigenLanes, qef_kernels::kLanes, qef_kernels::Lanes;

namespace {

/// Writes a sum's matrix AᵀA, whose upper triangle `value` returns row by row, into one lane. `off[i]` is the
/// entry outside row and column i.
void load(EigenLanes& m, int lane, const QefSum& sum) {
  constexpr int kDiagonal[3] = {0, 3, 5}, kOff[3] = {4, 2, 1};
  for (int i = 0; i < 3; ++i) {
    m.diagonal[i][lane] = static_cast<float>(sum.value(kDiagonal[i]));
    m.off[i][lane] = static_cast<float>(sum.value(kOff[i]));
  }
}

/// Returns the vector Aᵀ(b − A x): half of the negative gradient of E at x.
Eigen::Vector3d slope(const QefSum& sum, const Eigen::Vector3d& x) {
  const auto v = [&](int i) { return sum.value(i); };
  return {v(6) - (v(0) * x[0] + v(1) * x[1] + v(2) * x[2]), v(7) - (v(1) * x[0] + v(3) * x[1] + v(4) * x[2]),
          v(8) - (v(2) * x[0] + v(4) * x[1] + v(5) * x[2])};
}

/// Least truncation of the kernels, which compare squares of the shares in single precision.
constexpr double kLeastInSingle = 0.001;

/// Returns the minimiser nearest to `start`, by a solver of double precision.
Eigen::Vector3d minimiser_in_double(const QefSum& sum, const Eigen::Vector3d& start, double truncation) {
  const auto v = [&](int i) { return sum.value(i); };
  Eigen::Matrix3d ata;
  ata << v(0), v(1), v(2), v(1), v(3), v(4), v(2), v(4), v(5);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(ata);
  const Eigen::Vector3d fall = slope(sum, start);
  Eigen::Vector3d place = start;
  for (int k = 0; k < 3; ++k) {
    // Eigenvalues ascend and are the squares of singular values.
    const double value = solver.eigenvalues()[k];
    if (!(value > truncation * truncation * solver.eigenvalues()[2])) continue;
    const Eigen::Vector3d axis = solver.eigenvectors().col(k);
    place += axis.dot(fall) / value * axis;
  }
  return place;
}

}  // namespace

double QefSum::error(const Eigen::Vector3d& x) const {
  // xᵀAᵀAx − 2xᵀAᵀb + bᵀb = bᵀb − x·(Aᵀb) − x·Aᵀ(b − Ax)
  const Eigen::Vector3d atb(value(6), value(7), value(8));
  return std::max(0.0, value(9) - x.dot(atb) - x.dot(slope(*this, x)));
}

void minimisers(std::span<const QefSum* const> sums, std::span<const Eigen::Vector3d> starts,
                double truncation, Eigen::Vector3d* out) {
  const auto start = [&](std::size_t i) { return starts.empty() ? sums[i]->mass_point() : starts[i]; };
  if (truncation < kLeastInSingle) {
    for (std::size_t i = 0; i < sums.size(); ++i)
      out[i] = minimiser_in_double(*sums[i], start(i), std::max(truncation, kLeastTruncation));
    return;
  }
  const auto& kernels = chosen_kernels<qef_kernels::Kernels>();
  EigenLanes m;
  alignas(64) Lanes slopes[3], step[3];
  for (std::size_t first = 0; first < sums.size(); first += kLanes) {
    const int n = static_cast<int>(std::min<std::size_t>(kLanes, sums.size() - first));
    for (int i = 0; i < kLanes; ++i) {
      // Lanes without a sum repeat the last one.
      const std::size_t at = first + static_cast<std::size_t>(std::min(i, n - 1));
      load(m, i, *sums[at]);
      // From the start, in double precision, so that only the step is a single one, and a direction without a
      // singular value is unchanged: the pseudo-inverse of §6.2.1 about the start as origin.
      const Eigen::Vector3d fall = slope(*sums[at], start(at));
      for (int a = 0; a < 3; ++a) slopes[a][i] = static_cast<float>(fall[a]);
    }
    kernels.solve(m, static_cast<float>(truncation), slopes, step);
    for (int i = 0; i < n; ++i) {
      const std::size_t at = first + static_cast<std::size_t>(i);
      out[at] = start(at) + Eigen::Vector3d(step[0][i], step[1][i], step[2][i]);
    }
  }
}

}  // namespace hermesh
