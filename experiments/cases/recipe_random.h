// Random numbers and noise of the recipes: the same bits on every machine.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace hermesh::recipes {

/// Random numbers by splitmix64 (Steele, Lea & Flood, Fast Splittable Pseudorandom Number Generators, 2014).
class Random {
 public:
  explicit Random(double seed) : state_(static_cast<std::uint64_t>(seed)) {}
  std::uint64_t bits() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  /// The next number, from 0 to below 1.
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

 private:
  std::uint64_t state_;
};

/// Gradient noise (Perlin, Improving Noise, SIGGRAPH 2002) with a hash in place of the permutation table.
class GradientNoise {
 public:
  explicit GradientNoise(std::uint64_t seed) : seed_(seed * 0x9e3779b97f4a7c15u) {}
  /// The noise at a point: between about −1 and 1, and 0 where all coordinates are whole numbers.
  double operator()(const Eigen::Vector3d& point) const;

 private:
  double gradient(const Eigen::Vector3d& lattice_point, const Eigen::Vector3d& offset) const;
  std::uint64_t seed_;
};

}  // namespace hermesh::recipes
