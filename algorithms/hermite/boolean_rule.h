// What a union, an intersection and a difference do to signs and to the crossings of one edge: the rule that
// the combinations of sparse and of dense Hermite data share.
//
// Equation 7.1 of the thesis (Aldén 2011) takes the minimum or the maximum of the signed directed distances
// by component. It does not say what becomes of an edge that only one operand crosses, whose other distance
// is missing, nor of distances of equal sign or equal size (trap T11). The rule here starts from the signs
// instead:
//
//   1. A sample of a union is inside if it is in one of the operands, of an intersection if it is in both.
//   The
//      difference of A and B is the intersection of A with the complement of B, which has the same crossings
//      with normals turned about.
//   2. An edge of the result is crossed if and only if the signs of its ends differ. So no hole can be left.
//   3. If one operand alone crosses such an edge, its crossing is taken: the other operand's ends are both
//   inside or
//      both outside, and, since the result is crossed, of the sign that leaves the matter to the first.
//   4. If both cross it, they do so in the same direction, for otherwise the result's ends would have equal
//   signs. A
//      union takes the crossing that leaves the longer part of the edge inside, an intersection the one that
//      leaves the shorter: both sets are intervals that begin at the same end.
//   5. Of equal offsets a union takes the normal of lower order, an intersection that of higher; negation
//   reverses that
//      order. Of equal normals both take the lower tag.
//
// What is lost: where the operands cross an edge against each other, the gap (of a union) or the sliver (of
// an intersection) between the two crossings is shorter than the edge, and no sample is in it (trap T10).
//
// What holds, bit by bit: commutativity, associativity and idempotence of both operations, De Morgan's laws,
// and that the complement is an involution, since 4 and 5 choose the extreme of a total order that the
// complement reverses (of tags, which it leaves alone, the same one). Distributivity does not: with A
// crossing an edge outwards at 0.9, B outwards at 0.5 and C inwards, B ∪ C fills the edge, so A ∩ (B ∪ C)
// ends at 0.9, but (A ∩ B) ∪ (A ∩ C) at 0.5, the sliver A ∩ C being lost.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "algorithms/hermite/crossing.h"

namespace hermesh {

/// The union, the intersection and the difference of two operands.
enum class Boolean { unite, intersect, subtract };

/// A Boolean operation as an intersection of operands some of which are complemented, and of a result that
/// may be.
class BooleanRule {
 public:
  explicit BooleanRule(Boolean boolean)
      : unites_(boolean == Boolean::unite),
        turns_b_(boolean == Boolean::subtract),
        flip_a_(unites_ ? ~std::uint64_t{0} : 0),
        flip_b_(unites_ || turns_b_ ? ~std::uint64_t{0} : 0),
        flip_result_(flip_a_) {}

  bool unites() const { return unites_; }
  /// True if the normals of the second operand change sides.
  bool turns_b() const { return turns_b_; }

  /// Inside bits of the result, from those of the operands.
  std::uint64_t inside(std::uint64_t a, std::uint64_t b) const {
    return ((a ^ flip_a_) & (b ^ flip_b_)) ^ flip_result_;
  }
  /// Whether the first operand's part of a place is kept where the second operand is uniform, with this sign;
  /// otherwise the result is uniform there, too.
  bool keeps_a(bool b_inside) const { return b_inside != (flip_b_ != 0); }
  /// Whether the second operand's part is kept where the first one is uniform.
  bool keeps_b(bool a_inside) const { return a_inside != (flip_a_ != 0); }

  // Which of two crossings of one edge in the same direction is taken; `b` is as its own grid has it. `Code`
  // is a crossing code, see below.

  /// Whether the offset of `b` decides for it; false for equal offsets. `first_inside` is the result's sign
  /// at the edge's first sample.
  template <class Code>
  bool prefers_offset_of_b(const typename Code::Crossing& a, const typename Code::Crossing& b,
                           bool first_inside) const {
    // An edge left at a greater offset is inside for longer, one entered there for shorter. Without branches,
    // which could not be predicted.
    const bool greater = first_inside == unites_;
    const std::int32_t offset_a = Code::offset(a), offset_b = Code::offset(b);
    return (static_cast<int>(offset_a < offset_b) & static_cast<int>(greater)) |
           (static_cast<int>(offset_a > offset_b) & static_cast<int>(!greater));
  }
  /// Whether the normal of `b` decides for it, where offsets are equal; false if there is nothing to choose.
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
  /// A crossing of the second operand as the result has it.
  template <class Code>
  typename Code::Crossing turned(const typename Code::Crossing& b) const {
    return turns_b_ ? Code::negated(b) : b;
  }

 private:
  bool unites_, turns_b_;
  std::uint64_t flip_a_, flip_b_, flip_result_;
};

// A crossing code tells the rule how to compare crossings of one kind and how to turn their normals about:
// offset() grows with the offset; normal_order() is reversed by negated(); remainder() is not changed by it,
// and tells apart what is otherwise equal.

template <NormalCode Normal>
struct PackedCrossingCode {
  using Crossing = PackedCrossing;
  static std::int32_t offset(Crossing crossing) { return crossing.offset(); }
  static int normal_order(Crossing crossing) { return order<Normal>(crossing.normal); }
  /// Tells apart crossings of equal offset and normal order: by the tag, and by the normal for the sake of
  /// codes from outside that pack() does not return, two of which may have the same opposite.
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
