#include "algorithms/extraction/dual_contouring/qef.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace hermesh {
namespace {

/// Share of the squared distance that decides between places of equal error: far above the rounding of
/// crossings in single precision, and 1e-5 voxel off the planes at most.
constexpr double kPreferNear = 1e-10;

}  // namespace

void Qef::add_plane(const Eigen::Vector3d& point, const Eigen::Vector3d& unit_normal) {
  const Eigen::Vector3d local = point - anchor_;
  const double distance = unit_normal.dot(local);
  ata_ += unit_normal * unit_normal.transpose();
  atb_ += distance * unit_normal;
  btb_ += distance * distance;
  sum_ += local;
  ++planes_;
}

double Qef::error(const Eigen::Vector3d& x) const {
  const Eigen::Vector3d local = x - anchor_;
  // Expanded, the sum of squares may come out below 0 by rounding.
  return std::max(0.0, local.dot(ata_ * local) - 2.0 * local.dot(atb_) + btb_);
}

/// Returns true if the planes are so nearly parallel, as in most cells, that two singular values are
/// certainly dropped. Then `axis` is the vector of the third one and `value` its square, found by a few
/// products: the components of the largest column along the others shrink by truncation² / 2 in each.
bool Qef::is_flat(double truncation, Eigen::Vector3d& axis, double& value) const {
  int largest = 0;
  ata_.diagonal().maxCoeff(&largest);
  axis = ata_.col(largest);
  for (int i = 0; i < 3; ++i) {
    const double size = axis.norm();
    if (!(size > 0)) return false;
    axis = ata_ * (axis / size);
  }
  axis.normalize();
  value = axis.dot(ata_ * axis);
  // The trace is the sum of the eigenvalues, and `value` at most the largest: the rest bounds the other two.
  return ata_.trace() - value < 0.5 * truncation * truncation * value;
}

bool Qef::planes_meet(const Eigen::Vector3d& free, const Eigen::Vector3d& held) const {
  const double least = error(free), there = error(held);
  return turned() >= kFeature && least <= kMeet * kMeet && there > kApart * kApart && there > 100.0 * least;
}

double Qef::turned() const {
  // Of a symmetric matrix the squared Frobenius norm is the sum of the squared eigenvalues, and the trace is
  // their sum.
  const double squared = ata_.trace() * ata_.trace();
  return 0.5 * (squared - ata_.squaredNorm()) / squared;
}

double Qef::share_of_minimiser(double smooth, double truncation) const {
  const double cut = truncation * truncation;
  const double here = turned();
  if (!(here < cut)) return 1.0;
  const double x = std::max(0.0, (here / cut - kSmoothBelow) / (1.0 - kSmoothBelow));
  return smooth + (1.0 - smooth) * x * x * (3.0 - 2.0 * x);
}

Eigen::Vector3d Qef::minimiser_near(const Eigen::Vector3d& start, double truncation) const {
  Eigen::Vector3d axis;
  double value;
  // A step along the one axis that is not dropped.
  if (is_flat(truncation, axis, value))
    return start + axis.dot(atb_ - ata_ * (start - anchor_)) / value * axis;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(ata_);
  const Eigen::Vector3d& values = solver.eigenvalues();  // squares of the singular values of A, ascending
  const Eigen::Vector3d residual = solver.eigenvectors().transpose() * (atb_ - ata_ * (start - anchor_));
  Eigen::Vector3d step = Eigen::Vector3d::Zero();
  for (int i = 0; i < 3; ++i)
    if (values[i] > truncation * truncation * values[2] && values[i] > 0)
      step += (residual[i] / values[i]) * solver.eigenvectors().col(i);
  return start + step;
}

Eigen::Vector3d Qef::line(double truncation) const {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(ata_);
  const Eigen::Vector3d& values = solver.eigenvalues();
  const double least = truncation * truncation * values[2];
  if (values[0] > least || !(values[1] > least)) return Eigen::Vector3d::Zero();
  return solver.eigenvectors().col(0);
}

bool Qef::has_corner(const Eigen::Vector3d& free, double truncation) const {
  if (turned() < kFeature || error(free) > kMeet * kMeet) return false;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(ata_, Eigen::EigenvaluesOnly);
  return solver.eigenvalues()[0] > truncation * truncation * solver.eigenvalues()[2];
}

Eigen::Vector3d Qef::minimiser_within(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper,
                                      double truncation) const {
  const Eigen::Vector3d free = minimiser(truncation);
  if ((free.array() >= lower.array()).all() && (free.array() <= upper.array()).all()) return free;

  // All choices of one to three coordinates held at a side of the box; the others are solved for.
  const Eigen::Vector3d low = lower - anchor_, high = upper - anchor_;
  // Free coordinates start at the mass point, moved into the box, which is the result if no choice is better.
  const Eigen::Vector3d mass = (sum_ / planes_).cwiseMax(low).cwiseMin(high);
  Eigen::Vector3d best = mass;
  // A line of minima leaves the box through two faces. The errors there differ only by rounding, so the face
  // nearer to the mass point is taken.
  const auto cost = [&](const Eigen::Vector3d& x) {
    return error(anchor_ + x) + kPreferNear * (x - mass).squaredNorm();
  };
  double best_cost = cost(mass);
  for (int choice = 1; choice < 27; ++choice) {
    const int held[3] = {choice % 3, choice / 3 % 3, choice / 9};  // 0 free, 1 at lower, 2 at upper
    Eigen::Vector3d x = mass;
    int axes[3], count = 0;
    for (int a = 0; a < 3; ++a) {
      if (held[a] == 0) axes[count++] = a;
      if (held[a] != 0) x[a] = held[a] == 1 ? low[a] : high[a];
    }
    if (count > 0) {
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 2, 2> reduced(count, count);
      Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 2, 1> residual(count);
      const Eigen::Vector3d slope = atb_ - ata_ * x;
      for (int i = 0; i < count; ++i) {
        residual[i] = slope[axes[i]];
        for (int j = 0; j < count; ++j) reduced(i, j) = ata_(axes[i], axes[j]);
      }
      const Eigen::SelfAdjointEigenSolver<decltype(reduced)> solver(reduced);
      const double largest = solver.eigenvalues()[count - 1];
      for (int k = 0; k < count; ++k) {
        if (!(solver.eigenvalues()[k] > truncation * truncation * largest) || !(solver.eigenvalues()[k] > 0))
          continue;
        const double along = solver.eigenvectors().col(k).dot(residual) / solver.eigenvalues()[k];
        for (int i = 0; i < count; ++i) x[axes[i]] += along * solver.eigenvectors()(i, k);
      }
    }
    // A minimum outside of the box is skipped: the box's own then lies on one more side, in another choice.
    if ((x.array() < low.array()).any() || (x.array() > high.array()).any()) continue;
    const double candidate = cost(x);
    if (candidate < best_cost) best = x, best_cost = candidate;
  }
  return anchor_ + best;
}

}  // namespace hermesh
