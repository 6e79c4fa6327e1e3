// Meshes for the tests of the public functions, and how the tests catch messages.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "hermesh/hermesh.h"

namespace hermesh_tests {

/// Returns the six faces of an axis-aligned box of these sides with its lowest corner there, as quads.
inline hermesh::Mesh box(std::array<double, 3> sides, std::array<double, 3> lower) {
  std::vector<double> points;
  for (int i = 0; i < 8; ++i)
    for (int axis = 0; axis < 3; ++axis) points.push_back(lower[axis] + sides[axis] * (i >> axis & 1));
  const std::vector<std::uint32_t> quads = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4,
                                            2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
  return hermesh::Mesh(std::span<const double>(points), {}, quads);
}

inline hermesh::Mesh cube(double side, std::array<double, 3> lower = {0, 0, 0}) {
  return box({side, side, side}, lower);
}

/// Returns a torus about the z axis, of triangles.
inline hermesh::Mesh torus(double large = 1.0, double small = 0.4, int around = 48, int across = 24) {
  std::vector<float> points;
  std::vector<std::uint32_t> triangles;
  const double turn = 2.0 * std::numbers::pi;
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      const double u = turn * i / around, v = turn * j / across, r = large + small * std::cos(v);
      for (const double x : {r * std::cos(u), r * std::sin(u), small * std::sin(v)})
        points.push_back(float(x));
      const auto at = [&](int a, int b) { return std::uint32_t((a % around) * across + b % across); };
      for (const std::uint32_t corner :
           {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1)})
        triangles.push_back(corner);
    }
  return hermesh::Mesh(std::span<const float>(points), triangles);
}

inline hermesh::VoxelizeOptions at_resolution(int resolution) { return {.resolution = resolution}; }

/// Returns the message of the Error that `work` throws; empty if it throws none.
template <class Work>
std::string complaint(Work work) {
  try {
    work();
  } catch (const hermesh::Error& error) {
    return error.what();
  }
  return {};
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace hermesh_tests
