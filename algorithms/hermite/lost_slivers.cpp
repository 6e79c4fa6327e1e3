#include "algorithms/hermite/lost_slivers.h"

#include <algorithm>

#include "algorithms/core/number_text.h"

namespace hermesh {
namespace {

constexpr double kRounding = 1e-3;  // voxels

/// A part of an edge that the combination loses; negative lengths are no sliver.
struct Sliver {
  double length, middle;  ///< along the edge
};

/// The part between the crossings of an edge whose first sample is in one operand and not in the other, as
/// the intersection or the union has them: [offset of the one that ends, offset of the one that begins] is
/// inside neither, and the reverse both.
Sliver between(bool unites, double ends, double begins) {
  return {unites ? begins - ends : ends - begins, 0.5 * (ends + begins)};
}

class Counter {
 public:
  Counter(Boolean boolean, const FloatHermite& a, const FloatHermite& b)
      : unites_(boolean == Boolean::unite), turns_b_(boolean == Boolean::subtract), a_(a), b_(b) {}

  LostSlivers run() {
    // Only an edge that both operands cross can lose a part, so only leaves at one place matter; both
    // sequences ascend.
    std::size_t j = 0;
    for (std::size_t i = 0; i < a_.leaves.size(); ++i) {
      while (j < b_.leaves.size() && b_.leaves[j].lower < a_.leaves[i].lower) ++j;
      if (j == b_.leaves.size()) break;
      if (b_.leaves[j].lower == a_.leaves[i].lower) add(i, j);
    }
    // Each lattice line stands for a square of one voxel across, so lengths along an axis add up to a volume.
    // A sliver is seen best along its thin direction, which is the axis that finds most.
    result_.volume = *std::ranges::max_element(along_axis_);
    return result_;
  }

 private:
  void add(std::size_t i, std::size_t j) {
    const SignLeaf &leaf_a = a_.leaves[i], &leaf_b = b_.leaves[j];
    const std::array<BlockMask, 3> edges_a = crossing_edges(leaf_a), edges_b = crossing_edges(leaf_b);
    const EdgeCrossing *of_a = a_.crossings_of(i).data(), *of_b = b_.crossings_of(j).data();
    for (int axis = 0; axis < 3; ++axis) {
      for (int x = 0; x < 8; ++x) {
        // Edges that both cross with different signs at the first sample: one operand ends there and the
        // other begins. For a difference the second one is its complement.
        const std::uint64_t turned = turns_b_ ? ~std::uint64_t{0} : 0;
        std::uint64_t both =
            edges_a[axis][x] & edges_b[axis][x] & (leaf_a.inside[x] ^ leaf_b.inside[x] ^ turned);
        for (; both != 0; both &= both - 1) {
          const int sample = 64 * x + std::countr_zero(both);
          const double at_a = of_a[rank_in(edges_a[axis], sample)].offset;
          const double at_b = of_b[rank_in(edges_b[axis], sample)].offset;
          const Sliver sliver =
              test(leaf_a.inside, sample) ? between(unites_, at_a, at_b) : between(unites_, at_b, at_a);
          if (sliver.length > kRounding) add(leaf_a, axis, sample, sliver);
        }
      }
      of_a += count(edges_a[axis]);
      of_b += count(edges_b[axis]);
    }
  }

  void add(const SignLeaf& leaf, int axis, int sample, const Sliver& sliver) {
    ++result_.edges;
    along_axis_[static_cast<std::size_t>(axis)] += sliver.length;
    if (sliver.length <= result_.longest) return;
    result_.longest = sliver.length;
    Eigen::Vector3d index(sample >> 6, (sample >> 3) & 7, sample & 7);
    index[axis] += sliver.middle;
    for (int i = 0; i < 3; ++i) index[i] += leaf.lower[i] - a_.placement.base[i];
    result_.place = a_.placement.origin + a_.placement.local(index);
  }

  const bool unites_, turns_b_;
  const FloatHermite &a_, &b_;
  LostSlivers result_;
  std::array<double, 3> along_axis_{};
};

}  // namespace

LostSlivers lost_slivers(Boolean boolean, const FloatHermite& a, const FloatHermite& b) {
  return Counter(boolean, a, b).run();
}

std::string lost_slivers_note(const LostSlivers& lost, Boolean boolean, double voxel_size) {
  // Counts are in voxels, and users think in the world's units.
  const double volume = lost.volume * voxel_size * voxel_size * voxel_size;
  return std::to_string(lost.edges) + " lattice edges pass through " +
         (boolean == Boolean::unite ? "gaps that hold no sample: they were closed"
                                    : "parts that hold no sample: they were lost") +
         ", a volume of about " + text(volume) + ", the thickest of them " + text(lost.longest * voxel_size) +
         " at " + text(lost.place) + "; smaller voxels keep more";
}

}  // namespace hermesh
