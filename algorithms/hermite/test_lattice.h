// For tests: Hermite data as plain arrays over a cube of samples, to build sparse data from and to compare
// them with.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <random>
#include <tuple>
#include <vector>

#include "algorithms/hermite/sparse_hermite.h"

namespace hermesh {

/// Signs and crossings of the samples from `lower` (a multiple of 8) to `lower + size - 1` along each axis;
/// all others have the sign `outermost`, as must those of the cube's own outermost layers.
template <class Crossing>
struct TestLattice {
  int lower = -8, size = 40;
  bool outermost = false;
  std::vector<char> signs = std::vector<char>(static_cast<std::size_t>(size) * size * size, outermost);
  std::map<std::tuple<int, int, int, int>, Crossing> crossings{};  ///< crossings by axis, x, y, z

  bool within(int x, int y, int z) const {
    return std::min({x, y, z}) >= lower && std::max({x, y, z}) < lower + size;
  }
  char& sign(int x, int y, int z) {
    return signs[static_cast<std::size_t>(((x - lower) * size + (y - lower)) * size + (z - lower))];
  }
  bool inside(int x, int y, int z) const {
    return within(x, y, z) ? const_cast<TestLattice*>(this)->sign(x, y, z) != 0 : outermost;
  }
  bool successor(int axis, int x, int y, int z) const {
    return inside(x + (axis == 0), y + (axis == 1), z + (axis == 2));
  }
  template <class F>
  void for_each_sample(F&& f) const {
    for (int x = lower; x < lower + size; ++x)
      for (int y = lower; y < lower + size; ++y)
        for (int z = lower; z < lower + size; ++z) f(x, y, z);
  }
  template <class F>  // f(axis, x, y, z) for every edge whose ends differ in sign
  void for_each_crossed_edge(F&& f) const {
    for_each_sample([&](int x, int y, int z) {
      for (int axis = 0; axis < 3; ++axis)
        if (inside(x, y, z) != successor(axis, x, y, z)) f(axis, x, y, z);
    });
  }
};

template <class Crossing>
SignLeaf leaf_of(const TestLattice<Crossing>& lattice, int x0, int y0, int z0) {
  SignLeaf leaf{{x0, y0, z0}, 0, {}, {}};
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      for (int z = 0; z < 8; ++z)
        leaf.inside[x] |= std::uint64_t{lattice.inside(x0 + x, y0 + y, z0 + z)} << (8 * y + z);
      leaf.beyond[0] |= std::uint64_t{lattice.inside(x0 + 8, y0 + x, z0 + y)} << (8 * x + y);
      leaf.beyond[1] |= std::uint64_t{lattice.inside(x0 + x, y0 + 8, z0 + y)} << (8 * x + y);
      leaf.beyond[2] |= std::uint64_t{lattice.inside(x0 + x, y0 + y, z0 + 8)} << (8 * x + y);
    }
  return leaf;
}

template <class Crossing>
SparseHermite<Crossing> to_sparse(const TestLattice<Crossing>& lattice,
                                  NormalCodeId code = NormalCodeId::octahedral) {
  SparseHermite<Crossing> result;
  result.outermost_inside = lattice.outermost;
  result.normal_code = code;
  const int end = lattice.lower + lattice.size;
  for (int x = lattice.lower; x < end; x += 8)
    for (int y = lattice.lower; y < end; y += 8)
      for (int z = lattice.lower; z < end; z += 8) {
        SignLeaf leaf = leaf_of(lattice, x, y, z);
        leaf.first = static_cast<std::uint32_t>(result.crossings.size());
        const std::array<BlockMask, 3> edges = crossing_edges(leaf);
        for (int axis = 0; axis < 3; ++axis)
          for_each_bit(edges[axis], [&](int sample) {
            result.crossings.push_back(
                lattice.crossings.at({axis, x + (sample >> 6), y + ((sample >> 3) & 7), z + (sample & 7)}));
          });
        if (result.crossings.size() > leaf.first) result.leaves.push_back(leaf);
      }
  return result;
}

/// Returns the lattice of sparse data: signs sample by sample and crossings edge by edge, as returned by the
/// look-up functions of the sparse data.
template <class Crossing>
TestLattice<Crossing> to_lattice(const SparseHermite<Crossing>& sparse, int lower, int size) {
  TestLattice<Crossing> result{lower, size, sparse.outermost_inside};
  result.for_each_sample([&](int x, int y, int z) {
    const std::array<std::int32_t, 3> at = {x & ~7, y & ~7, z & ~7};
    const SignLeaf* leaf = sparse.find(at);
    result.sign(x, y, z) =
        leaf ? test(leaf->inside, sample_index(x & 7, y & 7, z & 7)) : sparse.sign_without_leaf(at);
  });
  for (std::size_t i = 0; i < sparse.leaves.size(); ++i)
    for_each_crossing(sparse, i, [&](int axis, int sample, const Crossing& crossing) {
      const auto& at = sparse.leaves[i].lower;
      result.crossings[{axis, at[0] + (sample >> 6), at[1] + ((sample >> 3) & 7), at[2] + (sample & 7)}] =
          crossing;
    });
  return result;
}

