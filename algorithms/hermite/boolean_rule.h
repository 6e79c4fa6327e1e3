// The effect of a union, an intersection and a difference on signs and on the crossings of one edge: the rule
// shared by the combinations of sparse and of dense Hermite data.
//
// Equation 7.1 of the thesis (Aldén 2011) takes the minimum or the maximum of the signed directed distances
// by component. It leaves open edges that only one operand crosses, whose other distance is missing, and
// distances of equal sign or equal size (trap T11). The rule here starts from the signs instead:
//
//   1. A sample of a union is inside if it is in one of the operands, of an intersection if it is in both.
//      The difference of A and B is the intersection of A with the complement of B, which has the same
//      crossings with reversed normals.
//   2. An edge of the result is crossed if and only if the signs of its ends differ. So there are no holes.
//   3. If only one operand crosses such an edge, its crossing is taken: the other operand's ends are both
//      inside or both outside, and, since the result is crossed, of the sign that leaves the result to the
//      first.
//   4. If both cross it, they do so in the same direction, for otherwise the result's ends would have equal
//      signs. A union takes the crossing that leaves the longer part of the edge inside, an intersection the
//      shorter: both sets are intervals that begin at the same end.
//   5. Of equal offsets a union takes the normal of lower order, an intersection that of higher; negation
//      reverses that order. Of equal normals both take the lower tag.
//
// Loss: where the operands cross an edge in opposite directions, the gap (of a union) or the sliver (of an
// intersection) between the two crossings is shorter than the edge and contains no sample (trap T10).
//
// Laws that hold, bit by bit: commutativity, associativity and idempotence of both operations, De Morgan's
// laws, and that the complement is an involution, since 4 and 5 choose the extreme of a total order that the
// complement reverses (except of tags, which it preserves). Distributivity does not: with A crossing an edge
// outwards at 0.9, B outwards at 0.5 and C inwards, B ∪ C fills the edge, so A ∩ (B ∪ C) ends at 0.9, but (A
// ∩ B) ∪ (A ∩ C) at 0.5, the sliver A ∩ C being lost.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "algorithms/hermite/crossing.h"

namespace hermesh {

/// The union, the intersection and the difference of two operands.
enum class Boolean { unite, intersect, subtract };

/// A Boolean operation as an intersection of operands, each possibly complemented, and of a possibly
/// complemented result.
class BooleanRule {
 public:
  explicit BooleanRule(Boolean boolean)
      : unites_(boolean == Boolean::unite),
        turns_b_(boolean == Boolean::subtract),
        flip_a_(unites_ ? ~std::uint64_t{0} : 0),
        flip_b_(unites_ || turns_b_ ? ~std::uint64_t{0} : 0),
        flip_result_(flip_a_) {}

  bool unites() const { return unites_; }
  /// Returns true if the normals of the second operand are reversed.
  bool turns_b() const { return turns_b_; }

  /// Returns the inside bits of the result from those of the operands.
  std::uint64_t inside(std::uint64_t a, std::uint64_t b) const {
    return ((a ^ flip_a_) & (b ^ flip_b_)) ^ flip_result_;
  }
  /// Returns true if the first operand's part is preserved where the second operand is uniform with this
  /// sign; otherwise the result is uniform there, too.
  bool keeps_a(bool b_inside) const { return b_inside != (flip_b_ != 0); }
  /// Returns true if the second operand's part is preserved where the first one is uniform.
  bool keeps_b(bool a_inside) const { return a_inside != (flip_a_ != 0); }

  // The choice between two crossings of one edge in the same direction; `b` is as in its own grid. `Code` is
  // a crossing code, see below.

  /// Returns true if the offsets select `b`; false for equal offsets. `first_inside` is the result's sign at
  /// the edge's first sample.
  template <class Code>
  bool prefers_offset_of_b(const typename Code::Crossing& a, const typename Code::Crossing& b,
                           bool first_inside) const {
    // An edge left at a greater offset is inside for longer, one entered there for shorter. Without
    // unpredictable branches.
    const bool greater = first_inside == unites_;
    const std::int32_t offset_a = Code::offset(a), offset_b = Code::offset(b);
    return (static_cast<int>(offset_a < offset_b) & static_cast<int>(greater)) |
           (static_cast<int>(offset_a > offset_b) & static_cast<int>(!greater));
  }
  /// Returns true if the normals select `b`, for equal offsets; false if the crossings are equivalent.
  template <class Code>
  bool prefers_normal_of_b(const typename Code::Crossing& a, typename Code::Crossing b) const {
    if (turns_b_) b = Code::negated(b);
    const auto order_a = Code::normal_order(a), order_b = Code::normal_order(b);
    if (order_a != order_b) return (order_b < order_a) == unites_;
    return Code::remainder(b) < Code::remainder(a);
  }
  template <class Code>
  bool prefers_b(const typename Code::Crossing& a, const typename Code::Crossing& b,
                 bool first_inside) const {
    if (Code::offset(a) == Code::offset(b)) return prefers_normal_of_b<Code>(a, b);
    return prefers_offset_of_b<Code>(a, b, first_inside);
  }
  /// Returns the form that a crossing of the second operand has in the result.
  template <class Code>
  typename Code::Crossing turned(const typename Code::Crossing& b) const {
    return turns_b_ ? Code::negated(b) : b;
  }

 private:
  bool unites_, turns_b_;
  std::uint64_t flip_a_, flip_b_, flip_result_;
};

// A crossing code defines how crossings of one kind are compared and their normals reversed: offset() grows
// with the offset; normal_order() is reversed by negated(); remainder() is unchanged by it, and separates
// otherwise equal crossings.

template <NormalCode Normal>
struct PackedCrossingCode {
  using Crossing = PackedCrossing;
  static std::int32_t offset(Crossing crossing) { return crossing.offset(); }
  static int normal_order(Crossing crossing) { return order<Normal>(crossing.normal); }
  /// Separates crossings of equal offset and normal order: by the tag, and by the normal for codes from
  /// outside that pack() does not return, two of which may have the same opposite.
  static std::uint32_t remainder(Crossing crossing) {
    return static_cast<std::uint32_t>(crossing.tag() << 16) | crossing.normal;
  }
  static Crossing negated(Crossing crossing) {
    return {Normal::negate(crossing.normal), crossing.offset_and_tag};
  }
};

struct FloatCrossingCode {
  using Crossing = EdgeCrossing;
  /// Orders floats like their values, -0 before 0, and every NaN somewhere; ordered(-x) = -1 - ordered(x).
  static std::int32_t ordered(float value) {
    const auto bits = std::bit_cast<std::int32_t>(value);
    return bits ^ ((bits >> 31) & 0x7fffffff);
  }
  static std::int32_t offset(const Crossing& crossing) { return ordered(crossing.offset); }
  static std::array<std::int32_t, 3> normal_order(const Crossing& crossing) {
    return {ordered(crossing.normal[0]), ordered(crossing.normal[1]), ordered(crossing.normal[2])};
  }
  static int remainder(const Crossing&) { return 0; }
  static Crossing negated(const Crossing& crossing) {
    const auto& n = crossing.normal;
    return {crossing.offset, {-n[0], -n[1], -n[2]}};
  }
};

}  // namespace hermesh
