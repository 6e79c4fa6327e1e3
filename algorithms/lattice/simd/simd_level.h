// Which vector instructions the program uses. All levels give the same bytes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hermesh {

/// Levels of vector code, in ascending order. `sse2` is what every target is compiled for (x86-64-v2):
/// vectors of four. `avx512` is what Ice Lake and Zen 4 were the first to have: F, BW, DQ, VL and VBMI2.
enum class SimdLevel { sse2, avx2, avx512 };

/// The name that HERMESH_SIMD takes: "sse2", "avx2" or "avx512".
std::string_view name(SimdLevel level);

/// The levels that this machine can run, in ascending order.
std::vector<SimdLevel> available_simd_levels();

/// The level of that name.
/// @throws Error for a name that is no level and for a level that this machine cannot run.
SimdLevel parse_simd_level(std::string_view name);

/// What the environment variable HERMESH_SIMD names, or else the highest that the machine can run. @throws
/// Error as parse_simd_level() does.
SimdLevel chosen_simd_level();

/// A family of kernels is a struct of pointers to functions with its level, `SimdLevel level`, and `static
/// const Kernels sse2, avx2, avx512;`. Its source is compiled once for each of these (hermesh_simd_sources()
/// in algorithms/CMakeLists.txt), with the level's name as HERMESH_SIMD_LEVEL, and defines the one with that
/// name. All else in it lies in a namespace of that name, within a namespace without one, and calls no
/// function that another source may have, too, such as those of the standard library: the linker would keep
/// one copy for all, maybe one that the machine cannot run.
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
