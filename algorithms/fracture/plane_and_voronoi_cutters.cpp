#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <boost/math/tools/roots.hpp>
#include <cmath>
#include <limits>

#include "algorithms/core/error.h"
#include "algorithms/fracture/cutters.h"
#include "algorithms/fracture/growing_tree.h"
#include "algorithms/fracture/noise.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;
using At = Cutters::At;

/// World positions of samples.
class Places {
 public:
  explicit Places(const IndexToWorld& placement) : placement_(placement) {}

  Vector3d operator()(const At& at, const Vector3d& step = Vector3d::Zero()) const {
    // Differences from the base are small and exact, wherever in the world the lattice lies.
    Vector3d index = step;
    for (int a = 0; a < 3; ++a) index[a] += double(at[a]) - double(placement_.base[a]);
    return placement_.local(index) + placement_.origin;
  }
  static At sample(const At& lower, int i) {
    return {lower[0] + (i >> 6), lower[1] + ((i >> 3) & 7), lower[2] + (i & 7)};
  }

  /// A bound, in world units, of the distance from a block's middle to its samples: the middle is 3.5 voxels
  /// away from them along each axis, and the triangle inequality holds for any affine map.
  double block_radius() const { return 3.5 * placement_.linear.colwise().norm().sum(); }
  double edge_length(int axis) const { return placement_.linear.col(axis).norm(); }

  /// A crossing at `offset` of an edge; the normal need not be of unit length, and if it vanishes it is
  /// replaced by the edge's direction.
  EdgeCrossing crossing(double offset, const Vector3d& world_normal, int axis) const {
    // The transposed map turns covectors of the world into those of the grid.
    Vector3d n = placement_.linear.transpose() * world_normal;
    n = n.norm() > 0 ? Vector3d(n.normalized()) : Vector3d(Vector3d::Unit(axis));
    return {static_cast<float>(offset),
            {static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])}};
  }

 private:
  IndexToWorld placement_;
};

/// The parts of space between planes: bit k of a code is set where a sample lies on plane k or on the side
/// that the plane's normal points to.
class PlaneCutters : public Cutters {
 public:
  PlaneCutters(std::vector<CuttingPlane> planes, const IndexToWorld& placement)
      : places_(placement), planes_(std::move(planes)) {
    if (planes_.size() > 64)
      throw Error("there are " + std::to_string(planes_.size()) +
                  " cutting planes; at most 64 can be used at once");
    for (CuttingPlane& plane : planes_) {
      const double length = plane.normal.norm();
      if (!(length > 0) || !std::isfinite(length) || !std::isfinite(plane.distance))
        throw Error("a cutting plane has a normal of no length or a number that is not finite");
      // With a unit normal value() is a distance in world units, to be compared with block_radius().
      plane.normal /= length;
      plane.distance /= length;
    }
  }

  void codes(const At& lower, std::span<CutCode, 512> codes) const override {
    std::fill(codes.begin(), codes.end(), 0);
    const Vector3d middle = places_(lower, Vector3d::Constant(3.5));
    for (std::size_t k = 0; k < planes_.size(); ++k) {
      const CutCode bit = CutCode{1} << k;
      // A plane that passes the block by has all 512 samples on one side. The bound is exceeded by far more
      // than rounding may do.
      if (const double off = value(k, middle); std::abs(off) > places_.block_radius() * 1.001) {
        if (off > 0)
          for (CutCode& code : codes) code |= bit;
        continue;
      }
      for (int i = 0; i < 512; ++i)
        if (value(k, places_(Places::sample(lower, i))) >= 0) codes[static_cast<std::size_t>(i)] |= bit;
    }
  }

