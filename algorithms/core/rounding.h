// Rounding in loops over all triangles.
#pragma once

#include <cstdint>

namespace hermesh {

/// The whole number at or below x, which has to be within the range of the result. Without the processor's instruction,
/// which not every x86-64 has, std::floor is the call of a function and takes several times as long.
inline std::int32_t floor_to_int(double x) {
  const auto towards_zero = static_cast<std::int32_t>(x);
  return towards_zero - (x < towards_zero ? 1 : 0);
}

}  // namespace hermesh
