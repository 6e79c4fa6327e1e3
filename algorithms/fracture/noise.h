// Smooth random fields, the same bits on every machine: whole-number hashes and polynomials, nothing else.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

namespace hermesh {

/// Returns the result of one step of splitmix64 (Steele, Lea & Flood 2014): every bit of the result depends
/// on every bit of the argument.
constexpr std::uint64_t hashed(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// A sequence of pseudorandom numbers: hashed() of consecutive integers.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(hashed(seed)) {}
  /// Returns the next 64 random bits.
  std::uint64_t bits() { return hashed(state_++); }
  /// Returns a random number, uniform in [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  /// Returns a random integer, uniform in 0 … n − 1 except for a bias of less than n / 2⁵³.
  std::uint64_t below(std::uint64_t n) {
    return static_cast<std::uint64_t>(uniform() * static_cast<double>(n));
  }
  /// Returns a random unit vector, uniform on the sphere, by rejection from the cube.
  Eigen::Vector3d direction() {
    for (;;) {
      Eigen::Vector3d v;
      for (int a = 0; a < 3; ++a) v[a] = 2.0 * uniform() - 1.0;
      const double squared = v.squaredNorm();
      if (squared > 0.01 && squared <= 1.0) return v / std::sqrt(squared);
    }
  }

 private:
  std::uint64_t state_;
};

/// A smooth random field of three components: random values between −1 and 1 at points with whole
/// coordinates, joined by quintic polynomials, hence twice continuously differentiable.
class VectorNoise {
 public:
  explicit VectorNoise(std::uint64_t seed) : octaves_{hashed(seed), hashed(seed + 1)} {}

  /// Returns the sum of two octaves, the finer one half as strong, scaled so that no component leaves [−1,
  /// 1].
  Eigen::Vector3d operator()(const Eigen::Vector3d& x) const {
    return (octave(x, octaves_[0]) + 0.5 * octave(2.0 * x + Eigen::Vector3d::Constant(0.5), octaves_[1])) /
           1.5;
  }

 private:
  static double fade(double t) { return t * t * t * (t * (6.0 * t - 15.0) + 10.0); }

  static Eigen::Vector3d value(std::uint64_t bits) {
    const auto component = [&](int shift) {
      return static_cast<double>((bits >> shift) & 0x1fffff) / 1048575.5 - 1.0;
    };
    return {component(0), component(21), component(42)};
  }

  /// Returns one octave at x. The corners of a cell share the hashes of their first coordinates.
  static Eigen::Vector3d octave(const Eigen::Vector3d& x, std::uint64_t start) {
    std::uint64_t cell[3];
    double t[3];
    for (int a = 0; a < 3; ++a) {
      const double floor = std::floor(x[a]);
      cell[a] = static_cast<std::uint64_t>(static_cast<std::int64_t>(floor));
      t[a] = fade(x[a] - floor);
    }
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::uint64_t i = 0; i < 2; ++i) {
      const std::uint64_t hx = hashed(start ^ (cell[0] + i));
      const double wx = i ? t[0] : 1.0 - t[0];
      for (std::uint64_t j = 0; j < 2; ++j) {
        const std::uint64_t hy = hashed(hx ^ (cell[1] + j));
        const double wy = wx * (j ? t[1] : 1.0 - t[1]);
        for (std::uint64_t k = 0; k < 2; ++k)
          sum += wy * (k ? t[2] : 1.0 - t[2]) * value(hashed(hy ^ (cell[2] + k)));
      }
    }
    return sum;
  }

  std::uint64_t octaves_[2];
};

}  // namespace hermesh