/// A solid by its signed distance (or any function that is negative inside), sampled by bisection.
using Solid = std::function<double(double x, double y, double z)>;

inline EdgeCrossing bisect(const Solid& solid, int axis, std::array<double, 3> at) {
  const auto value = [&](double t, std::array<double, 3> p) { return p[axis] += t, solid(p[0], p[1], p[2]); };
  const bool first = value(0, at) < 0;
  double low = 0, high = 1;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    ((value(middle, at) < 0) == first ? low : high) = middle;
  }
  at[axis] += low;
  std::array<double, 3> gradient;
  for (int i = 0; i < 3; ++i) {
    std::array<double, 3> up = at, down = at;
    up[i] += 1e-4, down[i] -= 1e-4;
    gradient[i] = (solid(up[0], up[1], up[2]) - solid(down[0], down[1], down[2])) / 2e-4;
  }
  const double length = std::hypot(gradient[0], gradient[1], gradient[2]);
  EdgeCrossing crossing{static_cast<float>(low), {}};
  // Where two faces touch back to back there is no gradient.
  if (length < 0.5)
    crossing.normal[axis] = first ? 1.0f : -1.0f;
  else
    for (int i = 0; i < 3; ++i) crossing.normal[i] = static_cast<float>(gradient[i] / length);
  return crossing;
}

/// Returns a lattice of a solid, of which samples less than zero are inside.
inline TestLattice<EdgeCrossing> sample_solid(const Solid& solid, int lower = -8, int size = 40) {
  TestLattice<EdgeCrossing> lattice{lower, size};
  lattice.for_each_sample([&](int x, int y, int z) { lattice.sign(x, y, z) = solid(x, y, z) < 0; });
  lattice.for_each_crossed_edge([&](int axis, int x, int y, int z) {
    lattice.crossings[{axis, x, y, z}] = bisect(solid, axis, {double(x), double(y), double(z)});
  });
  return lattice;
}

inline Solid ball(double x0, double y0, double z0, double radius) {
  return [=](double x, double y, double z) { return std::hypot(x - x0, y - y0, z - z0) - radius; };
}
inline Solid box(double x0, double y0, double z0, double rx, double ry, double rz) {
  return [=](double x, double y, double z) {
    return std::max({std::abs(x - x0) - rx, std::abs(y - y0) - ry, std::abs(z - z0) - rz});
  };
}
inline Solid joined(const std::vector<Solid>& solids) {
  return [=](double x, double y, double z) {
    double least = 1e9;
    for (const Solid& solid : solids) least = std::min(least, solid(x, y, z));
    return least;
  };
}

/// Returns up to five balls and boxes, some of them with faces on lattice planes, within −4 … 27.
inline Solid random_blobs(std::mt19937& random) {
  std::uniform_real_distribution<double> centre(4, 20), radius(1, 7);
  std::vector<Solid> solids;
  for (int left = 1 + static_cast<int>(random() % 5); left > 0; --left) {
    double x = centre(random), y = centre(random), z = centre(random);
    double a = radius(random), b = radius(random), c = radius(random);
    if (random() % 2) {
      solids.push_back(ball(x, y, z, a));
      continue;
    }
    if (random() % 2)
      x = std::floor(x), y = std::floor(y), a = std::ceil(a), b = std::ceil(b), c = std::floor(c);
    solids.push_back(box(x, y, z, a, b, c));
  }
  return joined(solids);
}

template <class Element>
bool same_bytes(const LargeArray<Element>& a, const LargeArray<Element>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Element)) == 0);
}

/// Returns true if two data are equal member by member and byte by byte.
template <class Crossing>
testing::AssertionResult same(const SparseHermite<Crossing>& a, const SparseHermite<Crossing>& b) {
  if (a.outermost_inside != b.outermost_inside)
    return testing::AssertionFailure() << "infinity differs in sign";
  if (a.normal_code != b.normal_code) return testing::AssertionFailure() << "normals are in different codes";
  if (!same_bytes(a.leaves, b.leaves))
    return testing::AssertionFailure() << "leaves differ, " << a.leaves.size() << " and " << b.leaves.size();
  if (!same_bytes(a.crossings, b.crossings))
    return testing::AssertionFailure()
           << "crossings differ, " << a.crossings.size() << " and " << b.crossings.size();
  return testing::AssertionSuccess();
}

}  // namespace hermesh
