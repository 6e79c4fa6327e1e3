// Which vector instructions the program uses. All levels give the same bytes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hermesh {

/// Levels of vector code, in ascending order. `sse2` is what every target is compiled for (x86-64-v2): vectors of four.
/// `avx512` is what Ice Lake and Zen 4 were the first to have: F, BW, DQ, VL and VBMI2.
enum class SimdLevel { sse2, avx2, avx512 };

/// The name that HERMESH_SIMD takes: "sse2", "avx2" or "avx512".
std::string_view name(SimdLevel level);

/// The levels that this machine can run, in ascending order.
std::vector<SimdLevel> available_simd_levels();

/// The level of that name.
/// @throws Error for a name that is no level and for a level that this machine cannot run.
SimdLevel parse_simd_level(std::string_view name);

/// What the environment variable HERMESH_SIMD names, or else the highest that the machine can run. @throws Error as
/// parse_simd_level() does.
SimdLevel chosen_simd_level();

/// The one of three things (kernels, tables of functions) that was compiled for the level.
template <class T>
const T& of_level(SimdLevel level, const T& sse2, const T& avx2, const T& avx512) {
  return level == SimdLevel::avx512 ? avx512 : level == SimdLevel::avx2 ? avx2 : sse2;
}

}  // namespace hermesh
