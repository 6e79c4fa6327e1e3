#include "algorithms/lattice/simd/simd_level.h"

#include <cstdlib>

#include "algorithms/core/error.h"

namespace hermesh {
namespace {

// In ascending order.
constexpr SimdLevel kAll[] = {SimdLevel::sse2, SimdLevel::avx2, SimdLevel::avx512};

bool is_available(SimdLevel level) {
  switch (level) {
    // GCC's builtin also checks that the operating system saves the wide registers.
    case SimdLevel::avx2:
      return __builtin_cpu_supports("avx2") != 0;
    case SimdLevel::avx512:
      // All five extensions that sources of this level are compiled for.
      return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512bw") != 0 &&
             __builtin_cpu_supports("avx512dq") != 0 && __builtin_cpu_supports("avx512vl") != 0 &&
             __builtin_cpu_supports("avx512vbmi2") != 0;
    // Every source file is compiled for it.
    case SimdLevel::sse2:
      break;
  }
  return true;
}

std::string names_of_available() {
  std::string text;
  for (const SimdLevel level : available_simd_levels())
    text += (text.empty() ? "" : ", ") + std::string(name(level));
  return text;
}

}  // namespace

std::string_view name(SimdLevel level) {
  constexpr std::string_view kNames[] = {"sse2", "avx2", "avx512"};
  return kNames[static_cast<int>(level)];
}

std::vector<SimdLevel> available_simd_levels() {
  std::vector<SimdLevel> result;
  for (const SimdLevel level : kAll)
    if (is_available(level)) result.push_back(level);
  return result;
}

SimdLevel parse_simd_level(std::string_view text) {
  for (const SimdLevel level : kAll) {
    if (name(level) != text) continue;
    // Not replaced by a lower one: a test or measurement that forces a level must not get another.
    if (!is_available(level))
      throw Error("HERMESH_SIMD=" + std::string(text) +
                  " asks for vector code that this machine cannot run; it has " + names_of_available() + ".");
    return level;
  }
  throw Error("HERMESH_SIMD is '" + std::string(text) +
              "', which is no level of vector code; this machine has " + names_of_available() + ".");
}

SimdLevel chosen_simd_level() {
  // Read at every call, so that tests can set all levels in one process. Empty counts as not set.
  const char* text = std::getenv("HERMESH_SIMD");
  if (text && *text) return parse_simd_level(text);
  return is_available(SimdLevel::avx512) ? SimdLevel::avx512
         : is_available(SimdLevel::avx2) ? SimdLevel::avx2
                                         : SimdLevel::sse2;
}

}  // namespace hermesh
