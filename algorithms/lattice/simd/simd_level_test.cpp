#include "algorithms/lattice/simd/simd_level.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "algorithms/core/error.h"
#include "algorithms/extraction/certified_octree/kernels/shell_kernels.h"
#include "algorithms/extraction/dual_contouring/kernels/leaf_kernels.h"
#include "algorithms/hermite/edge_kernels/edge_kernels.h"
#include "algorithms/lattice/read_signs.h"
#include "algorithms/thesis/adaptive_dual_contouring/qef_kernels.h"
#include "algorithms/voxelization/distance/kernels/kernels.h"
#include "algorithms/voxelization/inside/winding_kernels.h"

namespace hermesh {
namespace simd_level_test {

template <class... Kernels>
struct Families {
  static constexpr int kCount = sizeof...(Kernels);
  /// `level` is the SIMD level for which the kernels were compiled.
  static void expect(SimdLevel level) {
    const bool chosen[] = {(chosen_kernels<Kernels>().level == level)...};
    for (int i = 0; i < kCount; ++i) EXPECT_TRUE(chosen[i]) << "family " << i << " at " << name(level);
  }
};
using All = Families<SignReader, kernels::Kernels, winding::Kernels, qef_kernels::Kernels,
                     leaf_kernels::Kernels, shell_kernels::Kernels, edge_kernels::Kernels>;
static_assert(All::kCount == HERMESH_SIMD_FAMILIES, "a source of hermesh_simd_sources() is not tested here");

TEST(SimdLevel, EveryFamilyOfKernelsIsOfTheLevelThatIsAskedFor) {
  for (const SimdLevel level : available_simd_levels()) {
    setenv("HERMESH_SIMD", std::string(name(level)).c_str(), 1);
    EXPECT_EQ(chosen_simd_level(), level);
    All::expect(level);
  }
  unsetenv("HERMESH_SIMD");
  All::expect(available_simd_levels().back());
}

TEST(SimdLevel, WhatIsNoLevelIsRefused) { EXPECT_THROW(parse_simd_level("mmx"), Error); }

}  // namespace simd_level_test
}  // namespace hermesh
