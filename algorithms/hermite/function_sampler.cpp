#include <boost/math/tools/roots.hpp>
#include <cmath>
#include <vector>

#include "algorithms/core/parallel.h"
#include "algorithms/hermite/samplers.h"

namespace hermesh {
namespace {

using Lower = std::array<std::int32_t, 3>;

/// A leaf that may own crossings, and its crossings.
struct Candidate {
  SignLeaf leaf{};
  std::vector<EdgeCrossing> crossings;
};

class FunctionSampler {
 public:
  FunctionSampler(const AnalyticSurface& surface, const IndexToWorld& placement, const Lower& lower,
                  const Lower& upper, double tolerance)
      : surface_(surface), placement_(placement), lower_(lower), upper_(upper), tolerance_(tolerance) {
    // The farthest sample of a leaf's edges lies 4 voxels from its center along each axis, 4.5 with a margin.
    // If the value at the center is larger than this distance times the slope, none of these samples can have
    // the other sign.
    reach_ = surface.lipschitz * 4.5 * placement.linear.colwise().norm().sum();
  }

  bool may_cross(const Lower& leaf) const {
    const Eigen::Vector3d centre = world(leaf, Eigen::Vector3d::Constant(4.0));
    // Negated, so that a leaf with NaN is sampled, where it is reported.
    return !(std::abs(surface_.value(centre)) > reach_);
  }

  void sample(Candidate& candidate) const {
    SignLeaf& leaf = candidate.leaf;
    for (int x = 0; x < 9; ++x)
      for (int y = 0; y < 9; ++y)
        for (int z = 0; z < 9; ++z) {
          // Samples beyond the leaf only of the three adjacent layers, without the edges where layers meet:
          // no edge of the leaf ends there.
          const int beyond = (x == 8) + (y == 8) + (z == 8);
          if (beyond > 1 || !is_inside({leaf.lower[0] + x, leaf.lower[1] + y, leaf.lower[2] + z})) continue;
          if (x == 8)
            leaf.beyond[0] |= std::uint64_t{1} << (8 * y + z);
          else if (y == 8)
            leaf.beyond[1] |= std::uint64_t{1} << (8 * x + z);
          else if (z == 8)
            leaf.beyond[2] |= std::uint64_t{1} << (8 * x + y);
          else
            leaf.inside[x] |= std::uint64_t{1} << (8 * y + z);
        }
    const std::array<BlockMask, 3> edges = crossing_edges(leaf);
    for (int axis = 0; axis < 3; ++axis)
      for_each_bit(edges[axis], [&](int i) { candidate.crossings.push_back(crossing(leaf, i, axis)); });
  }

 private:
  Eigen::Vector3d world(const Lower& index, const Eigen::Vector3d& step) const {
    // Differences of integers first, which are exact, so that a far lattice costs no precision.
    Eigen::Vector3d local = step;
    for (int a = 0; a < 3; ++a) local[a] += double(index[a]) - double(placement_.base[a]);
    return placement_.local(local) + placement_.origin;
  }

  bool is_inside(const Lower& index) const {
    bool border = false;
    for (int a = 0; a < 3; ++a) {
      if (index[a] < lower_[a] || index[a] > upper_[a]) return false;
      border = border || index[a] == lower_[a] || index[a] == upper_[a];
    }
    const double value = surface_.value(world(index, Eigen::Vector3d::Zero()));
    if (std::isnan(value))
      throw Error("the function has no value at a sample; leave such places out of the box");
    if (value < 0 && border)
      throw Error("the function is negative on the border of the box; make the box larger");
    return value < 0;
  }

