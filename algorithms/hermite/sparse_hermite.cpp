#include "algorithms/hermite/sparse_hermite.h"

#include <cmath>
#include <string>

#include "algorithms/core/parallel.h"
#include "algorithms/hermite/normal_codes.h"

namespace hermesh {
namespace {

// Crossings in a task of a conversion, some microseconds of work.
constexpr std::size_t kCrossingsPerTask = 4096;

/// Converts each crossing by f, in parallel. The leaves, and with them all ranks, are unchanged.
template <class To, class From, class F>
SparseHermite<To> converted(const SparseHermite<From>& from, RunContext& context, F&& f) {
  SparseHermite<To> result;
  result.placement = from.placement;
  result.outermost_inside = from.outermost_inside;
  result.normal_code = from.normal_code;
  result.leaves = from.leaves;
  result.crossings.resize(from.crossings.size());
  const std::size_t size = from.crossings.size();
  parallel_blocks((size + kCrossingsPerTask - 1) / kCrossingsPerTask, context, [&](std::size_t chunk) {
    const std::size_t end = std::min(size, (chunk + 1) * kCrossingsPerTask);
    for (std::size_t i = chunk * kCrossingsPerTask; i < end; ++i) result.crossings[i] = f(from.crossings[i]);
  });
  return result;
}

std::string text_of(const std::array<std::int32_t, 3>& lower) {
  return "(" + std::to_string(lower[0]) + ", " + std::to_string(lower[1]) + ", " + std::to_string(lower[2]) +
         ")";
}

bool is_sound(const EdgeCrossing& crossing) {
  const auto& n = crossing.normal;
  // Single precision preserves unit length to a thousandth of this. NaN fails every comparison.
  const float length = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
  return crossing.offset >= 0.0f && crossing.offset <= 1.0f && std::abs(length - 1.0f) < 1e-3f;
}
bool is_sound(const PackedCrossing& crossing) { return crossing.offset() <= kLastOffset; }

/// @throws Error unless the samples beyond the last layer of `leaf` along `axis` are those of the next leaf,
/// or, without such a leaf, uniform and with the sign of the column.
template <class Crossing>
void check_beyond(const SparseHermite<Crossing>& hermite, const SignLeaf& leaf, int axis) {
  std::array<std::int32_t, 3> there = leaf.lower;
  there[axis] += 8;
  std::uint64_t expected = 0;
  if (const SignLeaf* next = hermite.find(there))
    expected = first_layer(next->inside, axis);
  else
    expected = hermite.sign_without_leaf(there) ? ~std::uint64_t{0} : 0;
  if (leaf.beyond[axis] != expected)
    throw Error("the Hermite data disagree about the signs between the blocks at " + text_of(leaf.lower) +
                " and " + text_of(there));
}

}  // namespace

PackedHermite pack(const FloatHermite& hermite, NormalCodeId code, RunContext& context) {
  PackedHermite result = with_normal_code(code, [&](auto chosen) {
    return converted<PackedCrossing>(
        hermite, context, [](const EdgeCrossing& crossing) { return pack<decltype(chosen)>(crossing); });
  });
  // Last, because converted() copies the unused code.
  result.normal_code = code;
  return result;
}

FloatHermite unpack(const PackedHermite& hermite, RunContext& context) {
  return with_normal_code(hermite.normal_code, [&](auto chosen) {
    return converted<EdgeCrossing>(
        hermite, context, [](PackedCrossing crossing) { return unpack<decltype(chosen)>(crossing); });
  });
}

bool same_lattice(const IndexToWorld& a, const IndexToWorld& b) {
  // Relative to the size of a voxel: a billionth in direction and size, a millionth in position, and rounding
  // far from the origin.
  const double size = a.linear.cwiseAbs().maxCoeff();
  if (!((a.linear - b.linear).cwiseAbs().maxCoeff() <= 1e-9 * size)) return false;
  // Placements may divide their translation differently, so the images of index 0 are compared.
  const auto of_index_zero = [](const IndexToWorld& p) -> Eigen::Vector3d {
    return p.offset + p.origin - p.linear * Eigen::Vector3d(p.base[0], p.base[1], p.base[2]);
  };
  const Eigen::Vector3d zero_a = of_index_zero(a), zero_b = of_index_zero(b);
  const double rounding = 1e-12 * std::max(zero_a.cwiseAbs().maxCoeff(), zero_b.cwiseAbs().maxCoeff());
  return (zero_a - zero_b).cwiseAbs().maxCoeff() <= 1e-6 * size + rounding;
}

template <class Crossing>
void check_consistent(const SparseHermite<Crossing>& hermite) {
  // In the order of the leaves, each against its neighbors and the sum of crossings so far, which verifies
  // all ranks.
  std::size_t next = 0;
  for (std::size_t i = 0; i < hermite.leaves.size(); ++i) {
    const SignLeaf& leaf = hermite.leaves[i];
    for (const std::int32_t lower : leaf.lower)
      if (lower & 7)
        throw Error("the Hermite data have a block at " + text_of(leaf.lower) +
                    ", which is no multiple of 8");
    if (i > 0 && !(hermite.leaves[i - 1].lower < leaf.lower))
      throw Error("the Hermite data have their blocks out of order at " + text_of(leaf.lower));
    std::size_t crossings = 0;
    for (const BlockMask& axis : crossing_edges(leaf)) crossings += static_cast<std::size_t>(count(axis));
    // A leaf that owns no crossing edge must be omitted, or equal data could differ.
    if (crossings == 0 || leaf.first != next)
      throw Error("the Hermite data have a wrong number of crossings in the block at " + text_of(leaf.lower));
    next += crossings;
    for (int axis = 0; axis < 3; ++axis) check_beyond(hermite, leaf, axis);
    // A missing lower leaf must be uniform, and this one's first layers agree with it.
    for (int axis = 0; axis < 3; ++axis) {
      std::array<std::int32_t, 3> below = leaf.lower;
      below[axis] -= 8;
      if (hermite.find(below)) continue;
      if (first_layer(leaf.inside, axis) != (hermite.sign_without_leaf(below) ? ~std::uint64_t{0} : 0))
        throw Error("the Hermite data lack the block at " + text_of(below) +
                    ", which must own a crossing edge");
    }
  }
  if (next != hermite.crossings.size())
    throw Error("the Hermite data have " + std::to_string(hermite.crossings.size()) + " crossings for " +
                std::to_string(next) + " crossing edges");
  for (const Crossing& crossing : hermite.crossings)
    if (!is_sound(crossing)) throw Error("the Hermite data hold an offset or a normal that is out of range");
}

template void check_consistent(const FloatHermite&);
template void check_consistent(const PackedHermite&);

}  // namespace hermesh
