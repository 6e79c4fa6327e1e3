#include "algorithms/fracture/scatter.h"

#include <algorithm>
#include <cmath>

#include "algorithms/fracture/growing_tree.h"
#include "algorithms/fracture/noise.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Draws inside samples with equal probability without a list of them: only the sums per block are stored.
class InsideSamples {
 public:
  explicit InsideSamples(const LabelledSolid& solid) : solid_(solid), first_(solid.blocks.size() + 1) {
    for (std::size_t b = 0; b < solid.blocks.size(); ++b)
      first_[b + 1] = first_[b] + static_cast<std::uint64_t>(count(solid.blocks[b].inside));
  }
  std::uint64_t size() const { return first_.back(); }

  /// A world position within half a voxel, along each axis, of a random inside sample; near the surface it
  /// may lie outside the solid by that distance.
  Vector3d place(Random& random) const {
    const std::uint64_t wanted = random.below(size());
    // The last block whose first sample is not beyond the wanted one; blocks without inside samples are
    // passed over, for the next one begins with the same number.
    const auto b =
        static_cast<std::size_t>(std::upper_bound(first_.begin(), first_.end(), wanted) - first_.begin()) - 1;
    // Then the sample by its rank within the block.
    std::uint64_t left = wanted - first_[b];
    int sample = 0;
    for_each_bit(solid_.blocks[b].inside, [&](int i) {
      if (left-- == 0) sample = i;
    });
    const auto index = solid_.index(static_cast<std::int32_t>(b), sample);
    Vector3d local;
    for (int a = 0; a < 3; ++a)
      local[a] = double(index[a]) - double(solid_.placement.base[a]) + random.uniform() - 0.5;
    return solid_.placement.local(local) + solid_.placement.origin;
  }

 private:
  const LabelledSolid& solid_;
  std::vector<std::uint64_t> first_;
};

}  // namespace

std::vector<Vector3d> scatter(const LabelledSolid& solid, std::size_t count, const ScatterOptions& options,
                              RunContext& context) {
  // More candidates make the spacing more even, at a proportional cost: each is compared with all positions
  // so far. The limit on tries ends the search if the density accepts almost nothing.
  constexpr int kCandidates = 24;
  constexpr int kTries = 100'000;
  const Stage stage(context, "scatter");
  const InsideSamples samples(solid);
  if (samples.size() == 0)
    throw Error("the solid has no sample inside, so nothing can be scattered in it: use smaller voxels");
  Random random(options.seed);
  if (count > samples.size())
    throw Error(std::to_string(count) + " places are to be scattered in a solid of " +
                std::to_string(samples.size()) +
                " samples: ask for no more places than samples, or use smaller voxels");
  std::vector<Vector3d> places;
  GrowingTree tree;
  while (places.size() < count) {
    context.check();
    if (places.size() % 1024 == 0) context.progress("scatter", double(places.size()) / double(count));
    double farthest = -1.0;
    Vector3d best = Vector3d::Zero();
    int tries = 0;
    for (int candidate = 0; candidate < kCandidates;) {
      if (++tries > kTries) break;
      const Vector3d place = samples.place(random);
      const double density = options.density ? options.density(place) : 1.0;
      // Accepted in proportion to the density. All random numbers are drawn in sequence in this thread only,
      // so the result depends only on the seed.
      if (!(density > 0) || random.uniform() >= density) continue;
      ++candidate;
      // Where positions are to be n times as dense, their spacing is smaller by the cube root of n; scaled by
      // it, distances can be compared between dense and sparse parts.
      const double nearest = std::sqrt(tree.nearest(place)) * std::cbrt(density);
      if (nearest > farthest) farthest = nearest, best = place;
    }
    // Nothing was accepted, or only positions that are already used; this ensures that all positions differ.
    if (!(farthest > 0))
      throw Error("only " + std::to_string(places.size()) + " of " + std::to_string(count) +
                  " places could be scattered: the density is nowhere above 0 inside the solid, or too low");
    places.push_back(best);
    tree.add(best);
  }
  return places;
}

std::function<double(const Vector3d&)> density_about(const Vector3d& impact, double radius) {
  return [=](const Vector3d& x) {
    const double d = (x - impact).norm() / radius;
    return 1.0 / (1.0 + d * d * d);
  };
}

}  // namespace hermesh
