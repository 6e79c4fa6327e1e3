// Dense voxels: the sign of a sample and its three up-wind edges (towards the next sample along x, y and z),
// crossed by the surface or not (Aldén 2011, §2.7, §2.8 and §4.2).
//
//   FloatVoxel     52 bytes   table 2.2's twelve floats and the flags: loses nothing
//   DirectedVoxel  12 bytes   §2.7: where edges are crossed, without normals
//   ThesisVoxel    10 bytes   §4.2 as printed, with its losses
//   FixedVoxel     10 bytes   the same size without them
//
// Lightweight: the requirements of OpenVDB on these types, except for their operators, are in dense_tree.h.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <ostream>
#include <type_traits>

#include "algorithms/hermite/crossing.h"
#include "algorithms/hermite/normal_codes.h"

namespace hermesh {

/// The operations that OpenVDB requires of every value type: order, addition, subtraction and negation. For
/// Hermite data they are meaningful for the sign only. So the negative of an outside voxel without crossings
/// is an inside one, as OpenVDB's files and its tools for level sets assume: the two values of inactive
/// voxels, which are stored as one bit.
template <class Voxel>
struct VdbValue {
  friend bool operator<(const Voxel& a, const Voxel& b) { return a.inside() && !b.inside(); }
  friend bool operator>(const Voxel& a, const Voxel& b) { return b < a; }
  template <class Any>
  friend Voxel operator+(const Voxel& a, const Any&) {
    return a;
  }
  friend Voxel operator-(const Voxel& a, const Voxel&) { return a; }
  friend Voxel operator-(const Voxel& a) {
    Voxel negated = a;
    negated.set_inside(!a.inside());
    return negated;
  }
  friend std::ostream& operator<<(std::ostream& out, const Voxel& voxel) {
    out << (voxel.inside() ? "inside" : "outside");
    for (int axis = 0; axis < 3; ++axis)
      if (voxel.crosses(axis)) out << ' ' << "xyz"[axis];
    return out;
  }
  bool operator==(const VdbValue&) const = default;
};

/// A voxel in single precision, which loses nothing.
class FloatVoxel : public VdbValue<FloatVoxel> {
 public:
  static constexpr const char* type_name = "hermite_float";

  bool inside() const { return (flags_ & kInside) != 0; }
  bool crosses(int axis) const { return ((flags_ >> axis) & 1) != 0; }
  void set_inside(bool inside) { flags_ = inside ? flags_ | kInside : flags_ & ~kInside; }
  void set(int axis, const EdgeCrossing& crossing) {
    flags_ |= 1u << axis;
    edges_[axis] = crossing;
  }
  EdgeCrossing get(int axis) const { return edges_[axis]; }
  /// Removes a crossing and leaves zeros, so that voxels with the same meaning are equal.
  void clear(int axis) {
    flags_ &= ~(1u << axis);
    edges_[axis] = {};
  }

  bool operator==(const FloatVoxel&) const = default;

 private:
  static constexpr std::uint32_t kInside = 8;
  std::array<EdgeCrossing, 3> edges_{};
  std::uint32_t flags_ = 0;  ///< bit a: the edge along axis a is crossed
};
static_assert(sizeof(FloatVoxel) == 52);

/// Signed distances along the three edges (§2.7): the sign bit, also of a zero, is set inside; the magnitude
/// is the offset of the crossing, or 2 without one.
class DirectedVoxel : public VdbValue<DirectedVoxel> {
 public:
  static constexpr const char* type_name = "hermite_directed";

  bool inside() const { return std::signbit(distances_[0]); }
  bool crosses(int axis) const { return std::abs(distances_[axis]) <= 1.0f; }
  void set_inside(bool inside) {
    for (float& distance : distances_) distance = std::copysign(distance, inside ? -1.0f : 1.0f);
  }
  /// Stores the offset of a crossing only. NaN becomes 0, as in pack_offset().
  void set(int axis, const EdgeCrossing& crossing) {
    const float offset = crossing.offset > 0.0f ? std::min(crossing.offset, 1.0f) : 0.0f;
    distances_[axis] = std::copysign(offset, distances_[axis]);
  }
  /// Returns the edge's direction as normal, towards the outside.
  EdgeCrossing get(int axis) const {
    EdgeCrossing crossing{std::abs(distances_[axis]), {}};
    crossing.normal[axis] = inside() ? 1.0f : -1.0f;
    return crossing;
  }
  void clear(int axis) { distances_[axis] = std::copysign(kNone, distances_[axis]); }
  const std::array<float, 3>& distances() const { return distances_; }
  static constexpr float kNone = 2.0f;

