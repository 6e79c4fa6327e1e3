// Normals to try codes of normals on.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace hermesh {

/// Directions that are even over the sphere, in single precision; the same for the same seed.
inline std::vector<std::array<float, 3>> random_normals(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> coordinate;
  std::vector<std::array<float, 3>> normals(count);
  for (std::array<float, 3>& n : normals) {
    const double x = coordinate(generator), y = coordinate(generator), z = coordinate(generator);
    const double length = std::hypot(x, y, z);
    n = {float(x / length), float(y / length), float(z / length)};
  }
  return normals;
}

}  // namespace hermesh
