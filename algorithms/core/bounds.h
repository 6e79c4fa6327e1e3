// Axis-aligned boxes.
#pragma once

#include <Eigen/Core>
#include <limits>

namespace hermesh {

/// An axis-aligned box from `lower` to `upper`, in the unit of its points. Its faces belong to it. Empty
/// until something is added.
template <class T>
struct BoundsOf {
  using Vector = Eigen::Matrix<T, 3, 1>;
  static constexpr T kFarthest = std::numeric_limits<T>::has_infinity ? std::numeric_limits<T>::infinity()
                                                                      : std::numeric_limits<T>::max();
  static constexpr T kLeast =
      std::numeric_limits<T>::has_infinity ? -kFarthest : std::numeric_limits<T>::lowest();

  Vector lower = Vector::Constant(kFarthest), upper = Vector::Constant(kLeast);

  /// Returns the box that contains every point.
  static BoundsOf unbounded() { return {Vector::Constant(kLeast), Vector::Constant(kFarthest)}; }

  void add(const Vector& point) {
    lower = lower.cwiseMin(point);
    upper = upper.cwiseMax(point);
  }
  void add(const BoundsOf& other) {
    lower = lower.cwiseMin(other.lower);
    upper = upper.cwiseMax(other.upper);
  }
  bool empty() const { return (lower.array() > upper.array()).any(); }
  /// Returns true if the two have a point in common. An empty box has none.
  bool overlaps(const BoundsOf& other) const {
    // Without branches: this is the inner loop of many searches.
    bool apart = false;
    for (int a = 0; a < 3; ++a) apart |= lower[a] > other.upper[a] || other.lower[a] > upper[a];
    return !apart;
  }
  /// Returns the lengths of the sides; zero if the box is empty.
  Vector size() const { return empty() ? Vector(Vector::Zero()) : Vector(upper - lower); }
};

using Bounds = BoundsOf<double>;

}  // namespace hermesh
