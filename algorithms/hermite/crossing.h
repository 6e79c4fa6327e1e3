// One edge crossing: the point where the surface intersects a grid edge, and its normal (Aldén 2011, §2.8).
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/hermite/normal_code.h"

namespace hermesh {

/// A crossing in single precision, 16 bytes, for samplers and placement. (Like PackedCrossing it has no
/// initializers, so that an array of millions is not written twice.)
struct EdgeCrossing {
  float offset;                 ///< along the edge, 0 at its first sample and 1 at the next
  std::array<float, 3> normal;  ///< unit length in index space, towards the outside

  bool operator==(const EdgeCrossing&) const = default;
};
static_assert(sizeof(EdgeCrossing) == 16);

/// Offsets of 10 bits: 1023 levels from 0 to 1, both exactly representable, rounded to the nearest, so that
/// the error is at most half a step of 1/1022 and has no bias (trap T4: the thesis floors 1023 levels below
/// 1). The remaining code means no crossing.
inline constexpr std::uint16_t kLastOffset = 1022, kNoOffset = 1023;

/// Returns the code of an offset; NaN becomes 0. Always inlined, like all that packs normals: it is compiled
/// for several SIMD levels, and the linker might use a copy of one level in the others.
[[gnu::always_inline]] constexpr std::uint16_t pack_offset(float offset) {
  const float held = offset > 0.0f ? (offset < 1.0f ? offset : 1.0f) : 0.0f;
  return static_cast<std::uint16_t>(static_cast<int>(held * float(kLastOffset) + 0.5f));
}
constexpr float unpack_offset(std::uint16_t code) { return static_cast<float>(code) / float(kLastOffset); }

/// A crossing in 4 bytes: a normal of 16 bits by some NormalCode, an offset of 10 and a tag of 6 for the
/// user, which follows the crossing (pieces of a fracture distinguish original from cut surface by it).
struct PackedCrossing {
  std::uint16_t normal;
  std::uint16_t offset_and_tag;

  std::uint16_t offset() const { return offset_and_tag & 1023; }
  std::uint8_t tag() const { return static_cast<std::uint8_t>(offset_and_tag >> 10); }

  bool operator==(const PackedCrossing&) const = default;
};
static_assert(sizeof(PackedCrossing) == 4);

template <NormalCode Code>
PackedCrossing pack(const EdgeCrossing& crossing, std::uint8_t tag = 0) {
  return {Code::pack(crossing.normal),
          static_cast<std::uint16_t>(pack_offset(crossing.offset) | (tag << 10))};
}
template <NormalCode Code>
EdgeCrossing unpack(PackedCrossing crossing) {
  return {unpack_offset(crossing.offset()), Code::unpack(crossing.normal)};
}

}  // namespace hermesh