  /// Compares bits, since zeros of both signs are different voxels.
  bool operator==(const DirectedVoxel& other) const {
    using Bits = std::array<std::uint32_t, 3>;
    return std::bit_cast<Bits>(distances_) == std::bit_cast<Bits>(other.distances_);
  }

 private:
  std::array<float, 3> distances_{kNone, kNone, kNone};
};
static_assert(sizeof(DirectedVoxel) == 12);

/// Ten bytes: three normals of 16 bits and a word of 32 in two halves, because a whole one would be aligned
/// to four bytes and make the voxel 12 bytes large (trap T3). The word has the fields of figure 4.2 in the
/// order in which the thesis's author later published them (openvdb/math/Hermite.h of OpenVDB 2): from the
/// lowest bit ten for the offset along z, ten for y and ten for x, then the validity of z and the sign.
class TenByteVoxel {
 public:
  bool inside() const { return (halves_[1] >> 15) != 0; }
  void set_inside(bool inside) {
    halves_[1] = static_cast<std::uint16_t>((halves_[1] & 0x7fff) | (inside ? 0x8000 : 0));
  }
  std::uint16_t normal(int axis) const { return normals_[axis]; }
  std::uint16_t offset(int axis) const { return static_cast<std::uint16_t>((word() >> shift(axis)) & 1023); }
  bool operator==(const TenByteVoxel&) const = default;

 protected:
  static constexpr std::uint32_t kBit30 = std::uint32_t{1} << 30;  ///< validity of z, or free
  explicit constexpr TenByteVoxel(std::uint32_t word)
      : halves_{static_cast<std::uint16_t>(word), static_cast<std::uint16_t>(word >> 16)} {}

  static int shift(int axis) { return 10 * (2 - axis); }
  std::uint32_t word() const { return halves_[0] | (std::uint32_t{halves_[1]} << 16); }
  void set_word(std::uint32_t word) {
    halves_ = {static_cast<std::uint16_t>(word), static_cast<std::uint16_t>(word >> 16)};
  }
  void set_edge(int axis, std::uint16_t normal, std::uint16_t offset) {
    normals_[axis] = normal;
    set_word((word() & ~(std::uint32_t{1023} << shift(axis))) | (std::uint32_t{offset} << shift(axis)));
  }

 private:
  std::array<std::uint16_t, 3> normals_{};
  std::array<std::uint16_t, 2> halves_;
};

/// The quantised Hermite data object of §4.2 as printed. Bit 30 is set if the edge along z has data; those
/// along x and y have data if their normal's code is not 0. But every normal of the positive octant within
/// about 0.45° of +z has the code 0, and a surface nearly flat in z may well cross an edge along x: such
/// crossings are lost (trap T2).
class ThesisVoxel : public TenByteVoxel, public VdbValue<ThesisVoxel> {
 public:
  static constexpr const char* type_name = "hermite_thesis";
  ThesisVoxel() : TenByteVoxel(0) {}

  /// Returns the code of an offset: 1023 levels, rounded down. Offsets must be below 1; one of 1 gets the
  /// last code, 1022/1023. So the error is a whole level at most and half of one on average, towards the
  /// edge's first sample (trap T4).
  static std::uint16_t quantize(float offset) {
    const float held = offset > 0.0f ? offset : 0.0f;
    return held < 1.0f ? static_cast<std::uint16_t>(static_cast<int>(held * kLevels)) : std::uint16_t{1022};
  }
  static float reconstruct(std::uint16_t code) { return static_cast<float>(code) / kLevels; }

  bool crosses(int axis) const { return axis == 2 ? (word() & kBit30) != 0 : normal(axis) != 0; }
  void set(int axis, const EdgeCrossing& crossing) {
    set_edge(axis, ThesisNormalCode::pack(crossing.normal), quantize(crossing.offset));
    if (axis == 2) set_word(word() | kBit30);
  }
  EdgeCrossing get(int axis) const {
    return {reconstruct(offset(axis)), ThesisNormalCode::unpack(normal(axis))};
  }
  void clear(int axis) {
    set_edge(axis, 0, 0);
    if (axis == 2) set_word(word() & ~kBit30);
  }