  std::optional<CutCrossing> crossing(const At& at, int axis, CutCode first, CutCode second) const override {
    // Planes whose side differs, the lowest first. Sides are determined as in codes(), so between the
    // samples' own codes the first plane crosses the edge; for codes of other samples there may be no such
    // plane.
    for (CutCode left = first ^ second; left != 0; left &= left - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(left));
      const double a = value(k, places_(at)), b = value(k, places_(at, Vector3d::Unit(axis)));
      if ((a >= 0) == (b >= 0)) continue;
      // The distance is linear along the edge; a and b have different signs, so the offset lies from 0 to 1.
      return CutCrossing{places_.crossing(a / (a - b), planes_[k].normal, axis),
                         static_cast<std::int32_t>(k)};
    }
    return std::nullopt;
  }

  std::optional<CutCrossing> nearest(const At& at, int axis, CutCode first, CutCode second) const override {
    std::optional<CutCrossing> best;
    double least = std::numeric_limits<double>::infinity();
    for (CutCode left = first ^ second; left != 0; left &= left - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(left));
      for (const double end : {0.0, 1.0})
        if (const double off = std::abs(value(k, places_(at, end * Vector3d::Unit(axis)))); off < least) {
          least = off;
          best = CutCrossing{places_.crossing(end, planes_[k].normal, axis), static_cast<std::int32_t>(k)};
        }
    }
    return best;
  }

  bool plane_sides() const override { return true; }
  std::size_t count() const override { return planes_.size(); }
  std::string name(std::size_t cutter) const override { return "plane " + std::to_string(cutter); }
  std::string name_of(CutCode code) const override {
    std::string sides;
    for (std::size_t k = 0; k < planes_.size(); ++k) sides += (code >> k) & 1 ? '+' : '-';
    return "sides " + sides;
  }
  std::optional<Vector3d> plane_between(CutCode first, CutCode second) const override {
    // Parts that differ in the sides of several planes meet in no one plane.
    if (std::popcount(first ^ second) != 1) return std::nullopt;
    return planes_[static_cast<std::size_t>(std::countr_zero(first ^ second))].normal;
  }

 private:
  double value(std::size_t k, const Vector3d& x) const {
    return planes_[k].normal.dot(x) - planes_[k].distance;
  }

  Places places_;
  std::vector<CuttingPlane> planes_;
};

/// The cells of a Voronoi diagram: a code is the number of the seed nearest to the displaced sample.
class VoronoiCutters : public Cutters {
 public:
  VoronoiCutters(std::vector<Vector3d> seeds, const Displacement& displacement, const IndexToWorld& placement)
      : places_(placement), seeds_(std::move(seeds)), displacement_(displacement), noise_(displacement.seed) {
    if (seeds_.empty()) throw Error("there are no seeds to make cells of");
    for (const Vector3d& seed : seeds_) tree_.add(seed);
  }

  void codes(const At& lower, std::span<CutCode, 512> codes) const override {
    const std::vector<std::uint32_t> near = candidates(lower);
    if (near.size() == 1) return std::fill(codes.begin(), codes.end(), near.front());
    // Candidates ascend and only a smaller distance replaces one, so of equal distances the lower seed wins.
    for (int i = 0; i < 512; ++i) {
      const Vector3d x = displaced(places_(Places::sample(lower, i)));
      std::uint32_t best = near.front();
      double least = (x - seeds_[best]).squaredNorm();
      for (const std::uint32_t seed : near)
        if (const double squared = (x - seeds_[seed]).squaredNorm(); squared < least)
          least = squared, best = seed;
      codes[static_cast<std::size_t>(i)] = best;
    }
  }

  bool may_hold(const At& lower, CutCode code) const override {
    const Vector3d middle = places_(lower, Vector3d::Constant(3.5));
    return code < seeds_.size() && (seeds_[code] - middle).squaredNorm() <= squared_reach(middle);
  }

  std::optional<CutCrossing> crossing(const At& at, int axis, CutCode first, CutCode second) const override {
    const Vector3d across = seeds_[second] - seeds_[first];
    const auto value = [&](double t) { return beyond(places_(at, t * Vector3d::Unit(axis)), first, second); };
    // The wall lies between the two if the first seed is nearer at the first end and the second at the other.
    // A third seed may be nearer than both in between; the wall of these two is taken all the same.
    const double a = value(0.0), b = value(1.0);
    if (!(a <= 0 && b >= 0 && b > a)) return std::nullopt;
    const auto cutter = static_cast<std::int32_t>(std::min(first, second));
    // Without displacement the difference of squared distances is linear along the edge.
    if (displacement_.amplitude == 0) return CutCrossing{places_.crossing(a / (a - b), across, axis), cutter};
    // Displaced, it is not; a bracketing method (TOMS 748: Alefeld, Potra & Shi 1995) needs no derivative and
    // ends with an interval of kCrossingError or less that still has a change of sign in it. 200 steps are
    // far more than it takes; they only bound the loop.
    std::uintmax_t steps = 200;
    const auto close = [](double low, double high) { return high - low <= kCrossingError; };
    const auto [low, high] = boost::math::tools::toms748_solve(value, 0.0, 1.0, a, b, close, steps);
    const double offset = 0.5 * (low + high);
    return CutCrossing{
        places_.crossing(offset, gradient(places_(at, offset * Vector3d::Unit(axis)), across), axis), cutter};
  }

