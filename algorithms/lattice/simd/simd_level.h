// The SIMD level of the program. All levels give the same bytes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hermesh {

/// SIMD levels, in ascending order. `sse2` is that of every target (x86-64-v2): vectors of four. `avx512` is
/// that of Ice Lake and Zen 4: F, BW, DQ, VL and VBMI2.
enum class SimdLevel { sse2, avx2, avx512 };

/// Returns the name in HERMESH_SIMD: "sse2", "avx2" or "avx512".
std::string_view name(SimdLevel level);

/// Returns the levels that this machine can run, in ascending order.
std::vector<SimdLevel> available_simd_levels();

/// Returns the level of that name. @throws Error for an unknown name and for a level that this machine cannot
/// run.
SimdLevel parse_simd_level(std::string_view name);

/// Returns the level in the environment variable HERMESH_SIMD, or else the highest that the machine can run.
/// @throws Error as parse_simd_level().
SimdLevel chosen_simd_level();

/// A family of kernels is a struct of pointers to functions with its level, `SimdLevel level`, and `static
/// const Kernels sse2, avx2, avx512;`. Its source is compiled once for each of these (hermesh_simd_sources()
/// in algorithms/CMakeLists.txt), with the level's name as HERMESH_SIMD_LEVEL, and defines the one with that
/// name. All else in it lies in a namespace of that name, within an unnamed namespace, and calls no function
/// that another source may have, too, such as those of the standard library: the linker would choose one copy
/// for all, possibly one that the machine cannot run.
template <class Kernels>
const Kernels& kernels_of(SimdLevel level) {
  return level == SimdLevel::avx512 ? Kernels::avx512
         : level == SimdLevel::avx2 ? Kernels::avx2
                                    : Kernels::sse2;
}
template <class Kernels>
const Kernels& chosen_kernels() {
  return kernels_of<Kernels>(chosen_simd_level());
}

}  // namespace hermesh