  EdgeCrossing crossing(const SignLeaf& leaf, int i, int axis) const {
    const Lower start{leaf.lower[0] + (i >> 6), leaf.lower[1] + ((i >> 3) & 7), leaf.lower[2] + (i & 7)};
    const auto at = [&](double offset) { return world(start, offset * Eigen::Vector3d::Unit(axis)); };
    const auto value = [&](double offset) { return surface_.value(at(offset)); };
    // TOMS 748 (Alefeld, Potra & Shi 1995) brackets the root: the ends of the edge have different signs, so
    // it converges for any function. 200 steps are more than bisection alone would need.
    std::uintmax_t steps = 200;
    const auto close = [&](double a, double b) { return b - a <= tolerance_; };
    const auto [a, b] = boost::math::tools::toms748_solve(value, 0.0, 1.0, close, steps);
    const double offset = 0.5 * (a + b);
    // In index space: the transposed map converts covectors of the world to those of the grid.
    Eigen::Vector3d normal = placement_.linear.transpose() * surface_.gradient(at(offset));
    if (!(normal.norm() > 0)) normal = (test(leaf.inside, i) ? 1.0 : -1.0) * Eigen::Vector3d::Unit(axis);
    normal.normalize();
    return {static_cast<float>(offset),
            {static_cast<float>(normal[0]), static_cast<float>(normal[1]), static_cast<float>(normal[2])}};
  }

  const AnalyticSurface& surface_;
  const IndexToWorld& placement_;
  const Lower lower_, upper_;
  const double tolerance_;
  double reach_ = 0.0;
};

/// @throws Error if a leaf is missing that owns a crossing edge: a skipped block whose function is steeper
/// than its bound.
void check_complete(const FloatHermite& hermite) {
  for (const SignLeaf& leaf : hermite.leaves)
    for (int axis = 0; axis < 3; ++axis)
      for (const int way : {-1, 1}) {
        Lower next = leaf.lower;
        next[axis] += 8 * way;
        if (hermite.find(next)) continue;
        const std::uint64_t seen = way < 0 ? first_layer(leaf.inside, axis) : leaf.beyond[axis];
        if (seen != (hermite.sign_without_leaf(next) ? ~std::uint64_t{0} : 0))
          throw Error(
              "the function changes its sign in a block that it seems far from: it is steeper than the bound "
              "of its slope says");
      }
}

}  // namespace

FloatHermite sample_function(const AnalyticSurface& surface, const IndexToWorld& placement,
                             const Lower& lower, const Lower& upper, double tolerance, RunContext& context) {
  Stage stage(context, "Hermite data from a function");
  if (!(tolerance > 0) || !(surface.lipschitz > 0))
    throw Error("the tolerance and the slope's bound must be positive");
  // Blocks that the box touches, and those that own an edge into it.
  Lower first{}, leaves{};
  for (int a = 0; a < 3; ++a) {
    if (lower[a] > upper[a]) throw Error("the box to be sampled is empty");
    first[a] =
        (lower[a] - 1) & ~7;  // the edge that leads to the box's first sample starts one step before it
    leaves[a] = (((upper[a] & ~7) - first[a]) >> 3) + 1;
  }
  const FunctionSampler sampler(surface, placement, lower, upper, tolerance);
  // A task is a layer of leaves of one x. Candidates ascend within a layer, and layers are joined in order.
  std::vector<std::vector<Candidate>> layers(static_cast<std::size_t>(leaves[0]));
  parallel_blocks(layers.size(), context, [&](std::size_t x) {
    for (std::int32_t y = 0; y < leaves[1]; ++y)
      for (std::int32_t z = 0; z < leaves[2]; ++z) {
        const Lower leaf{first[0] + 8 * static_cast<std::int32_t>(x), first[1] + 8 * y, first[2] + 8 * z};
        if (!sampler.may_cross(leaf)) continue;
        context.check();
        Candidate candidate;
        candidate.leaf.lower = leaf;
        sampler.sample(candidate);
        if (!candidate.crossings.empty()) layers[x].push_back(std::move(candidate));
      }
  });
  FloatHermite result;
  result.placement = placement;
  std::vector<std::uint64_t> counts;
  for (const auto& layer : layers)
    for (const Candidate& candidate : layer) counts.push_back(candidate.crossings.size());
  result.crossings.reserve(exclusive_scan(counts, "edge crossings"));
  for (auto& layer : layers)
    for (Candidate& candidate : layer) {
      candidate.leaf.first = static_cast<std::uint32_t>(result.crossings.size());
      result.leaves.push_back(candidate.leaf);
      result.crossings.insert(result.crossings.end(), candidate.crossings.begin(), candidate.crossings.end());
    }
  check_complete(result);
  return result;
}

}  // namespace hermesh