  std::optional<CutCrossing> nearest(const At& at, int axis, CutCode first, CutCode second) const override {
    if (first == second) return std::nullopt;
    const Vector3d start = places_(at), next = places_(at, Vector3d::Unit(axis));
    // Half the difference of the squared distances to the two seeds is the measure of nearness to the wall.
    const bool first_end = std::abs(beyond(start, first, second)) <= std::abs(beyond(next, first, second));
    const Vector3d normal = gradient(first_end ? start : next, seeds_[second] - seeds_[first]);
    return CutCrossing{places_.crossing(first_end ? 0.0 : 1.0, normal, axis),
                       static_cast<std::int32_t>(std::min(first, second))};
  }

  std::size_t count() const override { return seeds_.size(); }
  std::string name(std::size_t cutter) const override { return "cell " + std::to_string(cutter); }
  std::string name_of(CutCode code) const override { return name(code); }
  std::optional<Vector3d> plane_between(CutCode first, CutCode second) const override {
    if (first == second) return std::nullopt;
    // From the lower seed to the higher, so that the normal does not depend on the order of the two.
    const auto [low, high] = std::minmax(first, second);
    return (seeds_[high] - seeds_[low]).normalized();
  }

 private:
  /// A world position moved by the noise, at most the amplitude along each axis.
  Vector3d displaced(const Vector3d& x) const {
    if (displacement_.amplitude == 0) return x;
    return x + displacement_.amplitude * noise_(x / displacement_.wavelength);
  }

  /// Half the squared distance to the first seed less that to the second, of the displaced position: negative
  /// where the first is nearer, positive where the second is.
  double beyond(const Vector3d& x, CutCode first, CutCode second) const {
    return (seeds_[second] - seeds_[first]).dot(displaced(x) - 0.5 * (seeds_[second] + seeds_[first]));
  }

  /// The gradient of across · displaced(x) by x, which is normal to the wall there; by central differences,
  /// for the field is smooth and an error of a millionth harms no normal.
  Vector3d gradient(const Vector3d& x, const Vector3d& across) const {
    if (displacement_.amplitude == 0) return across;
    const double step = 1e-4 * displacement_.wavelength;
    Vector3d result;
    for (int a = 0; a < 3; ++a) {
      const Vector3d d = step * Vector3d::Unit(a);
      result[a] = across.dot(displaced(x + d) - displaced(x - d)) / (2.0 * step);
    }
    return result;
  }

  /// Seeds that may be nearest to a sample of the block, ascending.
  std::vector<std::uint32_t> candidates(const At& lower) const {
    const Vector3d middle = places_(lower, Vector3d::Constant(3.5));
    const double reach = squared_reach(middle);
    std::vector<std::uint32_t> near;
    tree_.for_each_within(middle, reach, [&](std::uint32_t seed) { near.push_back(seed); });
    std::sort(near.begin(), near.end());
    return near;
  }

  /// The square of the distance from a block's middle beyond which no seed is nearest to a sample of the
  /// block.
  double squared_reach(const Vector3d& middle) const {
    // A displaced sample is at most r = block_radius() + √3 · amplitude from the middle, for each component
    // of the displacement is at most the amplitude. Its nearest seed is no farther from it than the seed
    // nearest to the middle, hence no farther from the middle than that one by more than 2r; 1.001 covers
    // rounding.
    const double slack = 2.0 * 1.001 * (places_.block_radius() + std::sqrt(3.0) * displacement_.amplitude);
    const double farthest = std::sqrt(tree_.nearest(middle)) + slack;
    return farthest * farthest;
  }

  Places places_;
  std::vector<Vector3d> seeds_;
  GrowingTree tree_;
  Displacement displacement_;
  VectorNoise noise_;
};

}  // namespace

std::unique_ptr<Cutters> plane_cutters(std::vector<CuttingPlane> planes, const IndexToWorld& placement) {
  return std::make_unique<PlaneCutters>(std::move(planes), placement);
}

std::unique_ptr<Cutters> voronoi_cutters(std::vector<Vector3d> seeds, const Displacement& displacement,
                                         const IndexToWorld& placement) {
  return std::make_unique<VoronoiCutters>(std::move(seeds), displacement, placement);
}

}  // namespace hermesh
