// The combination of two dense voxels and the complement of one, for each of their layouts.
#pragma once

#include <cstdint>
#include <limits>

#include "algorithms/hermite/boolean_rule.h"
#include "algorithms/thesis/voxels/voxels.h"

namespace hermesh {

/// Layouts that follow the rule of boolean_rule.h. `Code` is a crossing code from there.
///
/// No neighbour is needed: since an edge is crossed if and only if its ends differ in sign, a voxel
/// determines the sign at the other end of each of its edges.
template <class VoxelType, class Code>
struct RuledVoxel {
  using Voxel = VoxelType;
  using Crossing = typename Code::Crossing;

  static void combine(const BooleanRule& rule, Voxel& a, const Voxel& b) {
    const bool first_a = a.inside(), first_b = b.inside(), first = inside(rule, first_a, first_b);
    a.set_inside(first);
    for (int axis = 0; axis < 3; ++axis) {
      const bool in_a = a.crosses(axis), in_b = b.crosses(axis);
      if (!(in_a | in_b)) continue;
      if (inside(rule, first_a != in_a, first_b != in_b) == first)
        a.clear(axis);
      else if (in_b && (!in_a || rule.prefers_b<Code>(get(a, axis), get(b, axis), first)))
        set(a, axis, rule.turned<Code>(get(b, axis)));
    }
  }

  static void turn(Voxel& voxel) {
    voxel.set_inside(!voxel.inside());
    for (int axis = 0; axis < 3; ++axis)
      if (voxel.crosses(axis)) set(voxel, axis, Code::negated(get(voxel, axis)));
  }

 private:
  static bool inside(const BooleanRule& rule, bool a, bool b) { return (rule.inside(a, b) & 1) != 0; }
  // Packed crossings are copied, so the normal code does not matter.
  static Crossing get(const Voxel& voxel, int axis) {
    return load_crossing<OctahedralNormalCode, Crossing>(voxel, axis);
  }
  static void set(Voxel& voxel, int axis, const Crossing& crossing) {
    store_crossing<OctahedralNormalCode>(voxel, axis, crossing);
  }
};

/// Equation 7.1 as printed, on the codes. It leaves a component without data open; here it is infinite, with
/// the sign of the voxel, as the distances of a narrow band are where it ends. The thesis's author later
/// published minima and maxima (openvdb/math/Hermite.cc of OpenVDB 2) that take it for 0, so a union with a
/// voxel outside loses each of the other's crossings that is entered there: the equation can hardly mean
/// that.
struct PrintedVoxel {
  using Voxel = ThesisVoxel;

  static void combine(const BooleanRule& rule, Voxel& a, Voxel b) {
    if (rule.turns_b()) turn(b);
    // All components of a voxel have its sign, so the signs combine as the components do.
    const bool inside = rule.unites() ? a.inside() || b.inside() : a.inside() && b.inside();
    Codes codes(a);
    for (int axis = 0; axis < 3; ++axis) {
      const std::int32_t of_a = component(a, axis), of_b = component(b, axis);
      if (rule.unites() ? of_b < of_a : of_b > of_a) codes.copy_edge(axis, b);
    }
    codes.set_inside(inside);
    a = codes;
  }

  static void turn(Voxel& voxel) {
    Codes codes(voxel);
    for (int axis = 0; axis < 3; ++axis)
      if (voxel.crosses(axis))
        codes.set_edge(axis, ThesisNormalCode::negate(voxel.normal(axis)), voxel.offset(axis));
    codes.set_inside(!voxel.inside());
    voxel = codes;
  }

 private:
  struct Codes : Voxel {
    explicit Codes(const Voxel& voxel) : Voxel(voxel) {}
    using Voxel::set_edge;
    /// Copies an edge with its code and offset; along z the flag goes with it.
    void copy_edge(int axis, const Voxel& from) {
      set_edge(axis, from.normal(axis), from.offset(axis));
      if (axis == 2) set_word(from.crosses(2) ? word() | kBit30 : word() & ~kBit30);
    }
  };

  /// Returns the signed distance in steps of the offset; inside, 0 becomes -1, as -0 comes before 0.
  static std::int32_t component(const Voxel& voxel, int axis) {
    if (!voxel.crosses(axis))
      return voxel.inside() ? std::numeric_limits<std::int32_t>::min()
                            : std::numeric_limits<std::int32_t>::max();
    return voxel.inside() ? -1 - voxel.offset(axis) : voxel.offset(axis);
  }
};

}  // namespace hermesh