  bool operator==(const ThesisVoxel&) const = default;

 private:
  static constexpr float kLevels = 1023.0f;
};
static_assert(sizeof(ThesisVoxel) == 10);

/// The ten bytes of ThesisVoxel without its losses: a crossing is absent if its offset has the code for that
/// (crossing.h), so any normal is valid, and offsets are rounded to the nearest of levels that include 0 and
/// 1. The code of the normals is a property of the grid. Bit 30 is unused. Combining grids works on the codes
/// without unpacking.
class FixedVoxel : public TenByteVoxel, public VdbValue<FixedVoxel> {
 public:
  static constexpr const char* type_name = "hermite_fixed";
  FixedVoxel() : TenByteVoxel(kNoOffset | (kNoOffset << 10) | (std::uint32_t{kNoOffset} << 20)) {}

  bool crosses(int axis) const { return offset(axis) != kNoOffset; }
  /// `offset` is at most kLastOffset.
  void set_raw(int axis, std::uint16_t normal, std::uint16_t offset) { set_edge(axis, normal, offset); }
  /// Stores a packed crossing without its tag.
  void set_packed(int axis, PackedCrossing crossing) { set_raw(axis, crossing.normal, crossing.offset()); }
  PackedCrossing get_packed(int axis) const { return {normal(axis), offset(axis)}; }

  template <NormalCode Code>
  void set(int axis, const EdgeCrossing& crossing) {
    set_raw(axis, Code::pack(crossing.normal), pack_offset(crossing.offset));
  }
  template <NormalCode Code>
  EdgeCrossing get(int axis) const {
    return unpack<Code>(get_packed(axis));
  }
  void clear(int axis) { set_edge(axis, 0, kNoOffset); }

  bool operator==(const FixedVoxel&) const = default;
};
static_assert(sizeof(FixedVoxel) == 10);

// Conversions of one crossing into a voxel and back, by the stored forms on either side. `Code` is the code
// of FixedVoxel's normals, or of the packed crossing; a code that both sides have is copied without decoding.

template <NormalCode Code, class Voxel>
void store_crossing(Voxel& voxel, int axis, const EdgeCrossing& crossing) {
  if constexpr (std::is_same_v<Voxel, FixedVoxel>)
    voxel.template set<Code>(axis, crossing);
  else
    voxel.set(axis, crossing);
}
template <NormalCode Code, class Voxel>
void store_crossing(Voxel& voxel, int axis, PackedCrossing crossing) {
  if constexpr (std::is_same_v<Voxel, FixedVoxel>)
    voxel.set_packed(axis, crossing);
  else
    voxel.set(axis, unpack<Code>(crossing));
}
template <NormalCode Code, class Crossing, class Voxel>
Crossing load_crossing(const Voxel& voxel, int axis) {
  if constexpr (std::is_same_v<Crossing, PackedCrossing>)
    return voxel.get_packed(axis);
  else if constexpr (std::is_same_v<Voxel, FixedVoxel>)
    return voxel.template get<Code>(axis);
  else
    return voxel.get(axis);
}

/// A default-constructed voxel is outside and has no crossings.
template <class Voxel>
concept DenseVoxel = std::is_trivially_copyable_v<Voxel> && std::default_initializable<Voxel> &&
    requires(Voxel voxel, const Voxel& same, int axis) {
  { same.inside() } -> std::same_as<bool>;
  { same.crosses(axis) } -> std::same_as<bool>;
  { same == same } -> std::same_as<bool>;
  voxel.set_inside(true);
  voxel.clear(axis);
};
static_assert(DenseVoxel<FloatVoxel> && DenseVoxel<DirectedVoxel> && DenseVoxel<ThesisVoxel> &&
              DenseVoxel<FixedVoxel>);

/// Returns a voxel without crossings, as all tiles and the background are.
template <class Voxel>
Voxel uniform_voxel(bool inside) {
  Voxel voxel;
  voxel.set_inside(inside);
  return voxel;
}

}  // namespace hermesh
